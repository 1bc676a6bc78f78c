"""Families of sound robots that a diagnosis may misjudge: it must accuse no joint.

The robot is healthy and its logs are true, but its file cannot or does not describe it.  A
diagnosis may say so, or say that nothing it knows fits.
"""

import numpy as np

from clie_blocks.analysis.blind.answers import NO_EFFECTS, Answer
from clie_blocks.analysis.blind.loop import run
from clie_blocks.analysis.blind.motion import draw_motions
from clie_blocks.analysis.blind.rates import rate
from clie_blocks.analysis.blind.trial import ATTEMPTS, RejectedError, Trial, lost

NAMED, UNNAMED, MISSED, ACCUSED, FAILED = "named", "unknown", "missed", "accused", "failed"
CONTROLLER = "velocity_filter_mismatch"  # the vocabulary's own word for a wrong description


def make_sound(seed, index, stream, name, draw):
    """Make a trial of a family.

    Parameters
    ----------
    seed, index : int
        Of the study, and number of the trial.
    stream : int
        Keeps the draws apart from those of other families of the same seed.
    name : str
        What the file has wrong.
    draw : callable
        ``draw(rng)`` gives the robot, the robot as stated, its true numbers, and words for the
        difference.

    """
    for attempt in range(ATTEMPTS):
        try:
            return _attempt(np.random.default_rng([seed, index, attempt, stream]), index, name,
                            draw)
        except RejectedError:
            continue
    raise RuntimeError(f"{name}, trial {index} of seed {seed}: no stable robot")


def _attempt(rng, index, name, draw):
    robot, stated, truth, wrong = draw(rng)
    motions = draw_motions(rng, robot)
    noises = [robot.sigma * rng.standard_normal(motion.q_d.shape) for motion in motions]
    runs = run(robot, [truth] * len(motions), motions, noises, seed=index)
    if lost(motions, runs):
        raise RejectedError("unstable")
    return Trial(stated, motions, runs, {
        "kind": "sound", "labels": [name], "wrong": wrong,
        "robot": f"{robot.kind} of {robot.n}"})


def scored(diagnoses, labels):
    """Say what is said of sound robots.

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
                         for name in dict.fromkeys(row["wrong"] for row in rows)}}


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
