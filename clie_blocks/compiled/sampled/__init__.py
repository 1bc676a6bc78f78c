"""Diagrams with sampled controllers."""
