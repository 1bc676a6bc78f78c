"""The catalogue of effects as questions: its pages, its numerics, its peer engine."""
