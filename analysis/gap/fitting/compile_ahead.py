"""Machine code for the next fits of a search, made by another process meanwhile.

The code of an arm of many joints takes as long to compile as a fit runs, mostly under the lock of
the interpreter, so that threads gain nothing.  What the process has compiled lies on the disk;
what it has not reached yet, a fit compiles by itself.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Iterable, Iterator
from typing import BinaryIO, NamedTuple, cast

from clie_blocks.analysis.gap.causes.vocabulary import searched_causes
from clie_blocks.analysis.gap.fitting.hypothesis import Hypothesis
from clie_blocks.analysis.gap.simulation.batch_runs import longest_delay
from clie_blocks.analysis.gap.simulation.closed_loop import Simulator, simulator
from clie_blocks.compiled.cache import store
from clie_blocks.processors import processors
from clie_blocks.robot_loop.block import Structure

_DONE = b"\n"
_PATIENCE = 10.0  # s that a program in progress is waited for, which takes less than one


class _Job(NamedTuple):
    """A program: its structure, the causes by key, and how batches of it are run."""

    structure: Structure
    causes: tuple[str, ...]
    longest_delay: float
    parameters: tuple[str, ...]
    takes_sums: bool
    identity: str


class _Compiler:
    """Another process that compiles one program after the other."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", __name__], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self._waiting: list[_Job] = []
        self._asked: set[str] = set()
        self._current = ""
        self._changed = threading.Condition()
        threading.Thread(target=self._send, daemon=True).start()

    def ask(self, jobs: Iterable[_Job]) -> None:
        """Let these programs be compiled next, instead of those that wait."""
        with self._changed:
            self._waiting = [job for job in jobs if job.identity not in self._asked]
            self._changed.notify()

    def leave(self, identity: str) -> None:
        """Leave a program to this process; wait for it, if it is being compiled already."""
        with self._changed:
            self._waiting = [job for job in self._waiting if job.identity != identity]
            self._asked.add(identity)
            self._changed.wait_for(lambda: self._current != identity, _PATIENCE)

    def end(self) -> None:
        """Stop; what is on the disk is whole."""
        self._process.kill()
        self._process.communicate()
        self.ask([])

    def _send(self) -> None:
        """Send one job after the other: each when the one before is done."""
        while self._process.poll() is None:
            with self._changed:
                if not self._waiting:
                    self._changed.wait()
                    continue
                job = self._waiting.pop(0)
                self._asked.add(job.identity)
                self._current = job.identity
            with contextlib.suppress(OSError, ValueError):  # it has ended
                _write(job, cast(BinaryIO, self._process.stdin))
                cast(BinaryIO, self._process.stdout).readline()
            with self._changed:
                self._current = ""
                self._changed.notify_all()


_compilers: list[_Compiler] = []  # of the searches that are running


@contextlib.contextmanager
def compiler(is_worth_it: bool) -> Iterator[None]:
    """Compile what `compile_ahead` names in another process, where there is a processor for it."""
    running = _started() if is_worth_it and processors() > 1 and store.folder() else None
    if running is None:
        yield
        return
    _compilers.append(running)
    try:
        yield
    finally:
        _compilers.pop().end()


def _started() -> _Compiler | None:
    """A compiler; None where no process can be started."""
    try:
        return _Compiler() if sys.executable else None
    except OSError:
        return None


def compile_ahead(hypotheses: Iterable[Hypothesis]) -> None:
    """Have the code of some hypotheses compiled, the first ones first, if a `compiler` runs."""
    if _compilers:
        _compilers[-1].ask([job for job in map(_job, hypotheses) if job is not None])


def compile_here(hypothesis: Hypothesis) -> None:
    """Keep the code of a hypothesis, which is needed now, from being compiled twice."""
    job = _job(hypothesis) if _compilers else None
    if job is not None:
        _compilers[-1].leave(job.identity)


def _job(hypothesis: Hypothesis) -> _Job | None:
    """What another process needs to compile the code of a hypothesis; None if it cannot."""
    loop, logs = hypothesis.simulator, hypothesis.problem.fit
    if not isinstance(loop, Simulator):
        return None
    sets = [hypothesis.of_log(j) for j in range(len(logs))]
    longest = longest_delay(loop, sets)
    return _Job(loop.shape, tuple(member.cause.key for member in hypothesis.all_members), longest,
                (*sets[0], "start", "first"), logs[0].stride == 1, _identity(loop, longest))


def _identity(loop: Simulator, longest_delay: float) -> str:
    return store.key(loop.for_delays(longest_delay).identity)


def _write(job: _Job, pipe: BinaryIO) -> None:
    pipe.write(pickle.dumps(job))
    pipe.flush()


def _compile(job: _Job) -> None:
    """Compile a program, if its causes are those of the library here as well."""
    by_key = {cause.key: cause for cause in searched_causes()}
    if {*job.causes} <= {*by_key}:
        loop = simulator(job.structure, tuple(by_key[key] for key in job.causes))
        if _identity(loop, job.longest_delay) == job.identity:
            loop.for_delays(job.longest_delay).compile(job.parameters, job.takes_sums)


def main() -> None:
    """Compile the programs that come in by the standard input, until it ends."""
    jobs, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    while True:
        try:
            job = pickle.load(jobs)
        except EOFError:
            return
        with contextlib.suppress(Exception):  # whoever needs the program meets the error
            _compile(job)
        answers.write(_DONE)
        answers.flush()


if __name__ == "__main__":
    main()
