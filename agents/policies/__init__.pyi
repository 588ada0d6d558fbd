from tca_mj.agents.policies.actors import Blind, actor, arguments_of, best_of, first_gait, scripted
from tca_mj.agents.policies.files import (
    NetworkPolicy,
    Origin,
    Policy,
    ResidualPolicy,
    SavedPolicy,
    find,
    load_policy,
    require_arguments,
    shipped,
    with_clock,
)
from tca_mj.agents.policies.gait import GaitPolicy
from tca_mj.agents.policies.network import Network

__all__ = [
    "Blind", "GaitPolicy", "Network", "NetworkPolicy", "Origin", "Policy", "ResidualPolicy",
    "SavedPolicy", "actor", "arguments_of", "best_of", "find", "first_gait", "load_policy",
    "require_arguments", "scripted", "shipped", "with_clock",
]  # fmt: skip
