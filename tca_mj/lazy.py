"""What a package offers, loaded when it is first asked for: nobody waits for what they do not use.

The names stand once, in a stub ``__init__.pyi`` beside the package's ``__init__.py``, where editors
and type checkers read them as well. ``import tca_mj.tca`` alone computes nothing and loads nothing.
"""

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

_Offer = tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]


def offer(package: str, file: str) -> _Offer:
    """What a package needs to offer the names that its stub imports.

    Args:
        package: Name of the package, its ``__name__``.
        file: Its ``__file__``.

    Returns:
        Its ``__getattr__``, which finds its modules, too; its ``__dir__``; and its ``__all__``. A
        name that the stub imports as itself, ``X as X``, is found, but not offered.

    Raises:
        OSError: If there is no stub.
    """
    stub = ast.parse(Path(file).with_suffix(".pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    homes = {alias.name: str(node.module) for node in imports for alias in node.names}
    names = sorted(alias.name for node in imports for alias in node.names if not alias.asname)

    def load(name: str) -> Any:
        if name in homes:
            return getattr(import_module(homes[name]), name)
        if not name.startswith("_") and find_spec(f"{package}.{name}"):
            return import_module(f"{package}.{name}")
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    def listed() -> list[str]:
        return sorted({*vars(sys.modules[package]), *names})

    return load, listed, names
