"""What a user's loop and its logs state: the parts of a problem without a robot file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from clie_blocks.analysis.gap.problem.log import Log, as_logs
from clie_blocks.analysis.gap.problem.nominal import Nominal
from clie_blocks.analysis.gap.problem.stated_links import stated_links
from clie_blocks.analysis.gap.problem.ticks import on_ticks
from clie_blocks.analysis.gap.problem.user_loop.checks import check_records
from clie_blocks.analysis.gap.problem.user_loop.law import LoopLaw, linearised_law
from clie_blocks.analysis.gap.problem.user_loop.ports import as_closed_loop, loop_ports
from clie_blocks.analysis.records import Record, Robot
from clie_blocks.analysis.records.checks.clock import even_clock
from clie_blocks.errors import RecordError

if TYPE_CHECKING:
    from control import InputOutputSystem

# Relative, of the joint model that a loop holds, which is taken as it is; of the load, relative to
# the RMS command.
TOLERANCE = {"inertia": 0.01, "damping": 0.05, "load": 0.005}


class LoopStatement(NamedTuple):
    """What is known of a robot whose model is a loop; the pieces of each record are logs."""

    robot: Robot
    law: LoopLaw
    nominal: Nominal
    logs: list[list[Log]]


def loop_statement(loop: InputOutputSystem, records: Sequence[Record]) -> LoopStatement:
    """Return law, joint model and logs of a user's loop with the ports of `loop_ports`.

    Raises
    ------
    ClieError
        If the loop is missing a port, fails, or its sample time is not that of the logs.
    DivergedError
        If the loop is unstable.
    RecordError
        If a record has another number of joints, or another sample time.
    NotIdentifiableError
        If a log is too short.

    """
    loop = as_closed_loop(loop)
    ports = loop_ports(loop)
    records = [on_ticks(even_clock(record), record.sample_time) for record in records]
    check_records(records, ports.n, loop.name)
    for record in records:
        if record.u is None:
            raise RecordError(f"{record.source} has no command u; without it the loop cannot be "
                              "compared with its controller: log what it commands")
    robot = Robot(n=ports.n, joints=records[0].joints)
    law = linearised_law(loop, ports, records[0], stated_links(robot, np.zeros(ports.n)))
    logs = [as_logs(record, robot, k, law.period) for k, record in enumerate(records)]
    commands = [log.u for pieces in logs for log in pieces]
    torque = np.sqrt(np.mean(np.concatenate(commands) ** 2, axis=0))
    nominal = Nominal(
        law.inertia, law.damping, np.zeros(ports.n), TOLERANCE["inertia"] * law.inertia,
        TOLERANCE["damping"] * np.maximum(law.damping, 0.1 * law.inertia),
        TOLERANCE["load"] * torque + 1e-12)
    return LoopStatement(robot, law, nominal, logs)
