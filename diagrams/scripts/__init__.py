"""What the scripts of the folder above share: they draw a diagram, or run an experiment."""
