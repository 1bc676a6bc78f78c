"""Diagrams: one figure per file."""
