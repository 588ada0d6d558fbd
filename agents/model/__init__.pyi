from tca_mj.agents.model.data import Transitions, collect
from tca_mj.agents.model.dynamics import TaskModel, View
from tca_mj.agents.model.fit import fit_model, prediction_errors
from tca_mj.agents.model.predictive import ByModel, BySimulation, Horizon, Predictive

__all__ = [
    "ByModel", "BySimulation", "Horizon", "Predictive", "TaskModel", "Transitions", "View",
    "collect", "fit_model", "prediction_errors",
]  # fmt: skip
