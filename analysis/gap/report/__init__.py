"""The report of a diagnosis: one HTML page, its JSON, and the numbers for a simulator."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
