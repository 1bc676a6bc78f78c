"""The diagnosis of one robot: all stages in their order."""

import dataclasses
import time

from clie_blocks.analysis.gap.any_loop import loop_problem, trusted
from clie_blocks.analysis.gap.baseline import baseline
from clie_blocks.analysis.gap.beside_simulator import beside_simulator, lacking
from clie_blocks.analysis.gap.causes import CAUSES
from clie_blocks.analysis.gap.controller_check import controller_check
from clie_blocks.analysis.gap.controller_gains import beyond_the_library
from clie_blocks.analysis.gap.evidence import STRAYED, evidence, excess
from clie_blocks.analysis.gap.explore import SMALL, explore
from clie_blocks.analysis.gap.fit import diverged
from clie_blocks.analysis.gap.homing import homed
from clie_blocks.analysis.gap.leftover import structured
from clie_blocks.analysis.gap.next_experiment import next_experiment
from clie_blocks.analysis.gap.observer import held, let_go
from clie_blocks.analysis.gap.paths import established_by, path_causes, with_paths
from clie_blocks.analysis.gap.pooling import pooled
from clie_blocks.analysis.gap.problem import problem as state_problem
from clie_blocks.analysis.gap.pruning import pruned
from clie_blocks.analysis.gap.race import QUIET
from clie_blocks.analysis.gap.second_look import in_the_loop, second_look
from clie_blocks.analysis.gap.shrinkage import shrinkage
from clie_blocks.analysis.gap.torque_table import torque_table
from clie_blocks.analysis.gap.verdict import learned, verdict, weighed
from clie_blocks.analysis.gap.where import where
from clie_blocks.errors import ClieError, nearest

FROM_CHECK = ("velocity_filter_mismatch", "encoder_quantization")
VOCABULARY = frozenset(cause.name for cause in CAUSES) | frozenset(FROM_CHECK)


@dataclasses.dataclass(frozen=True, eq=False)
class Diagnosis:
    """All that was found, stage by stage.

    Parameters
    ----------
    problem : Problem
        What was asked.
    check : ControllerCheck
        Whether the stated controller ran.
    bench : Bench
        Noise and whitening.
    base : Fit
        The refitted nominal model.
    ranking : list of Standing
        Hypotheses, most probable first.
    model : Fit
        The corrected model: the leading hypothesis, or the best one where none leads.
    verdict : str
        ``effect``, ``parametric``, ``none``, ``unexplained`` or ``not_identifiable``.
    shrinkage : Shrinkage
        How far the gap shrinks on unseen data.
    repeatable : TorqueTable or None
        What the model leaves and every lap repeats, where that pays on unseen data.
    where : dict
        Where the gap lies, see `where`.
    next_experiment : dict or None
        The run that would tell the remaining causes apart.
    calibration : Calibration
        Numbers of the verdict.
    evidence : Table
        What the verdict rests on.
    seconds : float
        Time it took.
    paths : tuple of PathCause
        Causes that the way of the command shows by itself, see `paths`.
    left_out : frozenset of str
        Effects that were excluded, or not asked for: none of them is named.

    """

    problem: object
    check: object
    bench: object
    base: object
    ranking: list
    model: object
    verdict: str
    shrinkage: object
    repeatable: object
    where: dict
    next_experiment: dict | None
    calibration: object
    evidence: object
    seconds: float
    paths: tuple = ()
    left_out: frozenset = frozenset()


def diagnose(robot, records=None, held_out=None, calibration=None, effects=(), exclude=(),
             simulated=(), loop=None):
    """Say which effect makes a robot differ from its model, where, and how far the gap shrinks.

    Parameters
    ----------
    robot : Robot
        What is known of it; with `loop`, the record or list of records.
    records : list of Record
        Its logs.
    held_out : list of int, optional
        Logs that only judge; by default the last.
    calibration : Calibration, optional
        Numbers of the verdict.
    effects, exclude : sequence of str
        Effects to look for (all when empty), and effects to leave out.
    simulated : list of Record
        Logs of the user's own simulator in the same experiments; then the question is what
        differs between it and the robot.
    loop : control.NonlinearIOSystem, optional
        Any closed loop in the place of the paper's joint, see `loop_ports`.

    Returns
    -------
    Diagnosis
        The result of every stage.

    """
    began = time.perf_counter()
    causes, left_out = chosen(effects, exclude), unnamed(effects, exclude)
    calibration = calibration or learned()
    if loop is None:
        asked = state_problem(robot, records, held_out)
        check = controller_check(asked)
    else:
        logs = list(robot) if isinstance(robot, (list, tuple)) else [robot]
        asked = loop_problem(loop, logs, held_out)
        check, causes = trusted(asked, causes), tuple(filter(asked.law.reaches, causes))
    ran = check.mended(asked)
    if simulated:
        ran, decisions = beside_simulator(ran, robot, simulated, causes, calibration)
        check = dataclasses.replace(check, decisions=check.decisions + decisions)
    causes = lacking(causes, ran.inside)
    bench, base, table = examined(held(ran), causes)
    again = second_look(bench.problem, table, causes, examined, calibration)
    ranking, model, table = _ranked(again or (bench, base, table), check, calibration)
    if again:
        ranking, model = in_the_loop(ranking, model, bench.problem)
    foreign = check.misdescribed or len(bench.problem.fit) > len(asked.fit)
    nominal = (baseline(held(asked))[1] if foreign else base).hypothesis
    paths = () if simulated or loop else path_causes(records, bench, check, calibration, left_out)
    said = with_paths(verdict(ranking, bool(established_by(check, left_out))), paths)
    believed = base if said == "unexplained" else model
    return Diagnosis(
        asked, check, bench, base, ranking, model, said,
        shrinkage(let_go(nominal, asked), let_go(model.hypothesis, asked), bench),
        torque_table(believed.hypothesis, bench),
        where(bench, base, check),
        next_experiment(bench, base, ranking, calibration), calibration, table,
        time.perf_counter() - began, paths, left_out)


def _ranked(look, check, calibration):
    """Hypotheses by probability, the leading one freed from idle joints, and the evidence."""
    bench, base, table = look
    ranking = weighed(table, calibration)
    if check.gains or check.integral:
        ranking = beyond_the_library(ranking)
    model = _leading(ranking, base)
    if model is not base:
        home = homed(pruned(model, bench, excess(base)), bench)
        ranking = [dataclasses.replace(s, fit=home) if s.fit is model else s for s in ranking]
        model = home
    return ranking, model, table


def examined(asked, causes=CAUSES, small=SMALL, whole=True):
    """Fit the nominal model and all hypotheses worth it.

    Parameters
    ----------
    asked : Problem
        The logs, with the law that ran.
    causes : sequence of Cause
        What to look for.
    small : float
        Share of the excess that is as good as nothing, see `explore`.
    whole : bool
        Test what is left, too, without which the evidence says nothing of the unknown.

    Returns
    -------
    bench : Bench
        Noise and whitening.
    base : Fit
        The refitted nominal model.
    table : Table
        The evidence.

    """
    bench, base = baseline(asked)
    learned_on = pooled(asked, base)
    if learned_on is not asked:
        bench, base = baseline(learned_on)
    ailing = excess(base) > QUIET or base.penalty > STRAYED
    fits = explore(bench, base, causes, small) if ailing and causes and not diverged(base) else []
    table = evidence(base, fits, bench)
    free = _free(base, [row.fit for row in table.rows if not row.rival], bench) if whole else ()
    return bench, base, dataclasses.replace(table, free=free)


def chosen(effects, exclude):
    """Return the causes to look for.

    Raises
    ------
    ClieError
        For a name that is not in the vocabulary.

    """
    for name in (*effects, *exclude):
        if name not in VOCABULARY:
            raise ClieError(
                f"no effect is called {name!r}; {nearest(name, sorted(VOCABULARY))}")
    return tuple(cause for cause in CAUSES
                 if (not effects or cause.name in effects) and cause.name not in exclude)


def unnamed(effects, exclude):
    """Effects that are not to be named: the excluded ones, and what a choice of effects lacks."""
    return frozenset(exclude) | (VOCABULARY - set(effects) if effects else frozenset())


def _leading(ranking, base):
    """Fit of the leading hypothesis that has one: what is unknown has none."""
    return next((standing.fit for standing in ranking if standing.fit is not None), base)


def _free(base, fits, bench):
    """What a free torque would leave, where even the best hypothesis leaves something."""
    best = min(fits, key=excess, default=None)
    if best is None or excess(best) < QUIET:
        return ()
    alone = min((f for f in fits if len(f.hypothesis.members) == 1), key=excess, default=best)
    beside = structured(best, bench)
    return (structured(base, bench), beside,
            beside if alone is best else structured(alone, bench))
