"""The sim-to-real gap: where a model is wrong, which effect causes it, how far the gap shrinks.

One folder per stage, in the order in which `diagnose` runs them; a stage imports only stages
that stand before it.
"""

import lazy_loader

STAGES = ("method", "problem", "controller", "simulation", "causes", "residual", "fitting",
          "search", "verdict", "assessment", "report")

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
