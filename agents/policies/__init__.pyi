from tca_mj.agents.policies.actors import Blind, Script, actor, arguments_of, first_gait, scripted
from tca_mj.agents.policies.contracts import contract, differences, digest
from tca_mj.agents.policies.files import (
    NetworkPolicy,
    Origin,
    Policy,
    ResidualPolicy,
    SavedPolicy,
    with_clock,
)
from tca_mj.agents.policies.gait import GaitPolicy
from tca_mj.agents.policies.load import (
    find,
    load_policy,
    read_zip,
    require_arguments,
    saved_policy,
    shipped,
)
from tca_mj.agents.policies.network import Network
from tca_mj.agents.policies.preprocessing import Preprocessing, Statistics
from tca_mj.agents.policies.sb3_zip import Model

__all__ = [
    "Blind", "GaitPolicy", "Model", "Network", "NetworkPolicy", "Origin", "Policy", "Preprocessing",
    "ResidualPolicy", "SavedPolicy", "Script", "Statistics", "actor", "arguments_of", "contract",
    "differences", "digest", "find", "first_gait", "load_policy", "read_zip", "require_arguments",
    "saved_policy", "scripted",
    "shipped", "with_clock",
]  # fmt: skip
