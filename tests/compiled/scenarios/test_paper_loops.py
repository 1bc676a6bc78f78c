"""The paper's diagrams: compiled, against python-control at random points and over short runs."""

import numpy as np
import pytest

from clie_blocks import paper
from clie_blocks.compiled import METHODS, compile_diagram, held_normal
from clie_blocks.diagrams.clie_loop import CASES
from clie_blocks.diagrams.feedback_linearization import feedback_linearization
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.diagrams.scripts.paper_experiment import Experiment
from clie_blocks.excitation import paper_excitation
from clie_blocks.joints import decoupled_joints


def linear_plant():
    return decoupled_joints(*paper.THETA.reshape(3, 2))


def experiment(**settings):
    return Experiment(CASES, **settings).diagram()


DIAGRAMS = {
    "Fig. 1": lambda: joint_loop(linear_plant(), paper.KP, paper.KD),
    "Fig. 2, law (27), arm": lambda: experiment(case=1),
    "Fig. 2, input-error": lambda: experiment(case=1, velocity="input-error"),
    "Fig. 2, law (40), linear": lambda: experiment(case=2, plant="linear", velocity="measured"),
    "Fig. 2, law (40), arm": lambda: experiment(case=3, velocity="filtered-both"),
    "Fig. 5": lambda: feedback_linearization(linear_plant(), paper.THETA, paper.KP, paper.KD),
}


@pytest.mark.parametrize("build", DIAGRAMS.values(), ids=DIAGRAMS)
def test_equals_python_control_on_random_states(build):
    diagram = build()
    program, generator = compile_diagram(diagram), np.random.default_rng(5)
    for _ in range(10):
        t, x = generator.uniform(0, 10), generator.standard_normal(diagram.nstates)
        u = generator.standard_normal(diagram.ninputs)
        for mine, theirs in ((program.dynamics, diagram.dynamics),
                             (program.output, diagram.output)):
            expected = theirs(t, x, u)
            np.testing.assert_allclose(mine(t, x, u), expected, rtol=1e-12,
                                       atol=1e-12 * np.max(np.abs(expected)))


@pytest.mark.parametrize("engine", ["llvm", "python"])
def test_short_run_equals_a_loop_over_python_control(plain_loop, engine):
    diagram = experiment(case=2, velocity="measured")
    steps = 30
    noise = np.random.default_rng(0).normal(0, 1e-2, (steps, 2))
    rows = np.hstack([np.tile(paper.SET_POINT, (steps, 1)), np.full((steps, 2), 0.3), noise])
    run = compile_diagram(diagram, engine).run(
        steps * paper.STEP, step=paper.STEP,
        inputs={"q_d": paper.SET_POINT, "pe": 0.3, "noise": noise})
    expected = plain_loop(diagram, METHODS["ode5"], rows, paper.STEP)
    scale = np.max(np.abs(expected), axis=0)
    assert np.max(np.abs(run.states.T - expected) / np.where(scale > 0, scale, 1.0)) < 1e-12


def test_estimates_move_to_the_truth_without_noise():
    diagram = experiment(case=1, plant="linear")
    run = compile_diagram(diagram).run(
        100.0, inputs={"q_d": paper.SET_POINT, "pe": paper_excitation}, log="theta_hat",
        params={"update.gamma": 80.0}, every=1000)
    distance = np.linalg.norm(run.outputs - paper.THETA[:, None], axis=0)
    assert distance[-1] < 0.02 * distance[0]


def test_noise_changes_the_run_and_its_seed_repeats_it():
    program = compile_diagram(experiment(case=2, plant="linear"))

    def final(seed):
        return program.run(0.5, inputs={"q_d": paper.SET_POINT, "pe": paper_excitation,
                                        "noise": held_normal(1e-4, seed)}).states[:, -1]

    np.testing.assert_array_equal(final(1), final(1))
    assert np.max(np.abs(final(1) - final(2))) > 1e-6
