"""The user's own simulator instead of the datasheet."""
