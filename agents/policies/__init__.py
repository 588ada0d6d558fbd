"""Policies: who acts, what it is made of, and its file; beside them those that come with tca_mj.

``gait`` and ``network`` act, ``files`` keeps them, ``load`` makes what is in a file ready for a
task, ``actors`` finds who acts by name. ``sb3_zip`` reads models of Stable-Baselines3, ``onnx``
writes for other runtimes.
"""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)
