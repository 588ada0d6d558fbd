from tca_mj.agents.model.data import Transitions, collect

__all__ = ["Transitions", "collect"]
