"""The simulator as suspect: what it does otherwise than its files state."""
