"""Sources for other tools give the numbers of the block: run there, or against a stand-in."""

import ctypes
import subprocess
import types

import numpy as np
import pytest

from clie_blocks.analysis.export.core import core
from clie_blocks.analysis.export.export import TARGETS, export
from clie_blocks.analysis.export.joint_block import OUTPUTS, joint_block
from tests.export import robots
from tests.export.test_cores import COMPILER, STEP, expected, needs_compiler, signals

EFFECTS = ("stribeck", "actuator_lag", "torque_ripple", "encoder_eccentricity")
# What simstruc.h declares and an S-function of this kind uses, with the documented arguments.
SIMSTRUC = """
typedef double real_T;
typedef int int_T;
typedef struct { double in[4], out[6], work[4000]; int_T reals; double step; } SimStruct;
static void ssSetNumSFcnParams(SimStruct *S, int_T n) { (void)S; (void)n; }
static int_T ssGetNumSFcnParams(SimStruct *S) { (void)S; return 0; }
static int_T ssGetSFcnParamsCount(SimStruct *S) { (void)S; return 0; }
static void ssSetNumContStates(SimStruct *S, int_T n) { (void)S; (void)n; }
static void ssSetNumDiscStates(SimStruct *S, int_T n) { (void)S; (void)n; }
static int_T ssSetNumInputPorts(SimStruct *S, int_T n) { (void)S; return n == 1; }
static void ssSetInputPortWidth(SimStruct *S, int_T k, int_T n) { (void)S; (void)k; (void)n; }
static void ssSetInputPortDirectFeedThrough(SimStruct *S, int_T k, int_T yes)
{ (void)S; (void)k; (void)yes; }
static void ssSetInputPortRequiredContiguous(SimStruct *S, int_T k, int_T yes)
{ (void)S; (void)k; (void)yes; }
static int_T ssSetNumOutputPorts(SimStruct *S, int_T n) { (void)S; return n == 1; }
static void ssSetOutputPortWidth(SimStruct *S, int_T k, int_T n) { (void)S; (void)k; (void)n; }
static void ssSetNumSampleTimes(SimStruct *S, int_T n) { (void)S; (void)n; }
static void ssSetNumRWork(SimStruct *S, int_T n) { S->reals = n; }
static void ssSetSampleTime(SimStruct *S, int_T k, double h) { (void)k; S->step = h; }
static void ssSetOffsetTime(SimStruct *S, int_T k, double t) { (void)S; (void)k; (void)t; }
static real_T *ssGetRWork(SimStruct *S) { return S->work; }
static const real_T *ssGetInputPortRealSignal(SimStruct *S, int_T k) { (void)k; return S->in; }
static real_T *ssGetOutputPortRealSignal(SimStruct *S, int_T k) { (void)k; return S->out; }
"""
CALLS = """
void begin(SimStruct *S)
{ mdlInitializeSizes(S); mdlInitializeSampleTimes(S); mdlStart(S); }
void major_step(SimStruct *S) { mdlOutputs(S, 0); mdlUpdate(S, 0); }
void end(SimStruct *S) { mdlTerminate(S); }
"""


def made():
    """Correction, and what its block gives on random signals."""
    correction = robots.correction(*map(robots.setting, EFFECTS))
    return correction, expected(core(joint_block(correction, 0, STEP)), signals(80))


def module(exported):
    """The Python module of an export."""
    ((name, text),) = exported.files.items()
    found = types.ModuleType(name.removesuffix(".py"))
    exec(text, vars(found))
    return found


def test_the_python_control_block_gives_the_numbers_of_the_block():
    correction, wanted = made()
    block = module(export(correction, "python-control", step=STEP)).block("j1")
    assert block.dt == STEP and list(block.output_labels) == list(OUTPUTS)
    x = np.zeros(block.nstates)
    for i, row in enumerate(signals(80)):
        np.testing.assert_allclose(block.output(i * STEP, x, row), wanted[i], rtol=1e-12,
                                   atol=1e-12)
        x = block.dynamics(i * STEP, x, row)


def test_the_drake_system_gives_the_numbers_of_the_block():
    pytest.importorskip("pydrake", reason="needs drake")
    from pydrake.systems.analysis import Simulator

    correction, wanted = made()
    system = module(export(correction, "drake", step=STEP)).J1()
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    for i, row in enumerate(signals(80)):
        for port, value in enumerate(row):
            system.get_input_port(port).FixValue(context, value)
        simulator.AdvanceTo((i + 0.5) * STEP)
        given = [system.GetOutputPort(name).Eval(context)[0] for name in ("tau", "q_measured")]
        np.testing.assert_allclose(given, wanted[i][[0, 5]], rtol=1e-9, atol=1e-9)


@needs_compiler
def test_the_s_function_gives_the_numbers_of_the_block(tmp_path):
    correction, wanted = made()
    export(correction, "simulink", step=STEP).save(tmp_path)
    (tmp_path / "simstruc.h").write_text(SIMSTRUC)
    (tmp_path / "cg_sfun.h").write_text(CALLS)
    subprocess.run([COMPILER, "-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", "-shared", "-fPIC",
                    "-ffp-contract=off", "-I.", "-o", "sfun.so", "j1_sfun.c", "j1.c", "-lm"],
                   cwd=tmp_path, check=True)
    code, memory = ctypes.CDLL(str(tmp_path / "sfun.so")), (ctypes.c_double * 4012)()
    code.begin(memory)
    for row, expected_row in zip(signals(80), wanted, strict=True):
        memory[:4] = list(row)
        code.major_step(memory)
        np.testing.assert_allclose(memory[4:10], expected_row, rtol=1e-12, atol=1e-12)
    code.end(memory)


@pytest.mark.parametrize("target", [name for name in TARGETS
                                    if name not in ("mujoco", "simscape")])
def test_every_target_tells_the_inertia_that_stays_in_the_simulator(target):
    exported = export(robots.correction(robots.setting("backlash")), target)
    assert exported.files and exported.ran
    assert "inertia of 0.012 kg m^2; 0.008 kg m^2 more is the motor's" in exported.notes[0]
