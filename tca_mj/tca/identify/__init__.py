"""A TCA from measurements: its constants with errors, and what the data do not tell."""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)
