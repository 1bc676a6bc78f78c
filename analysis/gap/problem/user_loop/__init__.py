"""Any python-control loop instead of the stated joint and law."""
