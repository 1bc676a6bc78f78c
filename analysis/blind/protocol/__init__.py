"""The protocol of a sealed study: seeds, seals, targets, and the order of the work."""
