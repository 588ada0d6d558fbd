"""Soft and shape-morphing robots driven by twisted-and-coiled actuators (TCAs), in MuJoCo.

Importing the package registers its Gymnasium ids and nothing else: MuJoCo, Rerun and the tasks
are loaded by the modules that need them.

Attributes:
    __version__: Version of the package, the same as in ``pyproject.toml``.
"""

from tca_mj import registry

__version__ = "0.1.0"

registry.register()
