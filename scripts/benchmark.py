"""Measures the speed of the tasks and their recordings: ``tca-mj bench`` from a checkout.

    python scripts/benchmark.py --out runs/bench
"""

import sys

from tca_mj.cli import main

if __name__ == "__main__":
    sys.exit(main(["bench", *sys.argv[1:]]))
