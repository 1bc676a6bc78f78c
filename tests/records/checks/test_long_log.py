"""Half an hour of six joints at 1 kHz is checked within half a gigabyte."""

import subprocess
import sys

import numpy as np
import pytest

RATE, MINUTES = 1000, 30
CHECK = """
import resource, subprocess, sys
command = "import sys; from clie_blocks.analysis.cli import main; sys.exit(main())"
done = subprocess.run([sys.executable, "-c", command, "check", sys.argv[1], "--json"],
                      stdout=subprocess.DEVNULL)
print(done.returncode, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


def write_long_log(path):
    """A minute of smooth motion that repeats, with the clock running on."""
    t = np.arange(60 * RATE) / RATE
    phases = np.linspace(0.0, 2.0, 6)
    q = 0.4 * np.sin(2 * np.pi * np.outer(t, np.arange(1, 7)) / 20 + phases)
    noise = np.random.default_rng(0).normal(0, 1e-4, q.shape)
    u = np.gradient(np.gradient(q, axis=0), axis=0) * RATE**2 + 0.1 * q
    rows = [",".join(f"{value:.7g}" for value in row) for row in np.hstack([q + noise, u, q, q])]
    with open(path, "w") as file:
        file.write(",".join(["time", *(f"{name}{k}" for name in ("q", "u", "qd", "dq")
                                       for k in range(1, 7))]) + "\n")
        for minute in range(MINUTES):
            file.writelines(f"{60 * minute + k / RATE:.3f},{row}\n"
                            for k, row in enumerate(rows))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="counts memory in the units of Linux")
def test_a_long_log_is_checked_within_half_a_gigabyte(tmp_path):
    write_long_log(tmp_path / "log.csv")
    done = subprocess.run([sys.executable, "-c", CHECK, str(tmp_path / "log.csv")],
                          capture_output=True, text=True, check=True)
    code, kilobytes = map(int, done.stdout.split())
    assert code in (0, 1, 4)
    assert kilobytes < 500_000
