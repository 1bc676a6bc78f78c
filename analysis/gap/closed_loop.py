"""Closed-loop simulation of the robot with the effects of a hypothesis, as machine code.

The sampled loop is one block whose update is one period of the controller, so the compiled runner
carries it with one Euler step per period: x + T (x_next - x)/T.
"""

import dataclasses
import functools

import numpy as np

from clie_blocks.analysis.gap import simulated as robot
from clie_blocks.analysis.gap.simulated import SUBSTEPS, State


@dataclasses.dataclass(frozen=True, eq=False)
class Simulator:
    """Closed loop with given pieces; `run` gives the measured positions and the commands.

    Parameters
    ----------
    problem : Problem
        Robot and law.
    pieces : tuple of (str, Piece)
        What the effects add.
    numbers : dict
        Names of the parameters of each piece.

    """

    problem: object
    pieces: tuple
    numbers: dict

    @functools.cached_property
    def program(self):
        """The compiled program."""
        from clie_blocks.compiled import compile_diagram

        return compile_diagram(self.block)

    @functools.cached_property
    def layout(self):
        """Slices of the state: the motion, the law's memory, each piece's memory."""
        n, at, found = self.problem.n, 0, {}
        sizes = {"q": 1, "dq": 1, "law": 2}
        if self.loose:
            sizes.update(q_motor=1, dq_motor=1)
        sizes.update({name: piece.states for name, piece in self.pieces if piece.states})
        for name, rows in sizes.items():
            found[name] = (slice(at, at + rows * n), rows)
            at += rows * n
        return found

    @property
    def loose(self):
        """Whether motor and link move apart."""
        return any(piece.port == "transmission" for _, piece in self.pieces)

    @functools.cached_property
    def block(self):
        """The loop as a python-control block; Inputs: q_d, pe.  Outputs: q, u."""
        import control as ct

        from clie_blocks.signals import signals

        n, period = self.problem.n, self.problem.period
        size = max(where.stop for where, _ in self.layout.values())
        step, seen = self._step, self._seen

        def update(t, x, u, params):
            return (step(t, x, u, params) - x) / period

        def output(t, x, u, params):
            return seen(t, x, u, params)

        return ct.nlsys(update, output, name="robot", params=self.defaults(),
                        states=[f"x[{k}]" for k in range(size)],
                        inputs=signals("q_d", "pe", n=n), outputs=signals("q", "u", n=n))

    def defaults(self):
        """Values of all parameters before anything is fitted."""
        given, law, n = self.problem, self.problem.law, self.problem.n
        values = {"inertia": given.nominal.inertia, "damping": given.nominal.damping,
                  "load": given.nominal.load, "gain": np.ones(n), "start": np.zeros(n),
                  "kp": law.kp, "kd": law.kd, "b": law.numerator, "a": law.denominator}
        values.update({f"{name}.{key}": np.ones(n)
                       for name, keys in self.numbers.items() for key in keys})
        return {key: np.array(value, float) for key, value in values.items()}

    def run(self, log, values):
        """Measured positions and commands of the model, shape (N, n) each.

        Parameters
        ----------
        log : Log
            Reference, excitation and start.
        values : dict
            Parameters by key.

        """
        n = self.problem.n
        start = np.zeros(self.block.nstates)
        start[self.layout["q"][0]] = log.start
        if self.loose:
            start[self.layout["q_motor"][0]] = log.start
        rows = {"q_d": log.q_d, "pe": log.pe}
        response = self.program.run(
            len(log) * self.problem.period, step=self.problem.period, method="ode1", inputs=rows,
            initial_state=start, params={**values, "start": log.start})
        outputs = np.asarray(response.outputs)[:, :len(log)]
        return outputs[:n].T, outputs[n:].T

    def _unpack(self, x, params):
        n = self.problem.n
        memory = {name: [x[where][i * n:(i + 1) * n] for i in range(rows)]
                  for name, (where, rows) in self.layout.items()}
        p = {key: params[key] for key in ("inertia", "damping", "load", "gain", "start", "kp",
                                          "kd", "b", "a")}
        p.update({name: {key: params[f"{name}.{key}"] for key in keys}
                  for name, keys in self.numbers.items()})
        return memory, p

    def _seen(self, t, x, u, params):
        memory, p = self._unpack(x, params)
        n = self.problem.n
        q = robot.measure(memory["q"][0], self.pieces, p)
        torque, _ = robot.command(q, u[:n], u[n:], memory["law"], self.problem.law, p)
        return np.concatenate((q, torque))

    def _step(self, t, x, u, params):
        memory, p = self._unpack(x, params)
        n = self.problem.n
        for name, _ in self.pieces:
            memory.setdefault(name, [])
        q = robot.measure(memory["q"][0], self.pieces, p)
        torque, after = robot.command(q, u[:n], u[n:], memory["law"], self.problem.law, p)
        torque, kept = robot.delivered(torque, memory, self.pieces, p)
        torque = p["gain"] * torque
        move = self._move_apart if self.loose else self._move
        motion, remembered = move(t, memory, torque, p)
        kept.update(remembered)
        parts = [*motion[:2], *after, *motion[2:]]
        for name, piece in self.pieces:
            if piece.states:
                parts += kept[name]
        return np.concatenate(parts)

    def _move(self, t, memory, u, p):
        h, (q,), (dq,) = self.problem.period, memory["q"], memory["dq"]
        now = State(q, dq, u, t, h)
        ddq, limits, _, inverse = self._accelerated(now, memory, u, p)
        middle_rate = robot.stopped(dq + h / 2 * ddq, inverse, limits, h / 2)
        middle = State(q + h / 2 * dq, middle_rate, u, t + h / 2, h)
        ddq, limits, after, inverse = self._accelerated(middle, memory, u, p)
        end_rate = robot.stopped(dq + h * ddq, inverse, limits, h)
        return (q + h / 2 * (dq + end_rate), end_rate), after

    def _accelerated(self, s, memory, u, p):
        given = self.problem
        torque, after = robot.loads(s, memory, self.pieces, p)
        own, cross, bias = robot.link_terms(given.chain, given.gear_ratio, s, self.pieces, p)
        own = p["inertia"] + own
        ddq = robot.acceleration(u - torque - bias, own, cross)
        return ddq, robot.dry_friction(s, self.pieces, p), after, 1.0 / own

    def _move_apart(self, t, memory, u, p):
        given = self.problem
        h = given.period / SUBSTEPS
        (q,), (dq,), (q_m,), (dq_m,) = (memory[key] for key in ("q", "dq", "q_motor", "dq_motor"))
        (name, gap), = [(name, piece) for name, piece in self.pieces
                        if piece.port == "transmission"]
        link, link_damping = link_share(given, p)
        motor = p["inertia"] - link
        after = {}
        for _ in range(SUBSTEPS):
            s = State(q, dq, u, t, given.period)
            passed = gap.act(q_m - q, dq_m - dq, p[name], link)
            own, cross, bias = robot.link_terms(given.chain, given.gear_ratio, s, self.pieces, p)
            ddq = robot.acceleration(passed - bias - link_damping * dq, link + own, cross)
            torque, after = robot.loads(State(q_m, dq_m, u, t, h * SUBSTEPS), memory, self.pieces, p)
            ddq_m = (u - passed - torque + link_damping * dq_m) / motor
            limits = robot.dry_friction(State(q_m, dq_m, u, t, h * SUBSTEPS), self.pieces, p)
            dq = dq + h * ddq
            dq_m = robot.stopped(dq_m + h * ddq_m, 1.0 / motor, limits, h)
            q, q_m = q + h * dq, q_m + h * dq_m
        return (q, dq, q_m, dq_m), after


def link_share(given, p):
    """Inertia and damping of the link alone, motor side; a third of the whole if not stated."""
    chain = given.chain
    if chain.known:
        return chain.diagonal / given.gear_ratio, chain.bearing_damping / given.gear_ratio
    return p["inertia"] / 3, 0.0 * p["damping"]
