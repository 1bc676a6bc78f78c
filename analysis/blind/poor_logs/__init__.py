"""Robots whose logs hold little or are poor: drawn, run in MuJoCo, diagnosed, scored."""
