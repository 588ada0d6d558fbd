from tca_mj.model.at_rest import NotSettledError, settle
from tca_mj.model.build import VIEW, add_tca, stage
from tca_mj.model.chain import MOTIONS, Chain, Holder, Member, Motion, add_chain
from tca_mj.model.mujoco_warnings import count_warnings, warning_counts, warning_line
from tca_mj.model.part import Part, new_spec, set_options
from tca_mj.model.scene import in_arena, load
from tca_mj.model.spine import RoutedSpine, lumped_torsion, route_spine, sheath
from tca_mj.model.tendon import (
    Crossing,
    Pass,
    RoutedTca,
    Run,
    lay_tca,
    path_length,
    route_passes,
    route_tca,
)

__all__ = [
    "Chain", "Crossing", "Holder", "MOTIONS", "Member", "Motion", "NotSettledError", "Part", "Pass",
    "RoutedSpine", "RoutedTca", "Run", "VIEW", "add_chain", "add_tca", "count_warnings", "in_arena",
    "lay_tca", "load", "lumped_torsion", "new_spec", "path_length", "route_passes", "route_spine",
    "route_tca", "set_options", "settle", "sheath", "stage", "warning_counts", "warning_line",
]  # fmt: skip
