"""Questions asked of a diagram or of a log."""
