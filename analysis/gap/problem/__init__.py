"""Stage 1: the logs of one robot, and what is known of it, as a `Problem`."""
