"""A log of one's own bench: ``replay`` runs it through the model."""

import argparse
from pathlib import Path

from tca_mj.cli.arguments import Commands, add, add_command


def add_commands(commands: Commands) -> None:
    """Adds replay."""
    replay = add_command(commands, "replay", _replay, extra="demo",
                         help="run a logged bench experiment through the model")  # fmt: skip
    add(replay, "log", "CSV file, with units in the header", type=Path, metavar="LOG")
    add(replay, "--tca", "a file that ends in .json, or a name in the catalogue", required=True,
        metavar="FILE")  # fmt: skip
    add(replay, "--out", "folder for the picture and the model's course; default: write nothing")
    add(replay, "--ends", "whether an end may spin, if the log does not say so; default: locked",
        choices=["free", "locked"])  # fmt: skip


def _replay(arguments: argparse.Namespace) -> int:
    """Runs a log of a bench, time and voltages, currents, powers or pulses, through the model of a
    TCA, and says how far what was measured is from it. Where the log has a resistance, or voltage
    and current, an observer is judged as well: it knows nothing but those.

    A log says in its first row what it has, as "time [s], voltage [V], length [mm]"; a "duty [1]"
    makes pulses of the voltage; lines before it may say what holds for all rows: "# load [g]: 30".

    Writes into the folder --out:
      replay.csv           what the model shows, as a log
      replay.txt           the errors in words
      replay.png           measured, model and observer (needs the extra demo)

    examples:
      tca-mj replay log.csv --tca mine.json --out runs/replay
    """
    from tca_mj.files import write_whole
    from tca_mj.tca import find_tca
    from tca_mj.tca.identify import follow_log, read_data, write_data

    tca, out = find_tca(arguments.tca), arguments.out
    if out is not None:
        from tca_mj.validation.figures import need_matplotlib

        need_matplotlib()
    found = follow_log(read_data(arguments.log, tca), tca, arguments.ends)
    text = "\n".join(found.words())
    print(text)
    if out is not None:
        from tca_mj.validation.residuals import log_picture

        names = [out / f"replay.{ending}" for ending in ("csv", "txt", "png")]
        write_data(found.as_data(), names[0])
        write_whole(names[1], f"{text}\n".encode())
        log_picture(found, names[2])
        print("\n" + "\n".join(map(str, names)))
    return 0
