"""``python -m tca_mj.cli`` is ``tca-mj``."""

import sys

from tca_mj.cli import main

if __name__ == "__main__":
    sys.exit(main())
