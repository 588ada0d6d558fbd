from tca_mj.certify.cases import Case, Gap
from tca_mj.certify.claims import Claim
from tca_mj.certify.outcomes import FULL, Effort, Outcome
from tca_mj.certify.report import certify
from tca_mj.certify.rest import Load, Rest
from tca_mj.certify.subjects import SUBJECTS, Limb, Subject

__all__ = [
    "Case", "Claim", "Effort", "FULL", "Gap", "Limb", "Load", "Outcome", "Rest", "SUBJECTS",
    "Subject", "certify",
]  # fmt: skip
