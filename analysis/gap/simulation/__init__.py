"""Stage 3: the robot as it is simulated under the sampled law."""
