"""Two runs of one robot, loaded and unloaded: how heavy the load is, and where it sits."""
