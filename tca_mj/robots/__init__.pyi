from tca_mj.robots.arm import ArmSpec
from tca_mj.robots.tetrapod import LEGS, SIDES, SPINES, TetrapodSpec, rigid_tetrapod, set_rigid_bend
from tca_mj.robots.tetrapod_fine import fine_tetrapod

__all__ = [
    "ArmSpec", "LEGS", "SIDES", "SPINES", "TetrapodSpec", "fine_tetrapod", "rigid_tetrapod",
    "set_rigid_bend",
]  # fmt: skip
