"""Stage 5: from a prediction error to a white residual: noise, sensitivity, whitening."""
