"""The catalogue of unmodelled effects: one file per effect, loaded on first use.

``LIBRARY['coulomb'](level=0.3)`` sets an effect, ``with_effects(plant, [...])`` inserts it,
``sticking(LIBRARY['coulomb'])`` is the same law in the form that truly sticks.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
