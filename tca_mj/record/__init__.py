"""What a simulation did, to be looked at: recordings, pictures, films and plots.

Rerun, which is slow to import, is loaded with ``Recorder``: who draws pictures does not need it.
"""

from tca_mj.lazy import offer

__getattr__, __dir__, __all__ = offer(__name__, __file__)
