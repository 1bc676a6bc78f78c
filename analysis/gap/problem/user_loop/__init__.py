"""Any python-control loop in the place of the stated joint and law."""
