"""Soft and shape-morphing robots driven by twisted-and-coiled actuators (TCAs), in MuJoCo.

Importing the package registers its Gymnasium ids and nothing else: MuJoCo, Rerun and the tasks
are loaded by the modules that need them. What is typed most stands here, too, and is loaded when it
is first asked for: ``tca_mj.Simulation`` is ``tca_mj.sim.Simulation``; ``dir(tca_mj)`` lists all.
So does every package offer what it has for users, in its ``__all__``; other names may change.

Without Gymnasium there are no ids: ``import tca_mj.tca``, the physics of TCAs, needs NumPy and
SciPy alone.

Attributes:
    __version__: Version of the package, the same as in ``pyproject.toml``.
"""

from tca_mj.lazy import offer

__version__ = "0.2.0"

try:
    from tca_mj import registry
except ModuleNotFoundError as missing:
    if missing.name != "gymnasium":
        raise
else:
    registry.register()

__getattr__, __dir__, __all__ = offer(__name__, __file__)
