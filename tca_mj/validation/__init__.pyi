from tca_mj.validation.attitude import Bend, Bent, arc, bent, by_place
from tca_mj.validation.facts import Finding, Verdict, table
from tca_mj.validation.report import validate_tca

__all__ = [
    "Bend", "Bent", "Finding", "Verdict", "arc", "bent", "by_place", "table", "validate_tca",
]  # fmt: skip
