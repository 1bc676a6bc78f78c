"""Stage 7: which causes are worth a fit, from screening to racing."""
