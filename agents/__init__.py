"""Policies, training and evaluation, imported as ``tca_mj.agents``.

``policies`` act, ``scripts`` are those that come with the tasks, ``train`` makes others.
``rollout`` is the one loop over an episode, which ``evaluate``, ``demo`` and the trainers watch;
``sweep`` does either at many settings. Two functions have the names of their files:
``from tca_mj.agents.evaluate import evaluate``, ``from tca_mj.agents.rollout import rollout``.
"""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)
