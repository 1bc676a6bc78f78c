"""Stage 6: the nominal model and the hypotheses, fitted in closed loop."""
