"""The designed multisine: it keeps its limits in a run and excites as much as it claims."""

import numpy as np
import pytest

from clie_blocks import paper
from clie_blocks.analysis.theory.bounds import ControlledJoints
from clie_blocks.analysis.theory.excitation_design import Limits, design_multisine
from clie_blocks.compiled import compile_diagram
from clie_blocks.diagrams.joint_loop import joint_loop
from clie_blocks.errors import ClieError
from clie_blocks.excitation import paper_excitation
from clie_blocks.identification import regressor_matrix
from clie_blocks.joints import decoupled_joints
from clie_blocks.signals import signal

JOINTS = ControlledJoints.from_theta(paper.THETA, paper.KP, paper.KD)
PROGRAM = compile_diagram(joint_loop(decoupled_joints(JOINTS.a, JOINTS.b, JOINTS.d), paper.KP,
                                     paper.KD))


def settled(pe):
    """Peaks and smallest eigenvalue per second of joint 1 over one settled period of 10 s."""
    run = PROGRAM.run(30.0, step=2e-3, inputs={"q_d": 0.0, "pe": pe})
    late = run.time >= 20.0
    q, dq, u = (signal(run, name)[0, late] for name in ("q", "dq", "u"))
    rest = JOINTS.d[0] / JOINTS.b[0]
    peaks = [np.max(np.abs(x)) for x in (q + rest / paper.KP[0], dq, u - rest)]
    phi = np.array([regressor_matrix(dq[k:k + 1], u[k:k + 1])[:, 0] for k in range(len(u) - 1)])
    return peaks, np.linalg.eigvalsh(phi.T @ phi / len(phi))[0]


@pytest.mark.parametrize("limits", [
    Limits(0.2, 1.0, 3.0), pytest.param(Limits(0.5, 0.1, 5.0), marks=pytest.mark.slow)])
def test_design_keeps_its_limits_and_its_promise(limits):
    design = design_multisine(JOINTS, 0, limits)
    peaks, smallest = settled(design)
    bounds = (limits.position, limits.velocity, limits.torque)
    assert np.all(np.array(peaks) <= np.array(bounds) * 1.005)
    assert np.max(np.array(peaks) / bounds) == pytest.approx(1, abs=0.005)
    assert smallest == pytest.approx(design.smallest, rel=5e-3)


@pytest.mark.slow
def test_design_beats_the_papers_excitation_within_its_own_limits():
    peaks, smallest = settled(paper_excitation)
    design = design_multisine(JOINTS, 0, Limits(*map(float, peaks)))
    assert design.smallest > 1.5 * smallest


@pytest.mark.slow
def test_more_room_never_excites_less():
    narrow, wide = (design_multisine(JOINTS, 1, Limits(p, 1.0, 3.0)).smallest for p in (0.05, 0.2))
    assert wide > narrow


def test_a_limit_that_is_not_positive_is_refused():
    with pytest.raises(ClieError, match="velocity limit must be positive"):
        Limits(0.1, 0.0, 1.0)
