"""Colours of blocks by value, light enough for their texts."""

from dataclasses import dataclass

LIGHT_TO_STRONG = ["#fff8ee", "#fbc490", "#e8604c"]


@dataclass(frozen=True)
class Shades:
    """Values by block key on one colour scale from `low` to `high`."""

    values: dict
    low: float
    high: float

    def mappable(self):
        """Matplotlib's pair of scale and colours, for a colour bar."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import LinearSegmentedColormap, Normalize

        scale = LinearSegmentedColormap.from_list("share", LIGHT_TO_STRONG)
        return ScalarMappable(Normalize(self.low, self.high), scale)

    def colour(self, key):
        """Colour of a block, or None if it has no value."""
        return self.mappable().to_rgba(self.values[key]) if key in self.values else None
