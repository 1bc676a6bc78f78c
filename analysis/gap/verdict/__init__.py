"""Stage 8: from fits to probabilities, the unknown included."""
