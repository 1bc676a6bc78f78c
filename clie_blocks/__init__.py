"""Closed-loop input error identification of robot joints, as python-control block diagrams.

The names below are imported when they are first used, so that ``import clie_blocks`` is fast.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
