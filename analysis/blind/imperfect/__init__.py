"""Imperfect logs: what exporters and robot files get wrong, and what a diagnosis makes of it."""
