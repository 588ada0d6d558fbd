from tca_mj.tca.design.candidates import Figures, Winding, designed
from tca_mj.tca.design.reporting import Lifted, lifted, report, write_designs
from tca_mj.tca.design.search import Design, Designs, NoDesign, find_designs
from tca_mj.tca.design.wish import Space, Wish

__all__ = [
    "Design", "Designs", "Figures", "Lifted", "NoDesign", "Space", "Winding", "Wish", "designed",
    "find_designs", "lifted", "report", "write_designs",
]  # fmt: skip
