"""Published facts about TCAs against what the models here give, recomputed and judged."""

from tca_mj.validation.facts import Finding, Verdict, table
from tca_mj.validation.report import validate_tca

__all__ = ["Finding", "Verdict", "table", "validate_tca"]
