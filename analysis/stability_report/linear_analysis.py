"""Filters, poles and margins of a study, from its linearised diagrams."""

from dataclasses import dataclass

import numpy as np

from clie_blocks.analysis.stability_report.study import Study
from clie_blocks.analysis.theory.frequency import (
    PAPER_TONES,
    FilterResponse,
    Margins,
    Poles,
    closed_loop_poles,
    filter_response,
    margins,
    noise_gain,
)
from clie_blocks.filters import lowpass, velocity_filter

NOISE_PERIOD = 1e-3  # s


@dataclass(frozen=True)
class LinearAnalysis:
    """Filters, poles and margins of a study.

    Parameters
    ----------
    filters : dict
        ``'G1'``, ``'G2'`` to `FilterResponse` at the tones of the excitation.
    noise : dict
        The same keys to the noise gain.
    poles, margins : dict
        ``'exact'``, ``'G1'`` to `Poles`, and to one `Margins` per joint.

    """

    filters: dict[str, FilterResponse]
    noise: dict[str, float]
    poles: dict[str, Poles]
    margins: dict[str, list[Margins]]


def analyse_linear(study: Study) -> LinearAnalysis:
    """Linear analysis with exact velocity and with velocity through G1."""
    blocks = {"G1": velocity_filter(1), "G2": lowpass(1)}
    tones = 2 * np.pi * np.array(PAPER_TONES)
    arguments = (study.plant, study.joints.kp, study.joints.kd)
    kinds = {"exact": False, "G1": True}
    return LinearAnalysis(
        {name: filter_response(block, tones, name == "G1") for name, block in blocks.items()},
        {name: noise_gain(block, NOISE_PERIOD) for name, block in blocks.items()},
        {kind: closed_loop_poles(*arguments, filtered=filtered, q=study.q_d)
         for kind, filtered in kinds.items()},
        {kind: [margins(*arguments, k, filtered=filtered, q=study.q_d)
                for k in range(study.joints.n)] for kind, filtered in kinds.items()})
