"""The scoreboard of a study as a page, for a terminal, and as plots."""
