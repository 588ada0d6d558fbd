"""From beams and routes to MuJoCo: chains of links, tendons, scenes."""

from tca_mj.model.at_rest import NotSettledError, settle

__all__ = ["NotSettledError", "settle"]
