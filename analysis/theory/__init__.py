"""Questions about a loop: bounds, Bode plots, excitation, convergence, sampled sensitivities."""
