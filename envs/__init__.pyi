from tca_mj.envs.adaptive import AdaptiveGrasp, AdaptiveGraspVector
from tca_mj.envs.arm import ArmPickPlace, ArmPickPlaceVector
from tca_mj.envs.bistable_grasp import BistableGrasp, BistableGraspVector
from tca_mj.envs.command import Command, Following, Retelling
from tca_mj.envs.course import Places, TetrapodCourse, TetrapodCourseVector
from tca_mj.envs.finger import FingerSense, FingerSenseVector, SensedFinger
from tca_mj.envs.gaits import GaitTask
from tca_mj.envs.grasp import Grasp, GraspVector
from tca_mj.envs.hanging import NoRest, StaticTip, hang
from tca_mj.envs.jump import Jump, JumpVector
from tca_mj.envs.morph import MorphModule, MorphModuleVector, hanging_module
from tca_mj.envs.options import Constant, Option, Options, Uniform, variation_options
from tca_mj.envs.outcome import Headway, TaskState, Verdict
from tca_mj.envs.reach import BendReach, BendReachVector
from tca_mj.envs.recipe import Recipe
from tca_mj.envs.shapes import TetrapodShapes, TetrapodShapesVector
from tca_mj.envs.table import Entry, Table
from tca_mj.envs.task import HEATINGS, SimulatedTask, TaskArguments
from tca_mj.envs.tetrapod import TetrapodGait, TetrapodGaitVector
from tca_mj.envs.vector import TaskVector, register_task
from tca_mj.envs.viewer import NoDisplay, ViewerEnvironment, ViewerPolicy, launch, need_display
from tca_mj.envs.wrappers import RecordRerun, ScaledObservation, VectorScaledObservation

__all__ = [
    "AdaptiveGrasp", "AdaptiveGraspVector", "ArmPickPlace", "ArmPickPlaceVector", "BendReach",
    "BendReachVector", "BistableGrasp", "BistableGraspVector", "Command", "Constant", "Entry",
    "FingerSense", "FingerSenseVector", "Following", "GaitTask", "Grasp", "GraspVector", "HEATINGS",
    "Headway", "Jump", "JumpVector", "MorphModule", "MorphModuleVector", "NoDisplay", "NoRest",
    "Option", "Options", "Places", "Recipe", "RecordRerun", "Retelling", "ScaledObservation",
    "SensedFinger", "SimulatedTask", "StaticTip", "Table", "TaskArguments", "TaskState",
    "TaskVector", "TetrapodCourse", "TetrapodCourseVector", "TetrapodGait", "TetrapodGaitVector",
    "TetrapodShapes", "TetrapodShapesVector", "Uniform", "VectorScaledObservation", "Verdict",
    "ViewerEnvironment", "ViewerPolicy",
    "hang", "hanging_module", "launch", "need_display", "register_task", "variation_options",
]  # fmt: skip
