"""The diagnosis with one of its stages taken away, to see what that stage buys.

A stage is a function of the pipeline; for the length of one diagnosis another one stands in its
place.  Nothing else changes: same logs, same library, same verdict.  They are exchanged from
outside, because an option would put a condition that only this comparison needs into every stage
that a user runs.
"""

import contextlib
import dataclasses
import json

import numpy as np

from clie_blocks.analysis.gap import diagnosis
from clie_blocks.analysis.gap.causes import vocabulary
from clie_blocks.analysis.gap.fitting.levenberg_marquardt import fit
from clie_blocks.analysis.gap.residual import noise
from clie_blocks.analysis.gap.search import racing
from clie_blocks.output import to_json

CORNER = 8.0  # Hz of the parallel filter of textbook identification
TAPS = 41


@contextlib.contextmanager
def replaced(module, name, function):
    """Put a function in the place of a module's own for a while.

    Parameters
    ----------
    module : module
        Where it stands.
    name : str
        Its name there.
    function : callable
        What stands in for it.

    """
    own = getattr(module, name)
    setattr(module, name, function)
    try:
        yield
    finally:
        setattr(module, name, own)


def unwhitened(problem, k, responses, own=noise.sensor_noise_model):
    """Noise of joint k with errors weighed by their size alone, whatever their frequency."""
    return _weighing(own(problem, k, responses), problem, np.ones(1), responses[k])


def as_torques(problem, k, responses, own=noise.sensor_noise_model):
    """Noise of joint k with errors turned back into torques and low-passed: no sensitivity.

    The error of the closed loop is S times the error of the equation of motion.  Its inverse,
    inertia ddq + damping dq + kp q + kd dq, gives the torque that is missing in that equation,
    which is what regression without the sensitivity filter looks at.
    """
    from scipy.signal import firwin

    h = noise.decimation(problem.period) * problem.period
    nominal, law = problem.nominal, problem.law
    torque = (nominal.inertia[k] * np.array([1.0, -2.0, 1.0]) / h**2
              + (nominal.damping[k] + law.kd[k]) * np.array([1.0, 0.0, -1.0]) / (2 * h)
              + law.kp[k] * np.array([0.0, 1.0, 0.0]))
    low = firwin(TAPS, min(CORNER, 0.4 / h), fs=1.0 / h)
    return _weighing(own(problem, k, responses), problem, np.convolve(torque, low), responses[k])


def _weighing(noise, problem, shape, response):
    """The same noise with another filter in the place of the whitening one, of variance one."""
    width = noise.decimation(problem.period)
    seen = np.convolve(noise.sigma * response, np.full(width, 1.0 / width))
    apart = np.zeros((len(shape) - 1) * width + 1)
    apart[::width] = shape
    return dataclasses.replace(
        noise, whitener=shape / np.sqrt(np.sum(np.convolve(seen, apart) ** 2)))


def without_priors(robot):
    """Robot whose datasheet states no tolerance."""
    return dataclasses.replace(robot, motor=dataclasses.replace(
        robot.motor, inertia_tolerance=None, viscous_friction_tolerance=None,
        torque_offset_tolerance=None))


def diagnosed(robot, records, **asked):
    """Answer of the diagnosis without what no score reads: the advice on the next experiment."""
    from clie_blocks.analysis.gap.report.answer import answer

    with (replaced(vocabulary, "next_experiment", lambda *_: None),
          np.errstate(over="ignore")):  # the map of the gap undoes whitening, if there is any
        return json.loads(to_json(answer(diagnosis.diagnose(robot, records, **asked))))


def weighing(noise):
    """Put another noise, and with it another whitening, in the place of the bench's own."""
    return replaced(whitening, "noise", noise)


def _with_noise(noise):
    def found(robot, records):
        with weighing(noise):
            return diagnosed(robot, records)
    return found


def _unpolished(robot, records):
    """Numbers stay as the regression left them; one simulation judges each hypothesis."""
    with (replaced(racing, "fit", lambda start, bench, steps: fit(start, bench, 0)),
          replaced(racing, "settled", lambda found, bench: found),
          replaced(vocabulary, "homed", lambda found, bench: found),
          replaced(vocabulary, "second_look", lambda *_: None)):
        return diagnosed(robot, records)


ABLATIONS = {
    "no sensitivity filter": _with_noise(as_torques),
    "no whitening": _with_noise(unwhitened),
    "no polish": _unpolished,
    "no priors": lambda robot, records: diagnosed(without_priors(robot), records),
}
