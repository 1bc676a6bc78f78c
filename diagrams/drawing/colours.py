"""Colours of blocks by value, light enough for their texts."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Shades:
    """Values by block key on one colour scale from `low` to `high`."""

    values: dict
    low: float
    high: float
    scale: str = "OrRd"

    def mappable(self):
        """Matplotlib's pair of scale and colours, for a colour bar."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        return ScalarMappable(Normalize(self.low, self.high), self.scale)

    def colour(self, key):
        """Colour of a block, or None if it has no value."""
        return self.mappable().to_rgba(self.values[key]) if key in self.values else None

    def ink(self, key):
        """Black or white, whichever can be read on the block's colour."""
        red, green, blue, _ = self.colour(key)
        return "#1f2933" if 0.299 * red + 0.587 * green + 0.114 * blue > 0.5 else "white"
