"""Simulators with a fault: a joint in MuJoCo whose run is not what its model file says."""
