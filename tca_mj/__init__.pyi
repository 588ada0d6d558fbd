from tca_mj.actuation import Group, MixedBank, MixedState, Muscle, MuscleBank
from tca_mj.batch import SimulationBatch
from tca_mj.drive import Drive, Haste, SimulationDiverged, SimulationOverheated
from tca_mj.envs.vector import register_task
from tca_mj.exported import export, frozen
from tca_mj.model.build import add_tca, stage
from tca_mj.model.chain import Chain, add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.scene import in_arena, scene
from tca_mj.model.tendon import RoutedTca
from tca_mj.modules.bending import BendingSpec, bending_module
from tca_mj.modules.bistable import BistableSpec, bistable_module
from tca_mj.modules.continuum_leg import LegSpec, continuum_leg
from tca_mj.modules.finger import FingerPairSpec, finger_pair
from tca_mj.modules.innervated import InnervatedFingerSpec, innervated_finger
from tca_mj.modules.morphing import MorphingSpec, morphing_module
from tca_mj.modules.morphing_square import (
    Morphing3dSpec,
    TwistMorphingSpec,
    morphing_3d_module,
    twist_morphing_module,
)
from tca_mj.modules.soft_finger import SoftFingerSpec, soft_finger
from tca_mj.modules.twisting import TwistingSpec, twisting_module
from tca_mj.record.film import Film
from tca_mj.record.recorder import Recorder
from tca_mj.registry import TASKS, Task, episode_steps, find_task, make, register, task_class
from tca_mj.robots.adaptive_gripper import AdaptiveGripperSpec, adaptive_gripper
from tca_mj.robots.arm import ArmSpec, arm
from tca_mj.robots.bistable_gripper import BistableGripperSpec, bistable_gripper
from tca_mj.robots.gripper import GripperSpec, gripper
from tca_mj.robots.jumper import JumperSpec, jumper
from tca_mj.robots.morphing_grid import MorphingGridSpec, morphing_grid
from tca_mj.robots.tetrapod import TetrapodSpec, rigid_tetrapod, tetrapod
from tca_mj.rod.beam import BeamSpec, Outline
from tca_mj.routes import Helix, Route, UTurn, leg_length, parallel
from tca_mj.sim import Simulation
from tca_mj.state import SimulationState, get_state, set_state
from tca_mj.tca.bank import TcaBank
from tca_mj.tca.catalogue import CATALOGUE
from tca_mj.tca.spec import FibreSpec, TcaSpec
from tca_mj.tca.supply import Supply, Thermostat
from tca_mj.traces import Trace, TraceFit, fit_traces
from tca_mj.variation import Nominal, Variation

__version__: str
__all__ = [
    "AdaptiveGripperSpec", "ArmSpec", "BeamSpec", "BendingSpec", "BistableGripperSpec",
    "BistableSpec", "CATALOGUE", "Chain", "Drive", "FibreSpec", "Film", "FingerPairSpec",
    "GripperSpec", "Group", "Haste", "Helix", "InnervatedFingerSpec", "JumperSpec", "LegSpec",
    "MixedBank", "MixedState", "Morphing3dSpec", "MorphingGridSpec", "MorphingSpec", "Muscle",
    "MuscleBank", "Nominal", "Outline", "Part", "Recorder", "Route", "RoutedTca", "Simulation",
    "SimulationBatch", "SimulationDiverged", "SimulationOverheated", "SimulationState",
    "SoftFingerSpec", "Supply", "TASKS", "Task", "TcaBank", "TcaSpec", "TetrapodSpec", "Thermostat",
    "Trace", "TraceFit", "TwistMorphingSpec", "TwistingSpec", "UTurn", "Variation",
    "adaptive_gripper", "add_chain", "add_tca", "arm", "bending_module", "bistable_gripper",
    "bistable_module", "continuum_leg", "episode_steps", "export", "find_task", "finger_pair",
    "fit_traces", "frozen", "get_state", "gripper", "in_arena", "innervated_finger", "jumper",
    "leg_length", "make", "morphing_3d_module", "morphing_grid", "morphing_module", "new_spec",
    "parallel", "register", "register_task", "rigid_tetrapod", "scene", "set_state", "soft_finger",
    "stage", "task_class", "tetrapod", "twist_morphing_module", "twisting_module",
]  # fmt: skip
