"""Robots under other control laws than PD: drawn, run in MuJoCo, diagnosed, scored."""
