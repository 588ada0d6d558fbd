from tca_mj.agents.train.config import OffPolicy, OnPolicy, TrainConfig, default_config
from tca_mj.agents.train.deep import train
from tca_mj.agents.train.distil import DistilConfig, Teacher, distil_config
from tca_mj.agents.train.gait_space import GaitSpace
from tca_mj.agents.train.mirrored import MirroredReplayBuffer, mirrored_memory
from tca_mj.agents.train.sb3_env import TaskVecEnv
from tca_mj.agents.train.search import SearchConfig, SearchState

__all__ = [
    "DistilConfig", "GaitSpace", "MirroredReplayBuffer", "OffPolicy", "OnPolicy", "SearchConfig",
    "SearchState", "TaskVecEnv", "Teacher", "TrainConfig", "default_config", "distil_config",
    "mirrored_memory", "train",
]  # fmt: skip
