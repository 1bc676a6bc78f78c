"""The simulation of any python-control loop with causes at its ports."""
