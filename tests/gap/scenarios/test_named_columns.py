"""Logs under the names of other programs get the answer that they get under plain ones."""

import json
import re

import pytest

from clie_blocks.analysis.gap.command import main

pytestmark = pytest.mark.slow
NAMES = {
    "PlotJuggler": {"time": "__time", "q": "/joint_states/position[{}]",
                    "u": "/joint_command/effort[{}]", "qd": "/joint_command/position[{}]",
                    "pe": "pe[{}]"},
    "Isaac": {"time": "time", "q": "joint_pos[{}]", "u": "computed_torque[{}]",
              "qd": "joint_pos_target[{}]", "pe": "joint_effort_target[{}]"},
    "own": {"time": "Zeit", "q": "Winkel {}", "u": "Moment {}", "qd": "Soll {}",
            "pe": "Zusatz {}"},
}
MAP = ["--map", "time=Zeit", "--map", "q=Winkel {k}", "--map", "u=Moment {k}",
       "--map", "qd=Soll {k}", "--map", "pe=Zusatz {k}"]


@pytest.fixture(scope="module")
def plain(tmp_path_factory, case, write_trial):
    folder = tmp_path_factory.mktemp("plain") / "arm"
    write_trial(case("coulomb"), folder)
    return folder


def diagnosed(folder, capsys, *options):
    assert main([str(folder), "--json", *options]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("source", NAMES)
def test_the_answer_does_not_depend_on_the_names(tmp_path, plain, capsys, source):
    folder = tmp_path / "Arm für Tests"
    folder.mkdir()
    for path in plain.iterdir():
        name, text = path.name, path.read_text()
        if name != "robot.toml":
            header, _, rows = text.partition("\n")
            columns = [re.fullmatch(r"([a-z]+?)(\d*)", column) for column in header.split(",")]
            text = ",".join(NAMES[source][c[1]].format(c[2]) for c in columns) + "\n" + rows
            name = name.replace("log-", "Fahrt ")
        (folder / name).write_text(text)
    wanted = diagnosed(plain, capsys)
    answer = diagnosed(folder, capsys, *(MAP if source == "own" else ()))
    for key in ("verdict", "effects", "gap_before", "gap_after", "gap_floor"):
        assert answer[key] == wanted[key], key
    assert "coulomb" in json.dumps(answer["effects"])
