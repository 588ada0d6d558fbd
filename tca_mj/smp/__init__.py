"""A spine of shape-memory polymer: modulus, heater, shape fixing and recovery, damage rule."""

from tca_mj.smp.bank import SpineBank, SpinesState
from tca_mj.smp.damage import Damage, DamageSpec, flag_damage, soft_bending_rate
from tca_mj.smp.fixing import SpineState, Spring, advance, fixity, recovery, spring, stored_energy
from tca_mj.smp.heater import HeaterSpec, HeaterState, heat_spine
from tca_mj.smp.material import SOFT_MODULUS, SmpSpec, SpineSpec

__all__ = [
    "SOFT_MODULUS", "Damage", "DamageSpec", "HeaterSpec", "HeaterState", "SmpSpec", "SpineBank",
    "SpineSpec", "SpineState", "SpinesState", "Spring", "advance", "fixity", "flag_damage",
    "heat_spine", "recovery", "soft_bending_rate", "spring", "stored_energy",
]  # fmt: skip
