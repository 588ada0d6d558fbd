from tca_mj.agents.demo import play
from tca_mj.agents.design import designed, robot_of
from tca_mj.agents.episode import Episode
from tca_mj.agents.evaluate import METRICS, Evaluation, cell, figures, label, run_episode
from tca_mj.agents.finished import kept
from tca_mj.agents.rollout import Step, earned, tally
from tca_mj.agents.sweep import Sweep, Trial, run_sweep

__all__ = [
    "Episode", "Evaluation", "METRICS", "Step", "Sweep", "Trial", "cell", "designed", "earned",
    "figures", "kept", "label", "play", "robot_of", "run_episode", "run_sweep", "tally",
]  # fmt: skip
