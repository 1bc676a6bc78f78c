"""From diagnoses and opened labels to figures with their intervals."""
