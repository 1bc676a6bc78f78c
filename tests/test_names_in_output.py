"""Names from files are shown as they are written, and obeyed by nothing that shows them."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from clie_blocks.analysis import cli
from clie_blocks.analysis.records.model import Record
from clie_blocks.analysis.report.document import Document, Picture, Section, Table
from clie_blocks.analysis.report.render import save_document
from clie_blocks.errors import ClieError, RecordError, visible
from clie_blocks.output import guarded, plain, save_figure

EVIL = ["$\\frac{$", "$x", "a$b$c", "_x^{", "\\", "$$", "<b>&\"'", "%s {0}", "[/red]", "é µ ²",
        "机器"]
FEW = EVIL[:2] + EVIL[6:7]
CONTROL = "\x1b]0;owned\x07\x1b[2J\u202e\x9b\udce4"


def test_control_characters_are_written_out():
    assert visible("a\x1b[2J\tb\x85\udce4\u202e") == "a\\x1b[2J\\tb\\x85\\udce4\\u202e"
    assert visible("two\nlines", keep="\n") == "two\nlines"
    assert visible("q [°] µ 机器 😀") == "q [°] µ 机器 😀"


def test_an_error_is_shown_without_its_control_characters():
    text = str(RecordError(f"{CONTROL} is no log; " + "9" * 5000 + " end"))
    assert text.isprintable() and len(text) < 2100
    assert text.startswith("\\x1b]0;owned\\x07") and text.endswith("end")


@pytest.mark.filterwarnings("ignore:Glyph")
def test_a_check_of_joints_with_strange_names_draws_its_page(tmp_path, capsys):
    time = np.arange(900) / 100
    rows = np.column_stack([time, *(np.sin(k + time) for k in range(2 * len(FEW)))])
    header = ",".join(["time", *(f"{s}{k + 1}" for s in "qu" for k in range(len(FEW)))])
    names = ", ".join('"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"' for name in FEW)
    (tmp_path / "robot.toml").write_text(f"joints = {len(FEW)}\njoint_names = [{names}]\n")
    log = tmp_path / "log$x^.csv"
    np.savetxt(log, rows, delimiter=",", header=header, comments="", fmt="%.5f")
    code = cli.main(["check", str(log), "-o", str(tmp_path / "out")])
    printed = capsys.readouterr()
    assert code in (0, 1, 4) and "Traceback" not in printed.err
    assert all(name in printed.out for name in FEW)
    assert (tmp_path / "out" / "check-1.png").stat().st_size > 1000


@pytest.mark.filterwarnings("ignore:Glyph")
def test_every_name_makes_a_picture_and_a_page_that_can_be_read(tmp_path):
    from matplotlib.figure import Figure

    names = [*EVIL, CONTROL]
    figure = Figure(figsize=(6, 6))
    axes = figure.subplots()
    axes.barh([plain(name) for name in names], range(len(names)))
    axes.set_title(plain(CONTROL + EVIL[0]))
    save_figure(figure, tmp_path, "figure")
    ET.parse(tmp_path / "figure.svg")
    sections = [Section(name, (name,), (name,), (Table((name,), ((name,),), name),))
                for name in names]
    pictures = Section("", pictures=(Picture("figure", figure, "".join(names)),))
    document = Document("".join(names), CONTROL, "good", [*sections, pictures], ((CONTROL, ""),))
    html, markdown, svg = save_document(document, tmp_path, "page")
    ET.parse(svg)
    for path in (html, markdown):
        text = Path(path).read_text(encoding="utf-8")
        assert all(letter.isprintable() or letter == "\n" for letter in text)
        assert "<b>" not in text


@pytest.mark.filterwarnings("ignore:Glyph")
def test_every_name_can_be_drawn_in_a_diagram(tmp_path):
    import control as ct

    from clie_blocks.diagrams.picture import draw

    names = [*FEW, CONTROL]
    block = ct.ss(-1, np.ones((1, len(names))), 1, np.zeros((1, len(names))), inputs=names,
                  outputs=["y"], name="block")
    diagram = ct.interconnect([block], inputs=names, outputs=["y"], name="diagram")
    figure = draw(diagram, names={"block": EVIL[0]}, values={"block": 1.0}, value_label=EVIL[0],
                  title=CONTROL + EVIL[0])
    save_figure(figure, tmp_path, "diagram")
    ET.parse(tmp_path / "diagram.svg")


def test_a_record_shows_its_source_and_refuses_names_that_cannot_be_shown():
    time = np.arange(4.0)
    record = Record(time, time, source=f"a{CONTROL}.csv", decisions=[CONTROL])
    assert record.source.isprintable() and record.decisions[0].isprintable()
    with pytest.raises(RecordError, match="joint name .* cannot be printed"):
        Record(time, time, joints=[CONTROL])
    with pytest.raises(RecordError, match="more than 100 of them"):
        Record(time, time, joints=["x" * 101])


def test_columns_with_control_characters(tmp_path, capsys):
    (tmp_path / "log.csv").write_text("time,q_\x1b[2J,\x07extra\n" + "".join(
        f"{k / 100},{k % 7},{k}\n" for k in range(50)))
    cli.main(["check", str(tmp_path / "log.csv")])
    printed = capsys.readouterr()
    assert "\\x1b[2J" in printed.out + printed.err
    assert "\x1b" not in printed.out + printed.err and "\x07" not in printed.out + printed.err


def test_a_folder_with_control_characters_names_its_report(tmp_path):
    from clie_blocks.analysis.gap.tasks import find_tasks

    folder = tmp_path / f"a{CONTROL}"
    folder.mkdir()
    (folder / "robot.toml").write_text("joints = 1\n")
    (folder / "log-1.csv").write_text("time,q1,u1\n0,1,2\n1,2,3\n")
    (task,) = find_tasks([folder])
    assert task.name.isprintable() and task.name.startswith("a\\x1b]0;owned")
    assert task.paths == (str(folder),)


@pytest.mark.parametrize("error, code, words", [
    (ZeroDivisionError("float division"), 70, "this is a fault of clie, not of your data"),
    (MemoryError(), 3, "not enough memory"),
    (PermissionError(13, "Permission denied", "log.csv"), 3, "cannot use log.csv"),
    (RecursionError("maximum recursion depth"), 70, "RecursionError"),
    (ClieError(CONTROL), 2, "error: ")])
def test_what_no_part_expected_is_one_line(error, code, words, capsys, monkeypatch):
    def fail(argv):
        raise error

    monkeypatch.delenv("CLIE_TRACEBACK", raising=False)
    assert guarded(fail) == code
    text = capsys.readouterr().err
    assert words in text and text.count("\n") == 1 and text.strip().isprintable()


def test_the_place_of_a_fault_can_be_asked_for(monkeypatch):
    def fail(argv):
        raise ZeroDivisionError

    monkeypatch.setenv("CLIE_TRACEBACK", "1")
    with pytest.raises(ZeroDivisionError):
        guarded(fail)
