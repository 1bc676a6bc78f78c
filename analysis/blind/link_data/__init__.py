"""The study of arms in space whose owner has wrong link data, or none."""
