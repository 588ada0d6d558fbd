from tca_mj.robots.adaptive_gripper import AdaptiveGripperSpec, hardened_gripper
from tca_mj.robots.arm import ArmSpec
from tca_mj.robots.bistable_gripper import BistableGripperSpec, bistable_hand
from tca_mj.robots.gripper import GripperSpec
from tca_mj.robots.jumper import JumperSpec
from tca_mj.robots.lift import LiftSpec
from tca_mj.robots.morphing_grid import MorphingGridSpec
from tca_mj.robots.tetrapod import LEGS, SIDES, SPINES, TetrapodSpec, rigid_tetrapod, set_rigid_bend
from tca_mj.robots.tetrapod_fine import fine_tetrapod

__all__ = [
    "AdaptiveGripperSpec", "ArmSpec", "BistableGripperSpec", "GripperSpec", "JumperSpec", "LEGS",
    "LiftSpec", "MorphingGridSpec", "SIDES", "SPINES", "TetrapodSpec", "bistable_hand",
    "fine_tetrapod", "hardened_gripper", "rigid_tetrapod", "set_rigid_bend",
]  # fmt: skip
