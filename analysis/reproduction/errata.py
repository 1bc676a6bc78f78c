"""What the paper prints and what follows instead, with the proof of each difference.

Every entry is proved in ``tests/analysis/reproduction/test_errata.py``, by algebra or by number.
"""

from dataclasses import dataclass

from clie_blocks.analysis.report.document import Section, Table


@dataclass(frozen=True)
class Erratum:
    """One difference between the paper and what follows from its own definitions.

    Parameters
    ----------
    key : str
        Name under which the test proves it.
    where : str
        Place in the paper.
    printed, follows : str
        What is printed there and what follows.
    why : str
        The difference in one sentence.
    proof : str
        How it is shown.

    """

    key: str
    where: str
    printed: str
    follows: str
    why: str
    proof: str


ERRATA = (
    Erratum(
        "disturbance_fraction", "(10)", "[eta - delta_r; r - delta_m] / J",
        "((eta - delta_r) / r - delta_m) / J", "A fraction bar became a column of a matrix.",
        "algebra: (2), (4), (5) solved for the acceleration"),
    Erratum(
        "disturbance_is_gravity", "after (10)", "D is essentially delta_m / J, a constant",
        "-delta_m / J plus gravity / (r J)",
        "The sign is wrong, and without motor disturbance all of D is gravity, which varies.",
        "number: up to 0.044 rad/s^2 over the workspace, four times the printed D_1"),
    Erratum(
        "vector_of_norms", "(17)", "x = (dq, q_err), 2n entries", "x = (||dq||, ||q_err||)",
        "Script A is 2 x 2, so that x must hold the two norms.",
        "number: shapes for n = 2, and (17) holds for the norms at random states"),
    Erratum(
        "ball_not_invariant", "(18)", "trajectories end in the ball of radius mu_0",
        "in the ball of radius mu_0 sqrt(lambda_max / lambda_min), 4.87 times as large",
        "V falls outside the ball, but the sets that trap are level sets of V, not balls.",
        "number: a trajectory of (12) from inside the ball leaves it"),
    Erratum(
        "theta_in_v", "Theorems 2, 4", "E ends in the ball of radius mu_1 (mu_2)",
        "no bound on E follows from mu_1 alone",
        "V also holds the parametric error, whose size mu_1 does not bound.",
        "algebra: in the matched case mu_1 = 0, yet E = 0 is left at once"),
    Erratum(
        "eps_is_minus_dde", "(29)", "eps = Phi^T Theta - Phi_p^T Theta_hat",
        "eps = ddq + A dq - B u + D",
        "The printed expression is -dde for any parameters and does not vanish in a matched loop.",
        "algebra: (12) and (21) inserted"),
    Erratum(
        "k_1", "section 5.1", "k_1 = 11.19", "k_1 = 6.189",
        "The -I of K_bar was left out of the value.", "number: both computed from Table 2"),
    Erratum(
        "k_3", "Theorem 4", "k_3 = max{min{...}, alpha}", "k_3 = min{..., alpha}",
        "With the maximum the estimate of dV/dt is false, and with the minimum (46) fails in "
        "CASE 2.", "number: a state with E = 0 violates the estimate; 1e-4 < 1.99e-4"),
    Erratum(
        "mu_2_text", "Theorem 4", "mu_2 = sqrt(2 eps_f_bar + eps_bar) k_4 / k_3",
        "mu_2 = sqrt(2 eps_bar^2 + eps_f_bar^2) k_4 / k_3",
        "The squares are lost; the proof has them in (A.12).",
        "algebra: doubling the errors must double the radius"),
    Erratum(
        "conditions_31_46", "(31), (46)", "a condition on the gains",
        "k_1 > sqrt(2) k_2 eps_bar only says mu_1 < 1",
        "It compares quantities of different units and is not needed for ultimate boundedness.",
        "algebra: equivalence with mu < 1"),
    Erratum(
        "psi", "(A.11)", "Psi = (1/eps_bar, 1/eps_f_bar, 1/eps_bar)",
        "Psi = (1/eps_f_bar, 1/eps_f_bar, 1/eps_bar)",
        "Only then do the terms carry the bounds of the line above.", "algebra: term by term"),
    Erratum(
        "theorem_4_epsilons", "proof of Theorem 4", "d(epsilon)/dt and epsilon drive e",
        "the modelling error eps drives e",
        "Two errors with the same letter, of the model and of the identification, are confused.",
        "algebra: the chain rule along (29) has no derivative of either"),
    Erratum(
        "output_of_a6", "(A.6)", "y = Phi^T Theta_err", "y = Phi_p^T Theta_err",
        "The regressor of the error dynamics is that of the model.", "algebra: from (29)"),
    Erratum(
        "solution_44", "(44)", "Theta_err(0) exp(-alpha Gamma int Phi_f Phi_f^T)",
        "a time-ordered exponential, from the left",
        "The matrix does not commute with its own integral; exponential decay under (42) holds "
        "nevertheless.", "number: two windows, product of exponentials against that of the sum"),
    Erratum(
        "theorem_3_cascade", "proof of Theorem 3", "sets e_u = 0, then argues by cascade",
        "e_u depends on the parametric error",
        "The argument is incomplete, although the result holds.",
        "algebra: from e = de = 0 the input error leaves zero while Theta_err is not zero"),
    Erratum(
        "filtered_model", "section 5.1, after (48)", "dq_f = -A dq_f + B u_f - D",
        "y_f = -A dq_f + B u_f - (1 - exp(-300 t)) D",
        "The left side is the filtered acceleration, and a filtered constant starts at zero.",
        "algebra: the response of the filter to a constant"),
    Erratum(
        "filter_on_one_side", "(36), section 5.1", "G1 and G2 on the velocity, G2 on the input",
        "eps_f is not zero even without noise",
        "G1 delays the velocity against the input, and the filters must start at rest.",
        "number: the identification error of the true parameters"),
    Erratum(
        "weighted_pe", "(49)", "satisfies (49) and consequently (28)", "(49) does not imply (28)",
        "One direction says nothing about the others.",
        "number: PE = 0 gives 3.286 in (49), and rank 2 of 6 in (28)"),
    Erratum(
        "sign_in_50", "(50)", "-D_hat", "+D_hat",
        "The printed sign doubles the load instead of cancelling it.", "algebra: (50) in (9)"),
    Erratum(
        "percent_column", "Table 2, heads", "|Theta_hat| (%)", "100 times the absolute error",
        "It is no percentage: the relative errors of D are 13 to 92 %.",
        "number: the columns computed again"),
    Erratum(
        "case_1_column", "Table 2, CASE 1", "B_2 0.19, D_1 0.05", "B_2 0.15, D_1 0.19",
        "The entries do not belong to the estimates in the same rows.", "number: computed again"),
    Erratum(
        "real_b_2", "Table 2", "B_2 = 0.4998 with A_2 = 1.9952", "B_2 = 0.4988",
        "A/B is the friction R r = 4 of both joints; two digits are swapped, and mu_0 was "
        "computed with the wrong one.", "number: A_2 / B_2 = 3.992"),
    Erratum(
        "eps_norms", "Table 3", "||e|| 2.39e-5 and 8.86e-5", "||eps|| 2.36e-5 and 8.85e-5",
        "The text has 2.36e-5, and the norm of the printed means is smaller in CASE 3.",
        "number: norm of the two columns"),
    Erratum(
        "tracking_exponent", "Table 3", "mean squared errors times 1e-7", "times 1e-4",
        "The mantissas follow exactly, a thousand times larger.",
        "number: (50) with +D_hat run for 100 s"),
    Erratum(
        "telescoping_mean", "section 5.1", "eps_bar is the mean of eps, and a bound on ||eps||",
        "the mean is (de(0) - de(T)) / T",
        "A signed mean telescopes to almost nothing for any estimate and bounds nothing.",
        "number: the mean along a run is a hundredth of the largest value"),
    Erratum(
        "two_inertias", "(4), section 5", "J_k for the motor and for the link", "two symbols",
        "They enter with r and with 1/r; the values of the links are not stated.",
        "algebra: derivatives of the inertia in (6)"),
    Erratum(
        "noise_variance", "section 5", "variance 1e-3", "variance 1e-6",
        "With 1e-3 the velocity from G1 is mostly noise; a standard deviation of 1e-3 agrees with "
        "the results.", "number: 0.6 rad/s of noise on 0.05 rad/s of signal"),
    Erratum(
        "gain_and_duration", "Table 1, section 5.1", "Gamma = 20 and 100 s",
        "an effective gain three to four times as large",
        "The slow mode of Gamma = 20 has a time constant of 45 s, so that a tenth of the error "
        "remains after 100 s.",
        "number: Floquet exponents of the linearised loop"),
    Erratum(
        "composite_convergence", "section 5.1", "CASE 2 improves convergence",
        "no measurable effect", "The time constant of the gradient term is 2e4 to 2e5 s.",
        "number: Floquet exponents with and without alpha"),
)


def errata_section() -> Section:
    """The errata as a section of a report."""
    rows = tuple((one.where, one.printed, one.follows, one.why, one.proof) for one in ERRATA)
    table = Table(("where", "printed", "follows", "why", "proof"), rows)
    return Section("Errata", ("Each is proved in tests/analysis/reproduction/test_errata.py.",),
                   tables=(table,))
