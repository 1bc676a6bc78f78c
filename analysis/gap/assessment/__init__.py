"""Stage 9: where the gap lies, how far it shrinks, which experiment would tell more."""
