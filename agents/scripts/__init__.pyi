from tca_mj.agents.scripts.arm import PHASES, PickAndPlace, PickAndPlaceGains
from tca_mj.agents.scripts.course import Bend, CourseWalker, Go, stages
from tca_mj.agents.scripts.morph import MorphPolicy
from tca_mj.agents.scripts.reach import ReachPolicy
from tca_mj.agents.scripts.tetrapod import CRAWL, GAITS, SHIMMY, STEERING, WALK, gait_policy

__all__ = [
    "Bend", "CRAWL", "CourseWalker", "GAITS", "Go", "MorphPolicy", "PHASES", "PickAndPlace",
    "PickAndPlaceGains", "ReachPolicy", "SHIMMY", "STEERING", "WALK", "gait_policy", "stages",
]  # fmt: skip
