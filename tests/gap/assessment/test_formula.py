"""A formula for what no effect holds: friction of place times load, made by another engine."""

import dataclasses
import json

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="needs the extra 'mujoco'")

import mujoco  # noqa: E402

from clie_blocks.analysis.blind.laws.run import Reference  # noqa: E402
from clie_blocks.analysis.export.correction import correction_of  # noqa: E402
from clie_blocks.analysis.export.export import export  # noqa: E402
from clie_blocks.analysis.gap.assessment.formula import formula_of  # noqa: E402
from clie_blocks.analysis.gap.assessment.formula_terms import written  # noqa: E402
from clie_blocks.analysis.gap.assessment.gap_reduction import HELD_OUT  # noqa: E402
from clie_blocks.analysis.gap.diagnosis import diagnose  # noqa: E402
from clie_blocks.analysis.gap.fitting.nominal import fit_nominal  # noqa: E402
from clie_blocks.analysis.gap.method.method import METHOD  # noqa: E402
from clie_blocks.analysis.gap.problem.problem import Problem  # noqa: E402
from clie_blocks.analysis.records import Record, Robot  # noqa: E402
from clie_blocks.analysis.records.controller_section import Controller
from clie_blocks.analysis.records.robot import Motor  # noqa: E402
from clie_blocks.joints import decoupled_joints  # noqa: E402

PERIOD, SUBSTEPS, SECONDS = 2e-3, 4, 6.0
INERTIA, DAMPING, KP, KD, NOISE = 0.06, 0.08, 30.0, 1.6, 2e-5
SHARE, WAVE, ORDER = 0.3, 0.28, 5.0  # of the torque that the joint carries; waves per turn
MODEL = f"""<mujoco><option timestep="{PERIOD / SUBSTEPS}" gravity="0 0 0"/><worldbody><body>
<joint name="q" axis="0 -1 0" damping="{DAMPING}" armature="{INERTIA - 1e-6}"/>
<inertial pos="0 0 0" mass="1e-3" diaginertia="1e-6 1e-6 1e-6"/></body></worldbody>
<actuator><motor joint="q"/></actuator></mujoco>"""
ROBOT = Robot(n=1, name="joint", motor=Motor(
    gear_ratio=[1.0], inertia=[INERTIA], viscous_friction=[DAMPING]),
    controller=Controller(law="pd", kp=[KP], kd=[KD], velocity_filter="difference",
                          sample_time=PERIOD))


def run(seed, lossy):
    """Log of the joint; `lossy` is the share of the friction that it has."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    reference, rows, last = Reference(np.random.default_rng(seed), 1, 1.6), [], None
    for k in range(round(SECONDS / PERIOD)):
        q_d = reference(PERIOD * k)[0][0]
        data.qpos[0] = q_d if k == 0 else data.qpos[0]
        q = data.qpos[0] + NOISE * rng.standard_normal()
        u = KP * (q_d - q) - KD * (0.0 if last is None else (q - last) / PERIOD)
        last = q
        rows.append((PERIOD * k, q, u, q_d))
        data.ctrl[0] = u
        for _ in range(SUBSTEPS):
            loss = lossy * abs(u) * (SHARE + WAVE * np.cos(ORDER * data.qpos[0]))
            data.qfrc_applied[0] = -loss * np.tanh(data.qvel[0] / 0.02)
            mujoco.mj_step(model, data)
    time, q, u, q_d = np.array(rows).T
    return Record(time=time, q=q[:, None], u=u[:, None], qd=q_d[:, None],
                  pe=0.0 * u[:, None], joints=ROBOT.joints, robot=ROBOT, source=f"log-{seed}")


def problem(lossy):
    return Problem.from_logs(ROBOT, [run(seed, lossy) for seed in (1, 2, 3)])


@pytest.fixture(scope="module")
def found():
    residuals, nominal = fit_nominal(problem(1.0), METHOD)
    return nominal, formula_of(nominal.hypothesis, residuals)


def test_it_closes_most_of_the_gap_on_a_log_that_it_has_not_seen(found):
    nominal, formula = found
    assert formula.reduction.unseen and formula.reduction.judged_on == HELD_OUT
    assert formula.reduction.percent > 70.0 and formula.reduction.interval[0] > 50.0
    assert len(formula.terms) <= METHOD.assessment.formula_terms and formula.beside == ()
    assert formula.fit.total < 0.1 * nominal.total


def test_its_terms_are_those_of_the_friction(found):
    """The friction against a motion that either loads or unloads the gear, by its own law."""
    from clie_blocks.effects.torque_term import TORQUE_TERM

    _, formula = found
    q, u = np.meshgrid(np.linspace(-0.4, 0.4, 21), np.linspace(0.5, 2.0, 7))
    dq = np.full_like(q, 0.5)
    torque = sum(TORQUE_TERM.build.kernel(q, dq, u, **formula.parameters(term), width=1e-3)
                 for term in formula.terms)
    values = formula.fit.hypothesis.values
    torque = torque + (values["damping"][0] - DAMPING) * dq + values["load"][0]
    truth = u * (SHARE + WAVE * np.cos(ORDER * q))
    assert np.sqrt(np.mean((torque - truth)**2)) < 0.35 * np.std(truth)


def test_it_finds_the_wave_of_the_loss(found):
    wave = max(map(found[1].parameters, found[1].terms), key=lambda p: p["order"])
    assert wave["load"] == 1.0 and wave["odd"] + wave["dry"] == 1.0
    assert wave["order"] == pytest.approx(ORDER, rel=0.02)
    assert wave["cosine"] / wave["torque"] == pytest.approx(WAVE, rel=0.05)
    assert abs(wave["sine"]) < 0.05 * wave["cosine"]


def test_the_answer_says_it_in_symbols(found):
    told = json.loads(json.dumps(found[1].as_dict()))
    assert told["percent"] > 70.0 and told["beside"] == []
    assert any("|u|" in term["torque"] for term in told["terms"])


def test_a_sound_joint_needs_no_formula():
    residuals, nominal = fit_nominal(problem(0.0), METHOD)
    assert formula_of(nominal.hypothesis, residuals) is None


def test_no_time_left_means_no_formula(found):
    residuals, nominal = fit_nominal(problem(1.0), METHOD)
    late = dataclasses.replace(residuals, deadline=0.0)
    assert formula_of(nominal.hypothesis, late) is None


@pytest.mark.parametrize("chosen, text", [
    ({"cosine": 0.2, "dry": 1.0}, "0.2 sign(dq)"),
    ({"cosine": 0.2, "sine": -0.1, "order": 5.0}, "(0.2 cos(5 q) - 0.1 sin(5 q))"),
    ({"slope": 3.0, "edge": 0.1}, "(3 max(q - 0.1, 0))"),
    ({"slope": 3.0, "edge": 0.1, "side": -1.0, "odd": 1.0, "linear": 1.0},
     "(3 min(q - 0.1, 0)) dq/1"),
    ({"cosine": 0.2, "load": 1.0, "driving": 1.0, "dry": 1.0, "slowness": 2.0},
     "0.2 exp(-(2 dq)^2) |u|/1 sign(dq) while u drives")])
def test_a_term_in_symbols(chosen, text):
    from clie_blocks.effects.torque_term import TORQUE_TERM

    assert written({p.name: p.default for p in TORQUE_TERM.parameters} | chosen) == text


@pytest.mark.slow
def test_a_diagnosis_corrects_a_plant_and_exports_what_it_does_not_name(tmp_path):
    diagnosis = diagnose(problem(1.0))
    answer = diagnosis.to_dict()
    assert "torque_term" not in str(answer["effects"]) + str(answer["set_90"])
    terms = [one for one in diagnosis.effects() if one.effect.name == "torque_term"]
    assert len(terms) == len(answer["formula"]["terms"]) > 0
    assert answer["formula"]["percent"] > 50.0
    plant = decoupled_joints([DAMPING / INERTIA], [1.0 / INERTIA], [0.0])
    corrected = diagnosis.corrected(plant)
    assert corrected.input_labels == plant.input_labels
    assert any("torque_term" in key for key in corrected.params)
    written_files = export(correction_of(answer), "c", None).save(tmp_path)
    assert any("torque_term" in file.read_text() for file in written_files
               if file.suffix == ".c")


def test_a_term_of_no_amplitude_does_nothing():
    from clie_blocks.effects.library import LIBRARY, effect_of

    term = effect_of("torque_term")
    assert term.name not in LIBRARY
    block = term.neutral().block(2)
    for x in np.linspace(-1.3, 1.7, 7):
        assert not np.any(block.output(0.0, np.zeros(0), np.full(block.ninputs, x)))
