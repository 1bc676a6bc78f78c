"""What a user meets first: a fast import, a fast help, errors in words and their exit codes."""

import subprocess
import sys
from pathlib import Path

import pytest

from clie_blocks.analysis import cli
from clie_blocks.errors import ClieError, NotIdentifiableError, RecordError, nearest
from clie_blocks.output import (
    command_parser,
    format_table,
    guarded,
    print_table,
    progress,
    report_stage,
    save_figure,
    to_json,
    write,
)

ANALYSIS = Path(cli.__file__).parent


def modules_after(code):
    """Names of the modules that a fresh interpreter holds after running some code."""
    run = subprocess.run([sys.executable, "-c", f"{code}\nimport sys; print(*sys.modules)"],
                         capture_output=True, text=True, check=True)
    return set(run.stdout.split())


def test_import_is_lazy():
    assert not {"numpy", "control", "scipy"} & modules_after("import clie_blocks")


def test_help_imports_nothing_heavy():
    loaded = modules_after("from clie_blocks.analysis import cli\ncli.main(['--help'])")
    assert not {"numpy", "control", "matplotlib", "rich"} & loaded


def test_a_diagnosis_needs_neither_python_control_nor_scipy():
    """Neither its stages nor its answer, which reads the catalogue and Theorem 2."""
    loaded = modules_after("from clie_blocks.analysis.gap import diagnosis\n"
                           "from clie_blocks.analysis.gap.report import answer\n"
                           "from clie_blocks.analysis.theory import bounds\n"
                           "from clie_blocks.analysis.records import read_trial\n"
                           "from clie_blocks.effects import LIBRARY\n"
                           "assert all(effect.family for effect in LIBRARY.values())")
    assert "numpy" in loaded
    assert not {"control", "scipy", "matplotlib", "pandas", "llvmlite"} & loaded


def test_a_report_needs_no_python_control():
    """Its picture of the loop is planned without a diagram: importing one takes a second."""
    loaded = modules_after("from clie_blocks.analysis.gap.report import localisation\n"
                           "localisation.loop_picture([{'block': 'joint', 'share': 1.0}])")
    assert "matplotlib" in loaded and not {"control", "scipy.signal"} & loaded


@pytest.mark.slow
@pytest.mark.parametrize("start", [
    ["-m", "clie_blocks.analysis.stability_report"], ["-m", "clie_blocks.analysis.reproduction"],
    [str(ANALYSIS / "stability_report")], [str(ANALYSIS / "reproduction")]])
def test_a_report_runs_as_a_module_and_as_a_folder(start, tmp_path):
    run = subprocess.run([sys.executable, *start, "--help"], capture_output=True, text=True,
                         cwd=tmp_path)
    assert run.returncode == 0 and "usage: clie" in run.stdout, run.stderr


def test_help_lists_every_verb(capsys):
    assert cli.main([]) == 0
    text = capsys.readouterr().out
    assert all(f"  {verb} " in text for verb in cli.VERBS)


@pytest.mark.parametrize("verb", cli.VERBS)
def test_every_verb_explains_itself(verb, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main([verb, "--help"])
    assert stop.value.code == 0
    assert "usage" in capsys.readouterr().out


def test_the_package_runs_as_a_module():
    run = subprocess.run([sys.executable, "-m", "clie_blocks", "--version"], capture_output=True,
                         text=True)
    assert run.returncode == 0 and run.stdout.startswith("clie "), run.stderr


def completed(script, *words):
    """What bash offers for the last of some words."""
    listed = " ".join(words)
    code = (f"{script}\nCOMP_WORDS=({listed}); COMP_CWORD={len(words) - 1}; _clie; "
            'echo "${COMPREPLY[@]}"')
    return subprocess.run(["bash", "-c", code], capture_output=True, text=True,
                          check=True).stdout.split()


def test_a_shell_completes_verbs_options_and_examples(capsys):
    assert cli.main(["--completion", "bash"]) == 0
    script = capsys.readouterr().out
    assert completed(script, "clie", "di") == ["diagnose"]
    assert completed(script, "clie", "diagnose", "--simu") == ["--simulated"]
    assert completed(script, "clie", "example", "fr") == ["friction-arm"]
    assert cli.main(["--completion", "fish"]) == 0
    fish = capsys.readouterr().out
    assert all(f"-a {verb} -d '{text}'" in fish for verb, (_, text) in cli.VERBS.items())
    assert cli.main(["--completion", "fsh"]) == 2
    assert "did you mean 'fish'" in capsys.readouterr().err


def test_unknown_verb_names_the_nearest(capsys):
    assert cli.main(["lop"]) == 2
    assert "did you mean 'loop'" in capsys.readouterr().err


@pytest.mark.parametrize("error, code", [
    (ClieError("x"), 2), (RecordError("x"), 3), (NotIdentifiableError("x"), 4),
    (KeyboardInterrupt(), 130)])
def test_errors_become_words_and_exit_codes(error, code, capsys):
    def fail(argv):
        raise error

    assert guarded(fail) == code
    assert "Traceback" not in capsys.readouterr().err


def test_nearest_lists_what_exists():
    assert nearest("pdd", ["pd", "plant"]) == "did you mean 'pd'? known: pd, plant"
    assert nearest("zzz", []) == "known: none"


def test_write_is_whole_or_not_at_all(tmp_path):
    path = write(tmp_path / "sub" / "a.txt", "old")
    with pytest.raises(ClieError, match="cannot write"):
        write(path / "below_a_file.txt", "new")
    assert path.read_text() == "old"
    assert [p.name for p in path.parent.iterdir()] == ["a.txt"]


def test_full_disk_is_an_error_in_words():
    with pytest.raises(ClieError, match="cannot write"):
        write("/dev/full/x", "content")


def test_a_progress_names_the_part_that_runs(monkeypatch, capsys):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    report_stage("nobody watches")
    with progress("diagnosing arm"):
        with progress("a part of it"):  # only the outer one is shown
            report_stage("searching for causes")
    shown = capsys.readouterr().err
    assert "diagnosing arm: searching for causes" in shown and "nobody" not in shown


def test_json_has_no_nan():
    import numpy as np

    text = to_json({"a": np.array([1.0, np.nan]), "b": float("inf"), "c": np.float64(2.0)})
    assert "NaN" not in text and "Infinity" not in text and "null" in text


def test_every_command_takes_json_and_a_folder_and_states_its_defaults(capsys):
    parser = command_parser("clie x", "Does x.", output="out/x")
    parser.add_argument("--gain", type=float, default=2.5, help="a gain")
    parser.add_argument("--other", help="no default")
    options = parser.parse_args(["--json", "-o", "here"])
    assert (options.json, options.output, options.gain) == (True, "here", 2.5)
    with pytest.raises(SystemExit):
        parser.parse_args(["--help"])
    text = capsys.readouterr().out
    assert "(default: out/x)" in text and "a gain (default: 2.5)" in text
    assert "None" not in text and "False" not in text


HEAD, ROWS = ("name", "value"), (("mass [kg]", "94.97"), ("offset", "-3.2"))


def test_a_table_in_a_pipe_is_plain_text(capsys):
    print_table(HEAD, ROWS)
    assert capsys.readouterr().out == ("name       value\n"
                                       "mass [kg]  94.97\n"
                                       "offset      -3.2\n")
    assert format_table(HEAD, ROWS, "<<").splitlines()[2] == "offset     -3.2"


def test_a_table_on_a_terminal_holds_every_cell_as_written(monkeypatch, capsys):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    print_table(HEAD, ROWS)
    text = capsys.readouterr().out
    assert all(cell in text for row in (HEAD, *ROWS) for cell in row)


def test_same_figure_same_svg_bytes(tmp_path):
    from matplotlib.figure import Figure

    def figure():
        drawn = Figure()
        drawn.subplots().plot([0, 1], [1, 0])
        return drawn

    paths = [save_figure(figure(), tmp_path / str(k), "f", ("svg",))[0] for k in range(2)]
    assert Path(paths[0]).read_bytes() == Path(paths[1]).read_bytes()


def test_missing_extra_says_what_to_install_also_from_a_worker():
    import pickle

    from clie_blocks.errors import MissingExtraError

    error = pickle.loads(pickle.dumps(MissingExtraError("reading bags", "rosbags", "ros")))
    assert str(error) == 'reading bags needs rosbags: pip install "clie-blocks[ros]"'
    assert guarded(lambda argv: (_ for _ in ()).throw(error)) == 2


def test_blind_trials_without_the_engine_say_so(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert cli.main(["blind", "--trials", "1", "-o", str(tmp_path)]) == 2
    assert "mujoco" in capsys.readouterr().err
