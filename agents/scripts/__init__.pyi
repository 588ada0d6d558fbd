from tca_mj.agents.scripts.adaptive import AdaptiveGains, AdaptivePolicy
from tca_mj.agents.scripts.arm import PHASES, PickAndPlace, PickAndPlaceGains
from tca_mj.agents.scripts.bistable_grasp import BistableGraspGains, BistableGraspPolicy
from tca_mj.agents.scripts.course import Bend, CourseWalker, Go, stages
from tca_mj.agents.scripts.finger import FingerPolicy, bending_run
from tca_mj.agents.scripts.grasp import GraspGains, GraspPolicy
from tca_mj.agents.scripts.guided import AlongWaypoints, Guided, along_square, square, waypoints
from tca_mj.agents.scripts.jump import JumpPolicy
from tca_mj.agents.scripts.morph import MorphPolicy
from tca_mj.agents.scripts.reach import ReachPolicy
from tca_mj.agents.scripts.tetrapod import CRAWL, GAITS, SHIMMY, STEERING, WALK, gait_policy

__all__ = [
    "AdaptiveGains", "AdaptivePolicy", "AlongWaypoints", "Bend", "BistableGraspGains",
    "BistableGraspPolicy", "CRAWL", "CourseWalker", "FingerPolicy", "GAITS", "Go", "GraspGains",
    "GraspPolicy", "Guided", "JumpPolicy", "MorphPolicy", "PHASES", "PickAndPlace",
    "PickAndPlaceGains", "ReachPolicy", "SHIMMY", "STEERING", "WALK", "along_square", "bending_run",
    "gait_policy", "square", "stages", "waypoints",
]  # fmt: skip
