from tca_mj.tca.identify.bench import simulated_bench
from tca_mj.tca.identify.constants import CONSTANTS, Constant, constants_of, with_constants
from tca_mj.tca.identify.data import Data, read_data, write_data
from tca_mj.tca.identify.identified import (
    Compared,
    Ends,
    Found,
    Identification,
    Prediction,
    identify,
)
from tca_mj.tca.identify.logged import Followed, follow_log
from tca_mj.tca.identify.loops import Loop
from tca_mj.tca.identify.reporting import report, sources, stated_errors, write_identification

__all__ = [
    "CONSTANTS", "Compared", "Constant", "Data", "Ends", "Followed", "Found", "Identification",
    "Loop", "Prediction", "constants_of", "follow_log", "identify", "read_data", "report",
    "simulated_bench", "sources", "stated_errors", "with_constants", "write_data",
    "write_identification",
]  # fmt: skip
