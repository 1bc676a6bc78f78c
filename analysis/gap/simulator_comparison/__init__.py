"""The user's own simulator in the place of the datasheet."""
