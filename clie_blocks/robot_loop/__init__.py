"""The sampled robot as one block in discrete time."""
