"""Training of the numbers in ``method.json`` on simulated robots."""
