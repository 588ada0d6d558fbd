from tca_mj.smp.bank import SpineBank, SpinesState
from tca_mj.smp.convection import Air, Slab, moving_air, radiation, still_air
from tca_mj.smp.damage import Damage, DamageSpec, flag_damage, soft_bending_rate
from tca_mj.smp.fixing import SpineState, Spring, advance, fixity, recovery, spring, stored_energy
from tca_mj.smp.heater import HOLD_TEMPERATURE, HeaterSpec, HeaterState, fan_gain, heat_spine
from tca_mj.smp.lumped import LumpedModule, ModuleSolveError, ModuleState, in_tube, sheathed
from tca_mj.smp.material import SOFT_MODULUS, SmpSpec, SpineSpec

__all__ = [
    "Air", "Damage", "DamageSpec", "HOLD_TEMPERATURE", "HeaterSpec", "HeaterState", "LumpedModule",
    "ModuleSolveError", "ModuleState", "SOFT_MODULUS", "Slab", "SmpSpec", "SpineBank", "SpineSpec",
    "SpineState", "SpinesState", "Spring", "advance", "fan_gain", "fixity", "flag_damage",
    "heat_spine", "in_tube", "moving_air", "radiation", "recovery", "sheathed", "soft_bending_rate",
    "spring", "still_air", "stored_energy",
]  # fmt: skip
