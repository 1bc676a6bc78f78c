"""The sampled robot as one block in discrete time: `robot_loop`."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
