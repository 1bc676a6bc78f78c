"""Arms as blocks: against the paper's arm, scipy and the compiled program."""

import numpy as np
import pytest
from random_trees import random_tree
from scipy.integrate import solve_ivp

from clie_blocks import compile_diagram
from clie_blocks.labels import DiagramError
from clie_blocks.manipulator import two_link_arm
from clie_blocks.rigid_body.arm import articulated_arm, planar_tree
from clie_blocks.rigid_body.dynamics import kinetic_energy, potential_energy

LINKS = dict(mass=[1.5, 0.8], length=[0.5, 0.4], com=[0.2, 0.25], j_link=[0.02, 0.01])
DRIVES = [50.0, 60.0], [1e-4, 2e-4], [1e-3, 1e-3]


def test_a_planar_tree_moves_as_the_arm_of_the_paper():
    paper = two_link_arm(LINKS["mass"], LINKS["length"], *DRIVES, com=LINKS["com"],
                         j_link=LINKS["j_link"], h=[0.1, 0.2])
    arm = articulated_arm(planar_tree(**LINKS), *DRIVES, h=[0.1, 0.2])
    assert arm.input_labels == paper.input_labels and arm.output_labels == paper.output_labels
    for x, u in zip(np.random.default_rng(0).normal(size=(5, 4)),
                    np.random.default_rng(1).normal(size=(5, 2))):
        np.testing.assert_allclose(arm.dynamics(0, x, u), paper.dynamics(0, x, u), rtol=1e-10)


@pytest.mark.slow
def test_a_spatial_arm_compiled_and_by_scipy_moves_alike():
    links = random_tree(1, 3)
    arm = articulated_arm(links, np.full(3, 50.0), np.full(3, 1e-3), np.full(3, 1e-3), h=0.2)
    u = np.array([0.05, -0.1, 0.02])
    expected = solve_ivp(lambda t, x: arm.dynamics(t, x, u), (0.0, 0.1), np.zeros(6), rtol=1e-9,
                         atol=1e-11).y[:, -1]
    run = compile_diagram(arm).run(0.1, step=1e-3, inputs={"u": u})
    np.testing.assert_allclose(run.outputs[:, -1], expected, atol=1e-8)


@pytest.mark.slow
def test_an_arm_without_friction_keeps_its_energy():
    links = random_tree(2, 3)
    ratio, rotor = np.full(3, 30.0), np.full(3, 1e-4)
    arm = articulated_arm(links, ratio, rotor, np.zeros(3))
    start = np.random.default_rng(0).normal(size=6)

    def energy(x):
        return (kinetic_energy(links, x[:3], x[3:]) + potential_energy(links, x[:3])
                + 0.5 * ratio**2 * rotor @ x[3:] ** 2)

    path = compile_diagram(arm).run(1.0, step=1e-4, inputs={"u": np.zeros(3)}, every=500,
                                    initial_state=start).outputs.T
    assert np.ptp(path, axis=0).max() > 0.5
    assert [energy(x) for x in path] == pytest.approx([energy(start)] * len(path), rel=1e-7)


def test_an_arm_says_what_is_wrong_with_its_drives():
    links = planar_tree(**LINKS)
    with pytest.raises(DiagramError, match="gear_ratio"):
        articulated_arm(links, [50.0, 0.0], *DRIVES[1:])
    with pytest.raises(DiagramError, match="j_motor"):
        articulated_arm(links, DRIVES[0], [1e-4, -1e-4], DRIVES[2])
    with pytest.raises(DiagramError, match="gear_ratio needs 2"):
        articulated_arm(links, [50.0] * 3, *DRIVES[1:])
