"""Effects of drive, timing, controller and sensor that the standard study does not name.

As in `effects`: drawn once, then scaled; at size 1 the motion changes by some tenths of a
milliradian to a few milliradians.
"""

import numpy as np

from clie_blocks.analysis.blind.population.effect_site import (
    Change,
    Draw,
    Site,
    proportional,
    with_unit,
)
from clie_blocks.analysis.blind.population.mechanical import between


def _torque_speed_limit(rng: np.random.Generator, site: Site) -> Change:
    """Envelope that the fastest loaded motion touches at size 0, and more of them beyond."""
    peak = 1.3 * site.largest_command
    touched = site.steepest_envelope(peak)
    return lambda size: (site.at("peak", peak)
                         | site.at("droop", touched * (1 + 0.15 * size)))


def _commutation_ripple(rng: np.random.Generator, site: Site) -> Change:
    pairs = float(rng.integers(2, 8) + np.floor(8.0 / site.robot.ratio[site.joint]))
    return proportional(site, "phase_gain", 0.02, pole_pairs=pairs, phase=rng.uniform(0, 6.28))


def _back_emf(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "back_emf", 0.25 * site.robot.drag)


def _supply_sag(rng: np.random.Generator, site: Site) -> Change:
    """One source for all motors."""
    return lambda size: {"source_sag": np.full(site.robot.n, 0.02 * size)}


def _torque_quantization(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "quantum", 2 * site.torque)


def _torque_slew(rng: np.random.Generator, site: Site) -> Change:
    return lambda size: site.at("torque_slew", 30 * site.largest_command / size)


def _setpoint_slew(rng: np.random.Generator, site: Site) -> Change:
    return lambda size: site.at("slew", 5.0 / size)


def _tick_jitter(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "jitter", 1e-3, beat=between(rng, 0.5, 8.0),
                        phase=rng.uniform(0, 6.28))


def _packet_hold(rng: np.random.Generator, site: Site) -> Change:
    interval, phase = rng.uniform(0.3, 1.5), rng.uniform(0, 6.28)
    return lambda size: (site.at("hold", min(5e-3 * size, 0.9 * interval))
                         | site.at("hold_interval", interval) | site.at("phase", phase))


def _gain_error(rng: np.random.Generator, site: Site) -> Change:
    """Kp, Kd or both at once, too high or too low."""
    shares = ((0.01, 0.0), (0.0, 0.03), (0.01, 0.01))[rng.integers(3)]
    signs = rng.choice([-1, 1], 2)
    return lambda size: (site.at("kp_factor", np.exp(signs[0] * shares[0] * size))
                         | site.at("kd_factor", np.exp(signs[1] * shares[1] * size)))


def _hidden_compensation(rng: np.random.Generator, site: Site) -> Change:
    if rng.random() < 0.5:
        return proportional(site, "compensated_weight", 3 * site.torque)
    return proportional(site, "compensated_friction", site.torque,
                        compensated_speed=between(rng, 0.02, 0.1))


def _encoder_offset(rng: np.random.Generator, site: Site) -> Change:
    return proportional(site, "zero", 2e-3 * float(rng.choice([-1, 1])))


def _sensor_gain(rng: np.random.Generator, site: Site) -> Change:
    sign = rng.choice([-1, 1])
    return lambda size: site.at("logged_gain", 1 + 0.02 * sign * size)


ELECTRONIC: dict[str, Draw] = {
    "torque_speed_limit": _torque_speed_limit, "commutation_ripple": _commutation_ripple,
    "back_emf": _back_emf, "supply_sag": _supply_sag,
    "torque_quantization": _torque_quantization, "torque_slew": _torque_slew,
    "setpoint_slew": _setpoint_slew,
    "setpoint_delay": with_unit("reference_delay", 1e-3),
    "in_loop_delay": with_unit("stale", 5e-4), "tick_jitter": _tick_jitter,
    "packet_hold": _packet_hold, "gain_error": _gain_error,
    "control_law_form": with_unit("reference_speed", 0.02),
    "hidden_compensation": _hidden_compensation, "encoder_offset": _encoder_offset,
    "velocity_estimate_lag": with_unit("estimate_lag", 5e-4),
    "channel_skew": with_unit("skew", 5e-4), "sensor_gain": _sensor_gain}
