"""What the stages of a diagnosis found, one field per stage."""

import dataclasses
from typing import Any

from clie_blocks.analysis.gap.assessment.formula import Formula
from clie_blocks.analysis.gap.assessment.gap_reduction import GapReduction
from clie_blocks.analysis.gap.assessment.next_experiment import NextExperiment
from clie_blocks.analysis.gap.assessment.torque_map import TorqueMap
from clie_blocks.analysis.gap.controller.replay import ControllerCheck
from clie_blocks.analysis.gap.fitting.fit import Fit
from clie_blocks.analysis.gap.method import Method
from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.residual.whitening import ResidualModel
from clie_blocks.analysis.gap.verdict.evidence import Table
from clie_blocks.analysis.gap.verdict.posterior import RankedCause
from clie_blocks.analysis.gap.verdict.signal_finding import SignalFinding


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Result:
    """What the stages of a diagnosis found.

    Parameters
    ----------
    problem : Problem
        What was to be explained.
    method : Method
        Thresholds.
    controller : ControllerCheck
        Whether the stated controller ran.
    residuals : ResidualModel
        Noise and whitening.
    nominal : Fit
        The refitted nominal model.
    evidence : Table
        What the verdict rests on.
    ranking : list of RankedCause
        Hypotheses, most probable first.
    model : Fit
        The corrected model: the leading hypothesis, or the best one where none leads.
    verdict : str
        ``effect``, ``parametric``, ``none``, ``unexplained`` or ``not_identifiable``.
    reduction : GapReduction
        How far the gap shrinks on unseen data.
    torque_map : TorqueMap or None
        Torque that the model leaves and every lap repeats, where that pays on unseen data.
    where : dict
        Where the gap lies, see `localise`.
    alike : tuple of tuple of str
        Names that the logs do not tell apart, see `names_alike`.
    numbers_alike : tuple of Fit
        Models with other numbers of the robot file in the place of the leading one's, which the
        logs do not tell from it, see `numbers_alike`.
    next_experiment : NextExperiment or None
        The run that would tell the remaining causes apart.
    advice : tuple of str
        What to mend before that, see `advice`.
    findings : tuple of SignalFinding
        Causes that logged signals show without a model.
    reason : str
        Why nothing explains the gap, where that is known: ``diverged``, ``not_borne_out`` or
        ``commands_unclear``.
    is_complete : bool
        Whether the search was done before the time was over.
    excluded : frozenset of str
        Effects that were excluded, or not searched for: none of them is named.
    seconds : float
        Time it took.
    formula : Formula or None
        A model without a name for what the causes leave, where that pays on unseen data.

    """

    problem: Problem
    method: Method
    controller: ControllerCheck
    residuals: ResidualModel
    nominal: Fit
    evidence: Table
    ranking: list[RankedCause]
    model: Fit
    verdict: str
    reduction: GapReduction
    torque_map: TorqueMap | None
    where: dict[str, Any]
    next_experiment: NextExperiment | None
    alike: tuple[tuple[str, ...], ...] = ()
    numbers_alike: tuple[Fit, ...] = ()
    advice: tuple[str, ...] = ()
    findings: tuple[SignalFinding, ...] = ()
    reason: str = ""
    is_complete: bool = True
    excluded: frozenset[str] = frozenset()
    seconds: float = 0.0
    formula: Formula | None = None

    @property
    def with_formula(self) -> "Result":
        """The same with a formula as the corrected model, where no cause is in that.

        A cause that simulators hold themselves must not become code for the sake of small terms.
        """
        if self.formula is None or self.formula.beside:
            return self
        return dataclasses.replace(self, model=self.formula.fit, formula=None)
