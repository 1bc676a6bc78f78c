"""Other methods, and the diagnosis with a stage removed, on the same trials."""
