"""From a python-control diagram to a graph of symbols."""
