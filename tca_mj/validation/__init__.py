"""Published facts about TCAs against what the models here give, recomputed and judged."""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)
