"""Every file of `diagrams/` is a script that does something."""

import importlib
import json
from pathlib import Path

import pytest

from clie_blocks import diagrams
from clie_blocks.errors import ClieError

SCRIPTS = sorted(path.stem for path in Path(diagrams.__file__).parent.glob("*.py")
                 if path.stem != "__init__")
DRAWN = sorted({*SCRIPTS} - {"picture", "clie_loop", "clie_composite"})


def script(name):
    return importlib.import_module(f"clie_blocks.diagrams.{name}")


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_script_has_a_help_and_is_run_by_its_name(name, capsys):
    with pytest.raises(SystemExit) as end:
        script(name).main(["--help"])
    assert end.value.code == 0 and f"usage: {name}.py" in capsys.readouterr().out
    assert Path(script(name).__file__).read_text().endswith(
        'if __name__ == "__main__":\n    run_main(main)\n')


@pytest.mark.parametrize("name", DRAWN)
def test_a_script_draws_its_diagram(name, tmp_path, capsys):
    script(name).main(["-o", str(tmp_path)])
    assert capsys.readouterr().out.split() == [
        str(tmp_path / f"{name}.{ending}") for ending in ("png", "svg")]
    assert "<desc" in (tmp_path / f"{name}.svg").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("name, case", [("clie_loop", 1), ("clie_composite", 2)])
def test_a_script_runs_its_identification(name, case, tmp_path, capsys):
    script(name).main(["--duration", "21", "--kp", "12", "--json", "-o", str(tmp_path)])
    found = json.loads(capsys.readouterr().out)
    assert found["case"] == case and all(Path(path).is_file() for path in found["files"])
    assert len(found["theta_hat"]) == 6


def test_the_picture_of_a_user_s_file(tmp_path, capsys):
    file = tmp_path / "my_loop.py"
    file.write_text("import control as ct\n"
                    "plant = ct.ss(-1, 1, 1, 0, name='plant')\n"
                    "def loop():\n    return ct.feedback(plant, 1)\n")
    for name in ("plant", "loop"):
        script("picture").main([str(file), name, "-o", str(tmp_path)])
        assert (tmp_path / f"{name}.svg").is_file()
    with pytest.raises(ClieError, match="no 'plnt'; did you mean 'plant'"):
        script("picture").main([str(file), "plnt", "-o", str(tmp_path)])
