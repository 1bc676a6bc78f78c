"""Several units of one robot: what is common to them, and which one is odd."""
