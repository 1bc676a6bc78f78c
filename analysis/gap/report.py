"""The diagnosis as a page: verdict, before and after, causes, where, what next, decisions."""

import numpy as np

from clie_blocks.analysis.gap.json_answer import answer
from clie_blocks.analysis.gap.shrinkage import judging_logs
from clie_blocks.analysis.report.document import (
    BAD,
    GOOD,
    UNSURE,
    Document,
    Picture,
    Section,
    Table,
)

SHOWN = 5  # causes in the tables
ROWS = 1500  # points of a drawn error


def save_report(diagnosis, folder, stem="report"):
    """Write the report as one HTML file and as Markdown, and return the paths."""
    from clie_blocks.analysis.report.render import save_document

    return save_document(document(diagnosis), folder, stem)


def document(diagnosis):
    """Return the report of a diagnosis.

    Parameters
    ----------
    diagnosis : Diagnosis
        From `diagnose`.

    """
    told = answer(diagnosis)
    mood = {"none": GOOD, "unexplained": BAD}.get(diagnosis.verdict, UNSURE)
    sections = [_shrinkage(diagnosis, told), _which(told), _where(diagnosis, told),
                _next(told), _simulators(told), _decisions(diagnosis)]
    return Document("Where the robot differs from its model", verdict_sentence(told), mood,
                    tuple(section for section in sections if section is not None),
                    facts=(("gap before", f"{1e3 * told['gap_before']:.3g} mrad"),
                           ("gap after", f"{1e3 * told['gap_after']:.3g} mrad"),
                           ("noise floor", f"{1e3 * told['gap_floor']:.3g} mrad")))


def verdict_sentence(told):
    """One sentence for the head of the page."""
    if told["verdict"] == "none":
        return "The model explains the logs down to the noise."
    if told["verdict"] == "unexplained":
        return "Something is there that no effect of the library explains."
    if told["verdict"] == "parametric":
        return "The model has the right form and wrong numbers."
    named = [e for e in told["effects"] if e["probability"] >= 0.5 and e["joint"]]
    if not named:
        return f"One of {', '.join(told['set_90'])}: these logs cannot tell which."
    return "; ".join(f"{_words(e['effect'])} at joint {' and '.join(map(str, e['joint']))} "
                     f"({e['probability']:.0%})" for e in named).capitalize() + "."


def _words(name):
    return name.replace("_", " ")


def _shrinkage(diagnosis, told):
    closed = told["closed_percent"]
    said = ("There is no gap above the noise to close." if closed["value"] is None else
            f"The corrected model removes {closed['value']:.0f} % of the reducible gap")
    if closed["interval"]:
        said += f" (95 %: {closed['interval'][0]:.0f} to {closed['interval'][1]:.0f} %)"
    where = "a log not used for fitting" if closed["unseen_data"] else "the logs it was fitted to"
    return Section("How far the gap shrinks", (f"{said}, on {where}.",),
                   pictures=(Picture("before-after", _errors(diagnosis),
                                     "Prediction error of each joint on the judging log, with "
                                     "the refitted nominal model and with the corrected one."),))


def _errors(diagnosis):
    from matplotlib.figure import Figure

    problem = diagnosis.bench.problem
    j = judging_logs(problem)[-1]
    before = diagnosis.base.hypothesis.error(j, dithered=False)
    after = diagnosis.model.hypothesis.error(j, dithered=False)
    step = max(1, len(before) // ROWS)
    time = problem.period * np.arange(len(before))[::step]
    figure = Figure(figsize=(8, 1 + 1.8 * problem.n), layout="constrained")
    for k, axes in enumerate(np.atleast_1d(figure.subplots(problem.n, sharex=True))):
        axes.plot(time, 1e3 * before[::step, k], lw=0.8, label="refitted nominal model")
        axes.plot(time, 1e3 * after[::step, k], lw=0.8, label="corrected model")
        axes.set_ylabel(f"{problem.joints[k]}\nerror [mrad]", parse_math=False)
    axes.set_xlabel("time [s]")
    axes.legend(loc="upper right")
    return figure


def _which(told):
    rows = [(_words(e["effect"]), ", ".join(map(str, e["joint"] or ())) or "-",
             f"{e['probability']:.1%}", _numbers(e)) for e in told["effects"][:SHOWN]]
    points = [f"{_words(name)}: {text}" for name, text in _signatures(told)]
    return Section("Which effect", points=tuple(points), tables=(Table(
        ("effect", "joint", "probability", "numbers (motor side)"), tuple(rows),
        "Causes by probability; the set that holds 90 % is "
        + ", ".join(map(_words, told["set_90"])) + "."),))


def _numbers(effect):
    found = []
    for name, number in effect.get("parameters", {}).items():
        values = np.ravel(np.array(number["value"], float))
        if values.size <= 4 and np.all(np.abs(values) < 1e6):
            shown = ", ".join(f"{value:.4g}" for value in values)
            found.append(f"{_words(name)} {shown} {number['unit']}".strip())
    return "; ".join(found)


def _signatures(told):
    from clie_blocks.effects import LIBRARY

    return [(name, LIBRARY[name].signature) for name in told["set_90"] if name in LIBRARY]


def _where(diagnosis, told):
    rows = [(row["name"], f"{row['share']:.0%}", f"{1e3 * row['rms']:.3g}",
             f"{1e3 * row['floor']:.3g}", f"{row['chi2_per_sample']:.3g}",
             "as stated" if row["replay_error"] <= row["replay_limit"] else "differs")
            for row in told["where"]["joint"]]
    bands = [(f"{low:g} to {high:g}", f"{row['share']:.0%}") for row in told["where"]["frequency"]
             for low, high in [row["band_hz"]]]
    regions = [(diagnosis.problem.joints[row["joint"] - 1], name,
                " / ".join(f"{share:.0%}" for share in row[name]["share"]))
               for row in told["where"]["region"] for name in ("position", "speed", "torque")]
    return Section(
        "Where the gap lies",
        ("Shares of the squared prediction error of the refitted nominal model.",),
        tables=(Table(("joint", "share of the gap", "error [mrad]", "noise floor [mrad]",
                       "chi2 per sample", "controller"), tuple(rows), "By joint."),
                Table(("band [Hz]", "share"), tuple(bands), "By frequency."),
                Table(("joint", "ordered by", "share of each quarter, low to high"),
                      tuple(regions), "By region of operation; even would be 25 % each.")),
        pictures=(_diagram(diagnosis, told),))


def _diagram(diagnosis, told):
    from clie_blocks.diagrams.joint_loop import joint_loop
    from clie_blocks.diagrams.picture import draw
    from clie_blocks.joints import decoupled_joints

    law, values = diagnosis.bench.problem.law, diagnosis.base.hypothesis.values
    damping, inertia = values["damping"], values["inertia"]
    loop = joint_loop(decoupled_joints(damping / inertia, 1 / inertia, values["load"] / inertia),
                      law.kp, law.kd)
    controller = 1.0 if diagnosis.check.wrong and diagnosis.verdict != "none" else 0.0
    others = any(e["joint"] and e["probability"] >= 0.5 and e["effect"] != "encoder_quantization"
                 and e["effect"] != "velocity_filter_mismatch" for e in told["effects"])
    plant = 0.0 if diagnosis.verdict == "none" or (controller and not others) else 1.0
    total = max(controller + plant, 1.0)
    return Picture("diagram", draw(loop, values={"pd": controller / total,
                                                 "plant": plant / total},
                                   value_label="share of the gap"),
                   "The loop, coloured by the share of the gap that each block holds.")


def _next(told):
    run = told["next_experiment"]
    if run is None:
        return None
    rows = [(row["experiment"], f"{row['least_distance']:.3g}", f"{row['expected_set_size']:.2f}")
            for row in run["menu"]]
    return Section("Next experiment", (
        "These logs leave " + " and ".join(" with ".join(map(_words, names))
                                           for names in run["separates"])
        + f" open. Run: {run['best']['experiment']}.",), tables=(Table(
            ("experiment", "chi2 between the nearest two", "expected set size"), tuple(rows)),))


def _simulators(told):
    from clie_blocks.effects import LIBRARY

    rows = [(_words(name), *(LIBRARY[name].simulators[key] for key in ("mujoco", "isaac",
                                                                       "gazebo")))
            for name in told["set_90"] if name in LIBRARY]
    return Section("In your simulator", tables=(Table(
        ("effect", "MuJoCo", "Isaac", "Gazebo"), tuple(rows)),)) if rows else None


def _decisions(diagnosis):
    nominal, model = diagnosis.problem.nominal, diagnosis.model.hypothesis.values
    rows = [(diagnosis.problem.joints[k], name, f"{getattr(nominal, name)[k]:.4g}",
             f"{getattr(nominal, f'{name}_tolerance')[k]:.2g}", f"{model[name][k]:.4g}")
            for k in range(diagnosis.problem.n) for name in ("inertia", "damping", "load")]
    checked = ("The stated control law reproduces the logged command."
               if not diagnosis.check.wrong else "The stated control law is not the one that ran.")
    return Section("Checks and decisions", (checked,), points=diagnosis.check.decisions, tables=(
        Table(("joint", "number", "stated", "tolerance", "fitted"), tuple(rows),
              "Joint model, motor side."),))
