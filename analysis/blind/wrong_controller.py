"""Healthy robots whose file describes another controller than the one that ran.

A family of its own: the robot is sound, its logs are true, and one statement about the controller
is false.  A diagnosis may say so, or say that nothing it knows fits; it must accuse no joint.
"""

import dataclasses

import numpy as np

from clie_blocks.analysis.blind.answers import NO_EFFECTS, Answer
from clie_blocks.analysis.blind.loop import run
from clie_blocks.analysis.blind.motion import draw_motions
from clie_blocks.analysis.blind.rates import rate
from clie_blocks.analysis.blind.robot import DISCRETISATIONS, draw_robot, draw_truth
from clie_blocks.analysis.blind.trial import ATTEMPTS, RejectedError, Trial, lost

STREAM = 1  # keeps the draws apart from those of the main study of the same seed
NAMED, UNNAMED, MISSED, ACCUSED, FAILED = "named", "unknown", "missed", "accused", "failed"
CONTROLLER = "velocity_filter_mismatch"  # the vocabulary's own word for a wrong description


def make_trial(seed, index):
    """Make one trial; all wrong descriptions come in turn.

    Parameters
    ----------
    seed : int
        Of the study.
    index : int
        Number of the trial.

    Returns
    -------
    Trial
        The same for the same numbers.

    """
    name = list(WRONG)[index % len(WRONG)]
    for attempt in range(ATTEMPTS):
        try:
            return _attempt(np.random.default_rng([seed, index, attempt, STREAM]), name, index)
        except RejectedError:
            continue
    raise RuntimeError(f"wrong controller {index} of seed {seed}: no stable robot")


def _attempt(rng, name, index):
    robot = draw_robot(rng)
    truth, motions = draw_truth(rng, robot), draw_motions(rng, robot)
    noises = [robot.sigma * rng.standard_normal(motion.q_d.shape) for motion in motions]
    stated, truth, wrong = WRONG[name](rng, robot, truth)
    runs = run(robot, [truth] * len(motions), motions, noises, seed=index)
    if lost(motions, runs):
        raise RejectedError("unstable")
    return Trial(stated, motions, runs, {
        "kind": "controller", "labels": [name], "wrong": wrong,
        "robot": f"{robot.kind} of {robot.n}"})


def _discretisation(rng, robot, truth):
    others = sorted(set(DISCRETISATIONS) - {robot.discretisation})
    stated = str(rng.choice(others))
    return dataclasses.replace(robot, discretisation=stated), truth, f"stated {stated}"


def _corner(which):
    def draw(rng, robot, truth):
        factor, corners = _factor(rng, 1.2, 1.8), list(robot.corners)
        corners[which] = round(corners[which] * factor, 1)
        return dataclasses.replace(robot, corners=tuple(corners)), truth, f"stated x {factor:.3g}"
    return draw


def _gain(key, least, most):
    """Gain that is stated wrong at one joint."""
    def draw(rng, robot, truth):
        factor, gains = _factor(rng, least, most), getattr(robot, key).copy()
        gains[rng.integers(robot.n)] *= factor
        return dataclasses.replace(robot, **{key: gains}), truth, f"stated x {factor:.3g}"
    return draw


def _late(rng, robot, truth):
    """Command that is worked out in one period and sent in the next, of which no word is said."""
    return robot, {**truth, "behind": np.ones(robot.n)}, "sent one period later"


def _factor(rng, least, most):
    """Factor above or below one."""
    return float(np.exp(rng.choice([-1, 1]) * rng.uniform(np.log(least), np.log(most))))


WRONG = {
    "discretisation of the velocity filter": _discretisation,
    "low-pass corner": _corner(1), "high-pass corner": _corner(0),
    "Kd": _gain("kd", 1.05, 1.5), "Kp": _gain("kp", 1.03, 1.3),
    "one period of delay": _late}


def scored(diagnoses, labels):
    """Say what is said of robots whose controller is described wrong.

    Parameters
    ----------
    diagnoses : dict
        JSON objects of the diagnosis, by trial.
    labels : dict
        Opened labels, by trial.

    Returns
    -------
    dict
        Shares named as a matter of the controller, called unknown, missed, accused of a robot
        effect, and failed; the same by what is wrong.

    """
    rows = [{"trial": name, "wrong": label["labels"][0], "how": label["wrong"],
             "robot": label["robot"], "said": Answer(diagnoses[name]).decision,
             "outcome": outcome(diagnoses[name])} for name, label in sorted(labels.items())]
    return {"trials": len(rows), **shares(rows), "rows": rows,
            "by_wrong": {name: shares([row for row in rows if row["wrong"] == name])
                         for name in WRONG}}


def shares(rows):
    """Share of every outcome."""
    return {key: rate(row["outcome"] == key for row in rows)
            for key in (NAMED, UNNAMED, MISSED, ACCUSED, FAILED)}


def outcome(diagnosis):
    """One word for a diagnosis of a sound robot whose controller is described wrong."""
    answer = Answer(diagnosis)
    if answer.failed:
        return FAILED
    if answer.decision not in (*NO_EFFECTS, CONTROLLER):
        return ACCUSED
    if answer.decision == CONTROLLER or diagnosis.get("decisions"):
        return NAMED
    return UNNAMED if answer.decision == "unknown" else MISSED
