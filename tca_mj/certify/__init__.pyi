from tca_mj.certify.cases import Case, Gap
from tca_mj.certify.claims import Claim
from tca_mj.certify.outcomes import FULL, Effort, Outcome
from tca_mj.certify.parts import Limb, Outside, Seen
from tca_mj.certify.report import certify
from tca_mj.certify.rest import Load, Rest, Touching
from tca_mj.certify.robots import certify_robot
from tca_mj.certify.subjects import SUBJECTS, Subject

__all__ = [
    "Case", "Claim", "Effort", "FULL", "Gap", "Limb", "Load", "Outcome", "Outside", "Rest",
    "SUBJECTS", "Seen", "Subject", "Touching", "certify", "certify_robot",
]  # fmt: skip
