"""Any loop with causes joined at its torque port: what the diagnosis simulates for ``loop=``.

The causes are one block that reads the motion of the loop and returns a torque to it.  Dry
friction is smoothed at rest there, since a foreign loop knows no sticking; a change of inertia,
damping or constant load acts as the torque that it would make.
"""

import dataclasses
import functools

import numpy as np

from clie_blocks.analysis.gap.loop_ports import COMMAND, EXCITATION, POSITION, RATE, REFERENCE
from clie_blocks.analysis.gap.simulated import State
from clie_blocks.signals import interconnect, signals, summing

MODEL = ("inertia", "damping", "load")
WIDTH = 2e-3  # rad/s: below this speed dry friction is smooth
FASTEST = 300.0  # rad/s, corner of the derivatives that the loop does not show
REACH = 0.4  # step times the fastest pole of the loop
MOST_SUBSTEPS = 50


def reachable(cause):
    """Whether a cause can act at a torque port: without memory, and without link data."""
    return not cause.needs_links and all(
        piece.port in ("load", "friction") and not piece.states for piece in cause.pieces)


@dataclasses.dataclass(frozen=True, eq=False)
class LoopSimulator:
    """A loop with causes, with the methods of `closed_loop.Simulator`.

    Parameters
    ----------
    law : LoopLaw
        The loop and what is known of it.
    causes : tuple of Cause
        What is joined.

    """

    law: object
    causes: tuple

    @functools.cached_property
    def program(self):
        """The compiled program."""
        from clie_blocks.compiled import compile_diagram

        return compile_diagram(self.diagram)

    @functools.cached_property
    def diagram(self):
        """The loop with its causes as a python-control diagram."""
        loop, found = self.law.diagram, self.law.ports
        blocks, wires = [loop, self._torque()], []
        wires.append(("missing.q", f"{loop.name}.{POSITION}"))
        if self._sees_u:
            wires.append(("missing.u", f"{loop.name}.{COMMAND}"))
        rate = f"{loop.name}.{RATE}"
        if not found.has_rate:
            blocks.append(self._derivative())
            wires.append(("derivative.q", f"{loop.name}.{POSITION}"))
            rate = "derivative.dq"
        wires.append(("missing.dq", rate))
        inputs = {REFERENCE: f"{loop.name}.{REFERENCE}"}
        if found.torque == EXCITATION:
            blocks.append(summing("pe", "torque", output="both", n=found.n, name="at_pe"))
            wires += [("at_pe.torque", "missing.tau"), (f"{loop.name}.{EXCITATION}", "at_pe.both")]
            inputs["pe"] = "at_pe.pe"
        else:
            wires.append((f"{loop.name}.{found.torque}", "missing.tau"))
            if found.has_pe:
                inputs["pe"] = f"{loop.name}.{EXCITATION}"
        inputs.update({name: f"{loop.name}.{name}" for name in found.other})
        shown = (POSITION, COMMAND)
        labels = {label.partition("[")[0] for label in loop.output_labels}
        used = {POSITION, COMMAND, *((RATE,) if found.has_rate else ())}
        return interconnect(
            blocks, wires, inputs=inputs,
            outputs={name: f"{loop.name}.{name}" for name in shown}, name="loop_with_causes",
            unused=[f"{loop.name}.{name}" for name in labels - used])

    @property
    def _sees_u(self):
        """Whether causes may read the command: not where their torque is part of it."""
        return self.law.ports.torque != EXCITATION

    def _torque(self):
        """Block of the missing torque; Inputs: q, dq, and u if it may.  Outputs: tau."""
        import control as ct

        n, law, causes = self.law.ports.n, self.law, self.causes
        step, sees_u = law.period if law.discrete else 0.0, self._sees_u

        def acceleration(x, dq):
            return (dq - x) / step if step else FASTEST * (dq - x)

        def update(t, x, u, params):
            dq = u[n:2 * n]
            return dq if step else FASTEST * (dq - x)

        def output(t, x, u, params):
            q, dq, command = u[:n], u[n:2 * n], u[2 * n:] if sees_u else 0.0 * u[:n]
            s = State(q, dq, command, t, law.period, law.chain, np.ones(n))
            tau = -((params["missing.inertia"] - law.inertia) * acceleration(x, dq)
                    + (params["missing.damping"] - law.damping) * dq + params["missing.load"])
            for cause in causes:
                p = {number.name: params[f"missing.{cause.block}.{number.name}"]
                     for number in cause.numbers}
                for piece in cause.pieces:
                    tau = tau - opposing(piece, s, p)
            return tau

        numbers = {f"missing.{key}": np.ones(n) for key in self._cause_keys}
        return ct.nlsys(update, output, name="missing", dt=self.law.diagram.dt,
                        params={"missing.inertia": law.inertia, "missing.damping": law.damping,
                                "missing.load": np.zeros(n), **numbers},
                        states=signals("slow", n=n), outputs=signals("tau", n=n),
                        inputs=signals("q", "dq", *(("u",) if sees_u else ()), n=n))

    def _derivative(self):
        """Velocities of a loop that does not show them; Inputs: q.  Outputs: dq."""
        import control as ct

        n, step = self.law.ports.n, self.law.period if self.law.discrete else 0.0

        def update(t, x, u, params):
            return u if step else FASTEST * (u - x)

        def output(t, x, u, params):
            return (u - x) / step if step else FASTEST * (u - x)

        return ct.nlsys(update, output, name="derivative", dt=self.law.diagram.dt,
                        states=signals("q_slow", n=n), inputs=signals("q", n=n),
                        outputs=signals("dq", n=n))

    def run(self, log, values, dithered=True):
        """Positions and commands of the loop, shape (N, n) each."""
        response = self.program.run(**self._question(log), params=self._numbers(values))
        outputs, n = np.asarray(response.outputs)[:, :len(log)], self.law.ports.n
        return outputs[:n].T.copy(), outputs[n:].T.copy()

    def positions(self, log, sets, dithered=True):
        """Positions for many sets of parameters, shape (sets, n, N)."""
        chosen = [self._numbers(values) for values in sets]
        params = {key: np.stack([values[key] for values in chosen]) for key in chosen[0]}
        done = self.program.batch(**self._question(log), params=params, threads=1,
                                  log=self.program.outputs[:self.law.ports.n])
        return done.outputs[:, :, :len(log)]

    def _numbers(self, values):
        """Parameters of the block of the missing torque; those of the loop stay as they are."""
        return {f"missing.{key}": values[key] for key in (*MODEL, *self._cause_keys)}

    @property
    def _cause_keys(self):
        return [f"{cause.block}.{number.name}" for cause in self.causes
                for number in cause.numbers]

    def _question(self, log):
        law, n = self.law, self.law.ports.n
        inputs = {REFERENCE: np.repeat(log.q_d, law.substeps, axis=0)}
        if law.ports.has_pe:
            inputs["pe"] = np.repeat(log.pe, law.substeps, axis=0)
        inputs.update({name: 0.0 for name in law.ports.other})
        start = law.at_rest(log.start)
        state = {law.diagram.name: start, "missing": np.zeros(n)}
        if not law.ports.has_rate:
            state["derivative"] = log.start
        wanted = np.concatenate([state[name] for name in self._order])
        step = {} if law.discrete else {"step": law.period / law.substeps, "method": "ode4"}
        return {"duration": len(log) * law.period, "inputs": inputs, "every": law.substeps,
                "initial_state": wanted, **step}

    @property
    def _order(self):
        """Blocks with states, in the order of the diagram."""
        return [block.name for block in self.diagram.syslist if block.nstates]


def opposing(piece, s, p):
    """Torque with which a piece opposes the motion; dry friction smooth at rest."""
    if piece.port == "load":
        return piece.act(s, [], p)[0]
    forward, backward = piece.act(s, p)
    direction = np.tanh(s.dq / WIDTH)
    return forward * np.maximum(direction, 0.0) + backward * np.minimum(direction, 0.0)
