"""Questions asked of a diagram: bounds, Bode plots, excitation, convergence."""
