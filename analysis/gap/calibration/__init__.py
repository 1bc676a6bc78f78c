"""Training of the calibration in ``method.json``, and sweeps of any threshold."""
