"""The C file, the FMU and the Python listing compute what the python-control block does."""

import ctypes
import shutil
import subprocess
import types

import numpy as np
import pytest

from clie_blocks.analysis.export import truth_table
from clie_blocks.analysis.export.c_target import export_c
from clie_blocks.analysis.export.core import Core, core, identifier
from clie_blocks.analysis.export.correction import Correction
from clie_blocks.analysis.export.fmu import COMPILERS, export_fmu
from clie_blocks.analysis.export.joint_block import OUTPUTS, joint_block
from clie_blocks.effects import LIBRARY
from tests.export import robots

COMPILER = next((found for name in COMPILERS if (found := shutil.which(name))), None)
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="needs a C compiler")
STEP = 1e-3
MIXTURES = [("coulomb",), ("stribeck", "actuator_lag", "torque_ripple"),
            ("time_delay", "presliding", "encoder_quantization"),
            ("backlash", "coulomb", "actuator_saturation"), ("torsional_hysteresis",),
            ("rest_time_breakaway", "maxwell_slip"), ("load_dependent_friction", "step_fault")]
UNITS = 14  # that hold all effects together


def made(names):
    """Core of the joint with some effects."""
    effects = [robots.setting(name) for name in names]
    return core(joint_block(robots.of_links(*effects, gain=2.0, torque=3.0, command=0.5,
                                            zero=0.1, inertia=0.06), 0, STEP))


def signals(count=300):
    """Random inputs of a block, shape (N, 4)."""
    draw = np.random.default_rng(4)
    return draw.normal(0.0, [0.3, 0.5, 1.0, 0.1], (count, 4))


def expected(block_core, rows):
    """Outputs of the block in python-control, sample by sample, shape (N, outputs)."""
    system = block_core.block.system("block")
    x, found = np.zeros(system.nstates), []
    for i, row in enumerate(rows):
        found.append(system.output(i * STEP, x, row))
        x = system.dynamics(i * STEP, x, row) if system.nstates else x
    return np.array(found)


def library(block_core, folder):
    """The compiled C file, with the fewest words that C has for its types."""
    for name, text in ((".c", block_core.c_source()), (".h", block_core.c_header())):
        (folder / f"{block_core.name}{name}").write_text(text)
    subprocess.run([COMPILER, "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2",
                    "-ffp-contract=off", "-shared", "-fPIC", "-o", "joint.so",
                    f"{block_core.name}.c", "-lm"], cwd=folder, check=True)
    return ctypes.CDLL(str(folder / "joint.so"))


@needs_compiler
@pytest.mark.parametrize("names", MIXTURES, ids=" ".join)
def test_the_c_file_computes_what_the_block_does(names, tmp_path):
    one, rows = made(names), signals()
    sizes = (1, max(len(one.states), 1), len(one.parameters), len(OUTPUTS))
    memory = (ctypes.c_double * sum(sizes))()
    code = library(one, tmp_path)
    advance = getattr(code, f"{one.name}_advance")
    advance.restype, advance.argtypes = ctypes.c_double, [ctypes.c_void_p, *[ctypes.c_double] * 4]
    getattr(code, f"{one.name}_start")(memory)
    found = []
    for row in rows:
        torque = advance(memory, *row)
        found.append(memory[sum(sizes[:3]):])
        assert np.isfinite(torque) and torque == found[-1][0]
    np.testing.assert_allclose(found, expected(one, rows), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("names", MIXTURES[:3], ids=" ".join)
def test_the_python_listing_computes_what_the_block_does(names):
    one, rows = made(names), signals()
    module = types.ModuleType("listing")
    exec(one.python_source(), vars(module))
    derivative, observe = getattr(module, f"_{one.name}")()
    p, x, found = [value for _, value in one.parameters], np.zeros(len(one.states)), []
    for i, row in enumerate(rows):
        seen = observe(i * STEP, x, row, p)
        found.append([seen[one.rows[name]] for name in OUTPUTS])
        x = np.array(derivative(i * STEP, x, row, p))
    np.testing.assert_allclose(found, expected(one, rows), rtol=1e-12, atol=1e-12)


@needs_compiler
def test_the_fmu_is_valid_and_computes_what_the_block_does(tmp_path):
    fmpy = pytest.importorskip("fmpy", reason="needs the extra clie-blocks[fmi]")
    from fmpy.validation import validate_fmu

    effects = [robots.setting(name) for name in MIXTURES[1]]
    exported = export_fmu(robots.correction(*effects), STEP)
    (path,) = exported.save(tmp_path)
    assert path.name == "j1.fmu" and validate_fmu(str(path)) == []
    rows = signals(60)
    run = held_run(fmpy, path, rows)
    one = core(joint_block(robots.correction(*effects), 0, STEP))
    np.testing.assert_allclose(run, expected(one, rows), rtol=1e-12, atol=1e-12)


@needs_compiler
@pytest.mark.slow
def test_every_effect_that_is_native_in_code_runs_in_fmpy_as_in_the_block(tmp_path):
    """A few in each unit, and no two gears; all units in one export, as joints of one robot."""
    fmpy = pytest.importorskip("fmpy", reason="needs the extra clie-blocks[fmi]")
    names = [name for name in LIBRARY if str(truth_table.support(name, "code")) == "native"
             and name not in truth_table.IN_THE_MODEL]
    assert len(names) >= 38
    units = [names[k::UNITS] for k in range(UNITS)]  # neighbours in the catalogue are alike
    effects = tuple(LIBRARY[name](joints=[k], **robots.setting(name).values)
                    for k, unit in enumerate(units) for name in unit)
    robot = Correction(tuple(robots.joint(name=f"unit{k}", inertia=0.06) for k in range(UNITS)),
                       robots.PERIOD, effects)
    rows = signals(40)
    for k, path in enumerate(export_fmu(robot, STEP).save(tmp_path)):
        one = core(joint_block(robot, k, STEP))
        assert one.name == path.stem
        np.testing.assert_allclose(held_run(fmpy, path, rows), expected(one, rows), rtol=1e-12,
                                   atol=1e-12, err_msg=", ".join(units[k]))


def held_run(fmpy, path, rows):
    """Outputs at each sample, with the inputs held over each step, shape (N, outputs)."""
    from fmpy.fmi3 import FMU3Slave

    description = fmpy.read_model_description(str(path))
    reference = {one.name: one.valueReference for one in description.modelVariables}
    unit = FMU3Slave(guid=description.guid, unzipDirectory=fmpy.extract(str(path)),
                     modelIdentifier=description.coSimulation.modelIdentifier,
                     instanceName="joint")
    unit.instantiate()
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    found = []
    for i, row in enumerate(rows):
        unit.setFloat64([reference[name] for name in ("q", "dq", "u", "tau_other")], list(row))
        found.append(unit.getFloat64([reference[name] for name in OUTPUTS]))
        unit.doStep(currentCommunicationPoint=i * STEP, communicationStepSize=STEP)
    unit.terminate()
    unit.freeInstance()
    return np.array(found)


@needs_compiler
def test_an_fmu_refuses_a_step_that_is_no_whole_number_of_its_own(tmp_path):
    fmpy = pytest.importorskip("fmpy", reason="needs the extra clie-blocks[fmi]")
    (path,) = export_fmu(robots.correction(robots.setting("coulomb")), STEP).save(tmp_path)
    with pytest.raises(Exception, match="fmi3DoStep"):
        fmpy.simulate_fmu(str(path), stop_time=0.0015, output_interval=0.0015)


def test_the_same_answer_gives_the_same_bytes():
    first, second = (export_fmu(robots.correction(robots.setting("coulomb")), STEP).files
                     for _ in range(2))
    assert first == second


def test_names_of_joints_become_names_of_functions():
    assert identifier("arm/joint 1") == "arm_joint_1" and identifier("1") == "joint_1"
    files = export_c(robots.correction(robots.setting("coulomb"), name="2nd axis"), STEP).files
    assert set(files) == {"joint_2nd_axis.c", "joint_2nd_axis.h"}
    assert isinstance(made(("coulomb",)), Core)


def test_dry_friction_holds_a_joint_that_something_else_pulls_at():
    """Below its level friction is the torque that stops the joint, and no more."""
    system = joint_block(robots.correction(robots.setting("coulomb"), offset=0.0), 0,
                         STEP).system("block")
    at_rest, pulled = (system.output(0.0, [], [0.0, 0.0, 0.04, other])[0]
                       for other in (0.0, 0.03))
    assert at_rest == pytest.approx(0.0, abs=1e-15)
    assert pulled == pytest.approx(-0.03, abs=1e-15)
    sliding = system.output(0.0, [], [0.0, 1.0, 0.04, 0.0])[0]
    assert sliding == pytest.approx(0.04 - robots.DAMPING - 0.1)
