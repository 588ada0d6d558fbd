"""What makes policies: ``search`` over the figures of a gait, ``deep`` reinforcement learning, and
``distil``, which makes one of several.

``from tca_mj.agents.train.search import search``; the function has the name of its file, as
``distil`` has.
"""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)
