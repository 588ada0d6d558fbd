"""A TCA that is still to be wound: ``design`` finds one for a purpose."""

import argparse
from functools import partial
from pathlib import Path
from typing import Any

from tca_mj.cli.arguments import Commands, add, add_command, parse_number, parse_seed

_positive = partial(parse_number, above=0.0)
_AIMS = ("energy", "temperature", "length")
# What is wanted, with its limits: option, unit and words.
_WISHES = (
    ("stroke", "m", "how far it has to contract under the load", True),
    ("load", "N", "what it carries, cold and hot", True),
    ("time", "s", "in which time from cold, at most", True),
    ("voltage", "V", "of the supply", True),
    ("current", "A", "largest of the supply; default: any", False),
    ("return_time", "s", "longest time to give back nine tenths of the stroke; default: any",
     False),
    ("length", "m", "longest length, cold, under the load; default: any", False),
    ("diameter", "m", "largest outer diameter; default: any", False),
    ("temperature", "°C", "hottest; default: where the measurements of the thread end", False),
)  # fmt: skip
_SPANS = (
    ("core_diameter", "m", "diameters of the mandrel's core"),
    ("groove_pitch_angle", "rad", "pitch angles on the mandrel"),
    ("fibre_length", "m", "lengths of the twisted fibre of a strand"),
    ("spring_index", "1", "ratios of the coil's radius to the fibre's"),
)  # fmt: skip


def add_commands(commands: Commands) -> None:
    """Adds design."""
    design = add_command(commands, "design", _design, extra="design",
                         help="find a TCA for a stroke, a load, a time and a supply")  # fmt: skip
    wanted = design.add_argument_group("what is wanted")
    for name, unit, words, needed in _WISHES:
        add(wanted, _option(name), f"{words} [{unit}]", type=_positive, required=needed,
            metavar=unit.upper() if unit != "°C" else "CELSIUS")  # fmt: skip
    there = design.add_argument_group("what it may be wound of")
    add(there, "--thread", "TCAs by which threads are known: files that end in .json, or names in"
        " the catalogue; default: free-stroke", nargs="+", metavar="FILE",
        default=["free-stroke"])  # fmt: skip
    for name, unit, words in _SPANS:
        add(there, _option(name), f"least and largest of the {words} [{unit}]", nargs=2,
            type=_positive, metavar=("FROM", "TO"))  # fmt: skip
    add(there, "--strands", "fewest and most strands side by side", nargs=2,
        type=partial(parse_seed, least=1, most=100), metavar=("FROM", "TO"))  # fmt: skip
    add(there, "--annealing-temperature", "of the oven [°C]; default: 180", type=_positive,
        metavar="CELSIUS")  # fmt: skip
    add(there, "--uncrept", "judge it as it is before it has crept under the load",
        action="store_true")  # fmt: skip
    search = design.add_argument_group("how it is searched")
    add(search, "--aims", f"two to four figures that ought to be small; default: {' '.join(_AIMS)}",
        nargs="+", default=list(_AIMS), metavar="NAME")  # fmt: skip
    add(search, "--population", "designs in a generation; default: 120", default=120,
        type=partial(parse_seed, least=8, most=1000))  # fmt: skip
    add(search, "--generations", "how many of these; default: 100", default=100,
        type=partial(parse_seed, least=1, most=10_000))  # fmt: skip
    add(search, "--seed", "what is drawn comes from it alone; default: 0")
    add(design, "--keep", "how many designs are shown and written; default: 8", default=8,
        type=partial(parse_seed, least=1, most=100))  # fmt: skip
    add(design, "--out", "folder for the TCAs, the report and the picture", required=True)
    add(design, "--no-picture", "draw nothing", action="store_false", dest="picture")


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _design(arguments: argparse.Namespace) -> int:
    """Finds TCAs that lift a load by a stroke within a time on a supply: which thread, mandrel,
    pitch, length and how many strands. Of several aims none is bought without saying what it
    costs in the others: what comes out is the front of all that is not beaten.

    Limits: temperature, a share of the stress at which the thread broke, the spring index, coils
    that do not touch, and what --current, --length and the like say.

    Writes into the folder --out:
      tca.json, tca-2.json ...   TCAs for --tca, the first one nearest to the best of all aims
      report.md, report.json     the table, how to wind the first one, what to know; the whole front
      designs.png                the front, and the first one in a lift (needs the extra demo)

    Exit code: 0 if there is one, 2 if not or if the command was wrong.

    examples:
      tca-mj design --stroke 0.02 --load 0.3 --time 5 --voltage 6 --out runs/lift
      tca-mj design --stroke 0.01 --load 1 --time 3 --voltage 9 --current 2 --length 0.08 \\
          --thread free-stroke mine.json --aims energy mass --out runs/finger
    """
    from tca_mj.tca import find_tca
    from tca_mj.tca.design import Space, Wish, find_designs, report, write_designs
    from tca_mj.tca.design.reporting import PICTURE

    if arguments.picture:
        from tca_mj.validation.figures import need_matplotlib

        need_matplotlib()
    wanted = _given(arguments, (name for name, *_ in _WISHES))
    wish = Wish(**wanted | ({"creep": None} if arguments.uncrept else {}))
    spans = (*(name for name, *_ in _SPANS), "strands", "annealing_temperature")
    threads = {Path(each).stem: find_tca(each) for each in arguments.thread}
    found = find_designs(
        wish, Space(threads=threads, **_given(arguments, spans)), aims=tuple(arguments.aims),
        population=arguments.population, generations=arguments.generations, seed=arguments.seed,
    )  # fmt: skip
    write_designs(found, arguments.out, arguments.keep, picture_too=arguments.picture)
    if arguments.picture:
        from tca_mj.validation.designs import designs_picture

        designs_picture(found, arguments.out / PICTURE)
    print(report(found, arguments.keep))
    print(f"\n{arguments.out / 'tca.json'}\n{arguments.out / 'report.md'}")
    return 0


def _given(arguments: argparse.Namespace, names: Any) -> dict[str, Any]:
    """What the command line says, without what it leaves to the defaults."""
    said = {name: getattr(arguments, name) for name in names}
    return {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in said.items() if value is not None
    }  # fmt: skip
