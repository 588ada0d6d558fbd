"""Builds a tree of links in which type checkers and editors find the package as it is installed.

``envs``, ``agents`` and ``assets`` are mapped into ``tca_mj`` by an import hook that only a running
Python obeys. This script links the true layout into ``build/typing/tca_mj``, where mypy and pyright
are told to look. The links follow new files inside a folder; run it again after adding a file or a
folder directly under ``tca_mj``.
"""

import argparse
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MAPPED = ("envs", "agents", "assets")


def link_package(root: Path) -> Path:
    """Replaces ``root/build/typing`` by links to the parts of the package.

    Args:
        root: Checkout that holds ``tca_mj`` and the mapped folders.

    Returns:
        The folder that stands for the package.

    Raises:
        OSError: If the system refuses to make links, as Windows may do.
    """
    tree = root / "build" / "typing" / "tca_mj"
    if tree.parent.exists():
        shutil.rmtree(tree.parent)
    tree.mkdir(parents=True)
    own = [path for path in (root / "tca_mj").iterdir() if path.name != "__pycache__"]
    for source in own + [root / name for name in MAPPED]:
        (tree / source.name).symlink_to(source, target_is_directory=source.is_dir())
    return tree


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__).parse_args()
    print(link_package(ROOT))
