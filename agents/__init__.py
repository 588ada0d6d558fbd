"""Policies, training and evaluation, imported as ``tca_mj.agents``.

``policies`` act, ``scripts`` are those that come with the tasks, ``train`` makes others.
``rollout`` is the one loop over an episode, which ``evaluate``, ``demo`` and the trainers watch;
``sweep`` does either at many settings.
"""
