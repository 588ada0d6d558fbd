"""The picture and the tables of docs/design.md.

    python scripts/design_page.py    three minutes; writes page (from its mark on) and picture
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from tca_mj.files import write_whole
from tca_mj.pages import command_line, page, picture, table
from tca_mj.tca.design import Designs, NoDesign, Wish, find_designs, lifted, report
from tca_mj.validation.designs import designs_picture

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "design.md"
PICTURE = ROOT / "docs" / "pictures" / "design.png"
MARKER = "<!-- Written by scripts/design_page.py from here on. -->\n"
WISH = Wish(stroke=0.02, load=0.3, time=5.0, voltage=6.0, current=3.0)
SEEDS = range(10)
SUPPLIES = ((12.0, math.inf), (6.0, math.inf), (6.0, 3.0), (6.0, 1.0), (3.0, 1.0), (1.5, 1.0))


def example(found: Designs) -> str:
    """What the command prints, a level further down."""
    return report(found).replace("\n## ", "\n### ").partition("\n")[2].strip()


def checked(found: Designs) -> str:
    """How far the integrals are from steps through time, in words."""
    worst = 0.0
    for i in found.spread(8):
        each = found.front[i]
        lift = lifted(found.wish, each, dt=float(each.figures.time) / 1000)
        top = int(lift.contraction.argmax())
        worst = max(worst, abs(lift.time[top] / float(each.figures.time) - 1.0))
    return (
        "Stepped through time in a thousand steps (`lifted`), the eight reach the stroke within"
        f" {100.0 * worst:.1f} % of the time that the integral says."
    )


def supplies() -> str:
    """What the supply decides, as Markdown."""
    rows = []
    for volts, amperes in SUPPLIES:
        limit = f"{amperes:g} A" if amperes < math.inf else "any"
        try:
            found = find_designs(replace(WISH, voltage=volts, current=amperes))
        except NoDesign as error:
            rows.append([f"{volts:g} V", limit, str(error).partition("misses: ")[2], "", "", ""])
            continue
        best = found.best.figures
        rows.append([
            f"{volts:g} V", limit, f"{found.values('energy').min():.1f}",
            f"{found.values('temperature').min():.0f}", f"{1e3 * found.values('length').min():.0f}",
            f"{best.energy:.1f} J, {best.temperature:.0f} °C, {1e3 * best.length:.0f} mm,"
            f" {best.time:.1f} s",
        ])  # fmt: skip
    heads = ["supply", "current", "least energy [J]", "coolest [°C]", "shortest [mm]",
             "nearest to all"]  # fmt: skip
    return "\n".join(table(heads, rows))


def seeds() -> str:
    """How far fronts of several seeds are apart, in words."""
    best = np.array([
        [find_designs(WISH, seed=seed).values(name).min() for name in ("energy", "temperature",
                                                                       "length")]
        for seed in SEEDS
    ])  # fmt: skip
    spread = 100.0 * (best.max(axis=0) / best.min(axis=0) - 1.0)
    return (
        f"Over {len(SEEDS)} seeds the least energy differs by {spread[0]:.1f} %, the lowest"
        f" temperature by {spread[1]:.1f} %, the shortest length by {spread[2]:.1f} %."
    )


def main() -> None:
    """Writes both."""
    command_line(__doc__).parse_args()
    found = find_designs(WISH)
    designs_picture(found, PICTURE)
    caption = (
        "The front: energy, temperature, length as colour, numbers as in the table. Right: number 1"
        " stepped through a lift and its return."
    )
    head = PAGE.read_text(encoding="utf-8").partition(MARKER)[0]
    text = page(
        example(found).replace("\n### How to", f"\n{picture(caption, 'pictures/design.png')}"
                               "\n\n### How to", 1),  # fmt: skip
        "## How sure it is", checked(found) + " " + seeds(),
        "## What the supply decides",
        "20 mm under 0.3 N within 5 s; the best in each aim alone, and the one nearest to all:",
        supplies(),
    )  # fmt: skip
    write_whole(PAGE, (head + MARKER + "\n" + text + "\n").encode())


if __name__ == "__main__":
    main()
