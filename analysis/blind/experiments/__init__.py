"""Blind study: the recommended run is executed, until one name remains."""
