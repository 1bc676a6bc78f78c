"""The independent engine: MuJoCo bodies, drives, encoders and sampled controllers."""
