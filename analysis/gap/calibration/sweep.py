"""What a threshold decides: labelled trials diagnosed with the threshold at several values.

    python -m clie_blocks.analysis.gap.calibration.sweep search.leaders 4 8 12 --trials FOLDER

The folder holds one folder per trial, as ``clie diagnose`` reads them, and ``labels.json`` with
the kind and the labels of each.
"""

import argparse
import ast
import dataclasses
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from clie_blocks.analysis.gap.calibration.examples import truth_of
from clie_blocks.analysis.gap.method import METHOD, Method
from clie_blocks.analysis.gap.method.method import Threshold
from clie_blocks.errors import ClieError, RecordError
from clie_blocks.output import print_table, progress, run_main

_WITHOUT_EFFECT = ("none", "parametric")  # kinds of trial on which to name an effect is an alarm
HEAD = ("value", "right first", "mean set size", "false alarms", "seconds")


@dataclasses.dataclass(frozen=True)
class Outcome:
    """How labelled trials came out under one method.

    Parameters
    ----------
    trials, right : int
        Trials, and those whose most probable name is one of the truth.
    set_size : float
        Mean number of names in the 90 % sets.
    sound, alarms : int
        Trials without an effect, and those of them with the verdict ``effect``.
    seconds : float
        Time of all diagnoses.

    """

    trials: int
    right: int
    set_size: float
    sound: int
    alarms: int
    seconds: float

    @classmethod
    def of(cls, answers: Mapping[str, dict[str, Any]], labels: Mapping[str, dict[str, Any]],
           ) -> "Outcome":
        """Outcome of the answers to some trials, by name, of which the labels are known."""
        sound = [name for name in answers if labels[name]["kind"] in _WITHOUT_EFFECT]
        return cls(
            trials=len(answers),
            right=sum(answer["effects"][0]["effect"] in truth_of(labels[name])
                      for name, answer in answers.items()),
            set_size=sum(len(answer["set_90"]) for answer in answers.values()) / len(answers),
            sound=len(sound),
            alarms=sum(answers[name]["verdict"] == "effect" for name in sound),
            seconds=sum(answer["seconds"] for answer in answers.values()))

    def cells(self) -> tuple[str, ...]:
        """Row of the table, after the value."""
        return (f"{self.right} of {self.trials}", f"{self.set_size:.2f}",
                f"{self.alarms} of {self.sound}", f"{self.seconds:.1f}")


def sweep(name: str, values: Iterable[Any], trials: Path, labels: Path | None = None,
          method: Method = METHOD) -> dict[Any, Outcome]:
    """Diagnose labelled trials with a threshold at each of some values.

    Parameters
    ----------
    name : str
        Threshold, as ``Method.thresholds`` names it.
    values : iterable
        Values.
    trials : Path
        Folder of folders with ``robot.toml`` and logs.
    labels : Path, optional
        File with kind and labels of each trial, by default ``labels.json`` in the folder.
    method : Method
        All other thresholds.

    Raises
    ------
    ClieError
        If no threshold has the name; names the nearest one.
    RecordError
        If a trial has no label.

    """
    from clie_blocks.analysis.gap.batch import find_tasks, state
    from clie_blocks.analysis.gap.diagnosis import diagnose

    methods = {value: method.with_values(**{name: value}) for value in values}
    known, tasks = _read_labels(labels or trials / "labels.json"), find_tasks([trials])
    unlabelled = sorted({task.name for task in tasks} - set(known))
    if unlabelled:
        raise RecordError(f"no label for {', '.join(unlabelled)}; a sweep needs the truth of "
                          "every trial: add it to the labels, or move the trial elsewhere")
    problems = {task.name: state(task) for task in tasks}
    outcomes = {}
    with progress(f"sweeping {name}", len(methods) * len(problems)) as advance:
        for value, changed in methods.items():
            answers = {}
            for trial, problem in problems.items():
                answers[trial] = diagnose(problem, method=changed).to_dict()
                advance(1)
            outcomes[value] = Outcome.of(answers, known)
    return outcomes


def _read_labels(path: Path) -> dict[str, dict[str, Any]]:
    if not path.is_file():
        raise RecordError(f"{path} does not exist: name the file with the truth of the trials "
                          "with --labels")
    return json.loads(path.read_text())


def find_threshold(name: str, method: Method = METHOD) -> Threshold:
    """Return a threshold by its name.

    Raises
    ------
    ClieError
        If no threshold has the name; names the nearest one.

    """
    method.with_values(**{name: None})  # which refuses a name that it does not know
    return next(one for one in method.thresholds() if one.name == name)


def read_value(text: str, threshold: Threshold) -> Any:
    """Return a value as the threshold takes it: a whole number, a number, or a tuple of them.

    Raises
    ------
    ClieError
        If the text is none.

    """
    kind = type(threshold.value)
    try:
        value = ast.literal_eval(text)
        if kind is tuple:
            return tuple(value)
        if isinstance(value, bool) or kind(value) != value:
            raise ValueError(text)
        return kind(value)
    except (ValueError, SyntaxError, TypeError):
        what = {int: "a whole number", float: "a number"}.get(kind, f"like {threshold.value}")
        raise ClieError(f"{text} is no value of {threshold.name}, which is {what} "
                        f"[{threshold.unit}]") from None


def main(argv: Sequence[str] | None = None) -> int:
    """Sweep one threshold and print the outcomes."""
    options = _parser().parse_args(argv)
    threshold = find_threshold(options.threshold)
    values = [read_value(text, threshold) for text in options.values]
    outcomes = sweep(options.threshold, values, options.trials, options.labels)
    if not options.json:
        print(f"{threshold.name} [{threshold.unit}]: {threshold.reason}; now {threshold.value}")
        print_table(HEAD, [(str(value), *outcome.cells()) for value, outcome in outcomes.items()])
        return 0
    rows = [{"value": value, **dataclasses.asdict(outcome)} for value, outcome in outcomes.items()]
    print(json.dumps({"threshold": threshold.name, "unit": threshold.unit, "outcomes": rows},
                     indent=1))
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m clie_blocks.analysis.gap.calibration.sweep", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("threshold", help="its name, such as search.leaders")
    parser.add_argument("values", nargs="+", metavar="VALUE", help="values to diagnose with")
    parser.add_argument("--trials", type=Path, required=True, metavar="FOLDER",
                        help="folder of labelled trials")
    parser.add_argument("--labels", type=Path, metavar="FILE",
                        help="truth of the trials (labels.json in the folder)")
    parser.add_argument("--json", action="store_true", help="print the outcomes as JSON")
    return parser


if __name__ == "__main__":
    run_main(main)
