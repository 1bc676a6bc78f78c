"""Warp, for Newton: the native functions give the numbers of the block in every world."""

import ctypes
import importlib.util
import re
import subprocess

import numpy as np
import pytest

from clie_blocks.analysis.export.core import core
from clie_blocks.analysis.export.export import export
from clie_blocks.analysis.export.joint_block import joint_block
from tests.export import robots
from tests.export.stand_ins import CXX, needs_cxx, pointer
from tests.export.test_cores import STEP, expected, signals

EFFECTS = ("stribeck", "actuator_lag", "encoder_eccentricity", "load_dependent_friction")
WORLDS = 3
IN_CPP = """
#include <cmath>
#define CUDA_CALLABLE
struct numbers { double *data; };
extern "C" void start(int world, double *data)
{ numbers memory{data}; %s code::j1_start(joint); }
extern "C" void advance(int world, double *data, double q, double dq, double u, double other)
{ numbers memory{data}; %s code::j1_advance(joint, q, dq, u, other); }
"""


def made():
    """Correction, core, and what the block gives in every world, shape (worlds, N, outputs)."""
    correction = robots.of_links(*map(robots.setting, EFFECTS))
    rows = np.array([signals(40 * WORLDS)[k::WORLDS] for k in range(WORLDS)])
    one = core(joint_block(correction, 0, STEP))
    return correction, one, rows, np.array([expected(one, world) for world in rows])


@needs_cxx
def test_the_native_functions_give_the_numbers_of_the_block_in_every_world(tmp_path):
    correction, one, rows, wanted = made()
    text = export(correction, "newton").files["corrected_joints_newton.py"]
    compile(text, "corrected_joints_newton.py", "exec")
    snippet = re.search(r'J1_CODE = r"""(.*?)"""', text, re.DOTALL)[1]
    (tmp_path / "one.cc").write_text(IN_CPP % (snippet, snippet))
    subprocess.run([CXX, "-std=c++17", "-Wall", "-Werror", "-fPIC", "-shared",
                    "-ffp-contract=off", "-o", "one.so", "one.cc"], cwd=tmp_path, check=True)
    code, memory = ctypes.CDLL(str(tmp_path / "one.so")), np.zeros((WORLDS, one.size))
    for world in range(WORLDS):
        code.start(world, pointer(memory))
    numbers = [memory[:, place] for place in one.places.values()]
    np.testing.assert_array_equal(np.transpose(numbers), [one.values] * WORLDS)
    for i in range(rows.shape[1]):
        for world in range(WORLDS):
            code.advance(world, pointer(memory), *map(ctypes.c_double, rows[world, i]))
        np.testing.assert_allclose(memory[:, -wanted.shape[2]:], wanted[:, i], rtol=1e-12,
                                   atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("device", ["cpu", "cuda:0"])
def test_the_kernels_run_in_warp(tmp_path, device):
    wp = pytest.importorskip("warp", reason="needs warp-lang")
    if not wp.is_device_available(device):
        pytest.skip(f"needs the device {device}")
    correction, one, rows, wanted = made()
    (path,) = export(correction, "newton").save(tmp_path)
    spec = importlib.util.spec_from_file_location("corrected_joints_newton", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    joint = module.CorrectedJoint("j1", [2, 1, 0], [3, 4, 5], device)
    for i in range(20):
        q, dq, force, other = (
            wp.array(np.concatenate(columns), dtype=wp.float32, device=device)
            for columns in ((rows[::-1, i, 0],), ([9.0] * 3, rows[:, i, 1]),
                            ([7.0] * 3, rows[:, i, 2]), ([5.0] * 3, rows[:, i, 3])))
        joint.apply(q, dq, force, other)
        np.testing.assert_allclose(force.numpy(), [7.0] * 3 + list(wanted[:, i, 0]), rtol=1e-4,
                                   atol=1e-5)  # positions come in single precision
    joint.reset([1])
    started = np.array(joint.numbers.numpy())[:, 0]
    np.testing.assert_allclose(started, [20 * STEP, 0.0, 20 * STEP])
    with pytest.raises(ValueError, match="those are"):
        module.CorrectedJoint("j9", [0], [0], device)
