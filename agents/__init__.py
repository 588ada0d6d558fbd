"""Controllers, training and evaluation, imported as ``tca_mj.agents``."""
