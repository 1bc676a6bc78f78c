"""Real machines whose truth is known independently: `clie real` scores the diagnosis on them."""
