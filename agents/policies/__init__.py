"""Policies: who acts, what it is made of, and its file; beside them those that come with tca_mj.

``gait`` and ``network`` act, ``files`` keeps them, ``actors`` finds them by name.
"""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)
