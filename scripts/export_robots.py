"""Writes every module and robot as MJCF, with cold TCAs, to assets/mjcf/exported/NAME.xml.

    python scripts/export_robots.py

For other temperatures: ``tca_mj.export(part, path, temperatures=...)``.
"""

from pathlib import Path

from tca_mj.exported import export
from tca_mj.modules.bending import bending_module
from tca_mj.modules.continuum_leg import continuum_leg
from tca_mj.modules.finger import finger_pair
from tca_mj.modules.morphing import morphing_module
from tca_mj.modules.twisting import twisting_module
from tca_mj.pages import command_line
from tca_mj.robots.arm import arm
from tca_mj.robots.tetrapod import rigid_tetrapod, tetrapod

FOLDER = Path(__file__).resolve().parent.parent / "assets" / "mjcf" / "exported"
BUILDERS = {
    builder.__name__: builder
    for builder in (
        bending_module, twisting_module, finger_pair, morphing_module, continuum_leg, arm,
        tetrapod, rigid_tetrapod,
    )
}  # fmt: skip


def main() -> None:
    """Writes the files."""
    command_line(__doc__).parse_args()
    FOLDER.mkdir(exist_ok=True)
    for name, builder in BUILDERS.items():
        text = export(builder(), FOLDER / f"{name}.xml")
        print(f"{name}.xml: {len(text) // 1000} kB")


if __name__ == "__main__":
    main()
