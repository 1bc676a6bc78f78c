"""What to mend before another run: the robot file, where it leaves open what may be the cause."""

from collections.abc import Sequence

from clie_blocks.analysis.gap.problem.problem import Problem
from clie_blocks.analysis.gap.verdict.posterior import RankedCause, credible_set

OF_THE_POSE = frozenset({"spring", "torque_ripple"})  # what the weight of links may be taken for
STATE_LINKS = (
    "State the links in the robot file: [links] length_m, mass_kg, com_m, inertia_kgm2, and "
    "[nominal] gravity. A torque that follows the pose may be their weight, which a model without "
    "links does not have")


def advice(problem: Problem, ranking: Sequence[RankedCause]) -> tuple[str, ...]:
    """What the robot file should state before another run, in sentences; most often nothing.

    The weight of links that are not stated is no cause that is searched for: a spring or a ripple
    of long waves takes its place.
    """
    turns = problem.robot is not None and all(
        unit == "rad" for record in problem.records[:1] for unit in record.units["q"])
    closest = next((one.names for one in ranking if one.fit is not None and one.fit.hypothesis
                    .members), ())
    follows_pose = OF_THE_POSE & {*credible_set(ranking), *closest}
    return (STATE_LINKS,) if turns and follows_pose and not problem.links.known else ()
