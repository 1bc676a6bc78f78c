"""Everything that a stability report shows; the document and the JSON both read it."""

from collections.abc import Callable
from dataclasses import dataclass

from clie_blocks.analysis.stability_report.convergence_sweep import (
    Convergence,
    analyse_convergence,
)
from clie_blocks.analysis.stability_report.excitation_windows import (
    ExcitationReport,
    analyse_excitation,
)
from clie_blocks.analysis.stability_report.linear_analysis import LinearAnalysis, analyse_linear
from clie_blocks.analysis.stability_report.loop_bounds import Bounds, analyse_bounds
from clie_blocks.analysis.stability_report.study import Study

PARTS = 4


@dataclass(frozen=True)
class Quantities:
    """The four parts of a report."""

    bounds: Bounds
    linear: LinearAnalysis
    convergence: Convergence
    excitation: ExcitationReport | None


def analyse(study: Study, advance: Callable[[float], None] = lambda parts: None) -> Quantities:
    """Compute all parts; `advance` is called after each of the `PARTS`."""
    bounds = analyse_bounds(study)
    advance(1)
    linear = analyse_linear(study)
    advance(1)
    convergence = analyse_convergence(study)
    advance(1)
    excitation = analyse_excitation(study)
    advance(1)
    return Quantities(bounds, linear, convergence, excitation)
