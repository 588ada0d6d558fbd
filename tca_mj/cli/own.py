"""A TCA of one's own: ``identify`` finds its constants in measurements."""

import argparse
from pathlib import Path

from tca_mj.cli.arguments import Commands, add, add_command, parse_option


def add_commands(commands: Commands) -> None:
    """Adds identify."""
    identify = add_command(commands, "identify", _identify, extra="demo",
                           help="find the constants of a TCA in measurements")  # fmt: skip
    add(identify, "data", "CSV files, with units in the header", nargs="+", type=Path,
        metavar="DATA")  # fmt: skip
    add(identify, "--tca", "what is known of it: a file that ends in .json, or a name in the"
        " catalogue", required=True, metavar="FILE")  # fmt: skip
    add(identify, "--out", "folder for the TCA, the report and the pictures", required=True)
    add(identify, "--free", "constants to be fitted; default: all but what a ruler or a balance"
        " says", nargs="+", metavar="NAME")  # fmt: skip
    add(identify, "--error", "standard error of a constant that was measured, in SI units; several"
        " times for several; default: those that the file of --tca states", type=parse_option,
        action="append", default=[], metavar="NAME=VALUE")  # fmt: skip
    add(identify, "--noise", "standard deviation of a measured quantity, in SI units; default: 0.5"
        " K, and 1 %% of the largest value", type=parse_option, action="append", default=[],
        metavar="NAME=VALUE")  # fmt: skip
    add(identify, "--law", "the model; default rod, which simulations use", default="rod",
        choices=["rod", "love", "cst", "linear"])  # fmt: skip
    add(identify, "--ends", "whether an end may spin, in files that do not say so; usual is free"
        " where a load hangs and locked where a force is read; default: the data are asked",
        choices=["free", "locked", "usual"])  # fmt: skip
    add(identify, "--held-out", "CSV files that are not fitted but judged", nargs="+", type=Path,
        default=[], metavar="DATA")  # fmt: skip
    add(identify, "--no-compare", "do not fit the other models", action="store_false",
        dest="compare")  # fmt: skip
    add(identify, "--no-pictures", "draw nothing", action="store_false", dest="pictures")


def _identify(arguments: argparse.Namespace) -> int:
    """Fits the constants of a TCA to measurements, with errors: which of them the data identify,
    which not and what would, and which model and end condition they support.

    A file says in its first row what it has, as "time [s], voltage [V], temperature [degC], length
    [mm]"; lines before it may say what holds for all rows: "# load [g]: 30", "# ends: free".
    docs/own-muscle.md tells what to measure.

    Writes into the folder --out:
      tca.json             the TCA, for --tca and robots of one's own
      report.md            constants, errors, words, what was mended in the files
      report.json          the same as data, with the covariance
      *.png                each file with its residuals (needs the extra demo)

    examples:
      tca-mj identify length.csv force.csv --tca known.json --out runs/mine
      tca-mj identify *.csv --tca free-stroke --error coil_radius=1e-5 --out runs/mine
    """
    from tca_mj.tca import find_tca, read_tca
    from tca_mj.tca.identify import (
        identify,
        read_data,
        report,
        stated_errors,
        write_identification,
    )

    tca, out, errors = find_tca(arguments.tca), arguments.out, dict(arguments.error)
    if arguments.tca.endswith(".json"):
        errors = stated_errors(read_tca(arguments.tca).provenance) | errors
    if arguments.pictures:
        from tca_mj.validation.figures import need_matplotlib

        need_matplotlib()
    data = [read_data(path, tca) for path in arguments.data]
    held = [read_data(path, tca) for path in arguments.held_out]
    found = identify(
        data, tca, free=arguments.free, errors=errors, law=arguments.law, ends=arguments.ends,
        noise=dict(arguments.noise), compare=arguments.compare,
    )  # fmt: skip
    write_identification(found, out, held, arguments.pictures)
    if arguments.pictures:
        from tca_mj.tca.identify.reporting import picture_name
        from tca_mj.validation.residuals import residuals_picture

        for each in (*found.data, *held):
            residuals_picture(found, each, out / picture_name(each))
    print(report(found, held))
    print(f"\n{out / 'tca.json'}\n{out / 'report.md'}\n{out / 'report.json'}")
    return 0
