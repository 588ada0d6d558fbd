"""Soft and shape-morphing robots driven by twisted-and-coiled actuators (TCAs), in MuJoCo.

Importing the package registers its Gymnasium ids and nothing else: MuJoCo, Rerun and the tasks
are loaded by the modules that need them. What is typed most stands here, too, and is loaded when it
is first asked for: ``tca_mj.Simulation`` is ``tca_mj.sim.Simulation``; ``dir(tca_mj)`` lists all.

Without Gymnasium there are no ids: ``import tca_mj.tca``, the physics of TCAs, needs NumPy and
SciPy alone.

Attributes:
    __version__: Version of the package, the same as in ``pyproject.toml``.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

try:
    from tca_mj import registry
except ModuleNotFoundError as missing:
    if missing.name != "gymnasium":
        raise
else:
    registry.register()

# Where the nouns come from.
_NOUNS = {
    "CATALOGUE": "tca", "Supply": "tca", "TcaBank": "tca", "TcaSpec": "tca", "Thermostat": "tca",
    "BeamSpec": "rod", "Outline": "rod", "Helix": "routes", "UTurn": "routes", "parallel": "routes",
    "Part": "model.part", "new_spec": "model.part", "add_chain": "model.chain",
    "add_tca": "model.build", "stage": "model.build", "scene": "model.scene",
    "Simulation": "sim", "Drive": "sim", "export": "exported", "Recorder": "record",
    "Film": "record.film",
    "BendingSpec": "modules.bending", "bending_module": "modules.bending",
    "FingerPairSpec": "modules.finger", "finger_pair": "modules.finger",
    "LegSpec": "modules.continuum_leg", "continuum_leg": "modules.continuum_leg",
    "MorphingSpec": "modules.morphing", "morphing_module": "modules.morphing",
    "TwistingSpec": "modules.twisting", "twisting_module": "modules.twisting",
    "ArmSpec": "robots.arm", "arm": "robots.arm",
    "TetrapodSpec": "robots.tetrapod", "tetrapod": "robots.tetrapod",
    "rigid_tetrapod": "robots.tetrapod", "make": "registry",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    if name in _NOUNS:
        return getattr(import_module(f"tca_mj.{_NOUNS[name]}"), name)
    raise AttributeError(f"module 'tca_mj' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *_NOUNS])
