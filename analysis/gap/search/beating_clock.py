"""Clock of a drive that beats against that of its commands: the beat that explains most."""

import numpy as np

from clie_blocks.analysis.gap.search.drive_errors import (
    DriveErrors,
    Use,
    drop_of,
    outstanding,
    power_of,
)

_CHORD = 4  # samples over which the slope of a command is taken
_BEATS = 0.2, 40.0  # Hz: slower ones do not come back in a log, faster ones the loop averages


def best_beat(joint: DriveErrors) -> Use:
    """Return the beat that explains most, of the lines that stand out of slope times error."""
    chords = [np.concatenate([np.repeat(u[:1], _CHORD), u[:-_CHORD]]) - u for u in joint.u]
    products = [joint.back[j] * chords[j] for j in joint.fitted]
    frequency, spectrum = power_of(products, joint.period, 2 * _BEATS[1])
    lines = outstanding(frequency, spectrum, *_BEATS)
    none = Use(0.0, {"spread": 0.0, "beat": 1.0, "phase": np.zeros(len(joint.u))})
    best = max((_beat(joint, chords, line) for line in lines), key=drop_of, default=none)
    if best.drop <= joint.least:
        return best
    for shift in frequency[1] * np.array([0.5, 0.25, 0.125]):
        beat = float(best.values["beat"])
        best = max([best, *(_beat(joint, chords, beat + side * shift) for side in (-1, 1))],
                   key=drop_of)
    return best


def _beat(joint: DriveErrors, chords: list[np.ndarray], beat: float) -> Use:
    """Saw-tooth of one beat, from its first harmonic: -1/pi sine of its phase."""
    drop, sizes, phases = 0.0, [], []
    for j, chord in enumerate(chords):
        turn = 2 * np.pi * beat * joint.period * np.arange(len(chord))
        columns = joint.columns(j, chord[:, None] * np.stack([np.sin(turn), np.cos(turn)], 1))
        sine, cosine = theta = np.linalg.lstsq(columns, joint.errors[j], rcond=None)[0]
        phases.append(np.arctan2(-cosine, -sine) / (2 * np.pi))
        if j in joint.fitted:
            drop += float(joint.errors[j] @ columns @ theta)
            sizes.append(np.hypot(sine, cosine))
    spread = np.pi * float(np.mean(sizes)) * _CHORD * joint.period
    return Use(drop, {"spread": min(spread, 0.05), "beat": beat, "phase": np.array(phases)})
