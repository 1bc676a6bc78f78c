"""The robots of a study: drawn at random, given an effect, logged, written to disk."""
