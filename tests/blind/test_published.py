"""The study that is published in docs/blind, if this checkout holds one."""

import json
import re
from collections import Counter
from pathlib import Path

import pytest

from clie_blocks.analysis.blind.imperfect.damages import DAMAGES
from clie_blocks.analysis.blind.protocol.seeds import are_fresh, were_opened
from clie_blocks.analysis.blind.protocol.targets import (
    ARMS_TARGETS,
    CATALOGUE_TARGETS,
    compare,
    compare_with_targets,
)
from clie_blocks.analysis.blind.report import imperfect as imperfect_page
from clie_blocks.analysis.blind.report.page import document
from clie_blocks.analysis.blind.scoring import imperfect
from clie_blocks.analysis.blind.scoring.intervals import rate, summary
from clie_blocks.analysis.blind.scoring.robustness import outcome_shares
from clie_blocks.analysis.blind.scoring.score import VISIBLE
from clie_blocks.analysis.report.render import markdown
from clie_blocks.effects import LIBRARY
from clie_blocks.output import to_json

IMPERFECT = Path(__file__).resolve().parents[2] / "docs" / "blind" / "imperfect.json"
CATALOGUE = IMPERFECT.parent / "catalogue" / "scoreboard.json"
ARMS = IMPERFECT.parent / "arms" / "scoreboard.json"
BOARD = Path(__file__).resolve().parents[2] / "docs" / "blind" / "scoreboard.json"


@pytest.fixture
def board():
    if not BOARD.is_file():
        pytest.skip("no study is published in docs/blind")
    return json.loads(BOARD.read_text())


def test_the_published_seeds_trained_nothing(board):
    assert are_fresh(board["seeds"])
    assert board["command"].startswith("clie blind --trials")


def test_the_published_study_is_complete(board):
    assert board["trials"] == sum(board["kinds"].values()) >= 100
    assert len(board["failed"]) <= 0.01 * board["trials"]
    assert board["targets"] == compare_with_targets(board)


def test_the_published_shares_follow_from_their_counts(board):
    shares = [share for share in _parts(board) if "hits" in share]
    assert len(shares) > 150
    for share in shares:
        again = rate([True] * share["hits"] + [False] * (share["of"] - share["hits"]))
        assert again["rate"] == share["rate"]
        if share["of"]:
            assert again["interval"] == pytest.approx(share["interval"], abs=1e-8)


def test_the_published_figures_follow_from_the_kept_rows(board):
    reduction = board["shrinkage"]
    again = summary(achieved / achievable for achievable, achieved, _ in reduction["points"]
                    if achievable > VISIBLE)
    for name, value in again.items():
        assert value == pytest.approx(reduction[name], rel=1e-12)
    for key in ("controllers", "spatial"):
        again = outcome_shares(board[key]["rows"])
        assert {name: share["hits"] for name, share in again.items()} == {
            name: board[key][name]["hits"] for name in again}
    decisions = [row["said"] for row in board["left_out"]]
    assert decisions.count("unknown") == board["left_out_unknown"]["hits"]


def _parts(value):
    """All dictionaries within a value."""
    if isinstance(value, dict):
        yield value
    for part in value.values() if isinstance(value, dict) else value:
        if isinstance(part, (dict, list)):
            yield from _parts(part)


def test_the_published_page_shows_the_published_figures(board):
    assert (BOARD.parent / "scoreboard.md").read_text() == markdown(document(board))


def test_the_page_shows_the_published_targets_and_the_readme_some_of_them(board):
    readme, told = ((BOARD.parents[2] / name).read_text() for name in (
        "docs/how_often_right.md", "README.md"))
    page = (BOARD.parent / "scoreboard.md").read_text()
    rows = [line.strip() for line in page.splitlines()
            if any(line.startswith(f"| {row['words']} ") for row in board["targets"])]
    assert len(rows) >= len(board["targets"])
    assert all(row in readme for row in rows[:len(board["targets"])])
    shown = [line for line in told.splitlines() if re.match(r"\| .* \| (yes|no) \|$", line)]
    assert len(shown) >= 5 and set(shown) <= set(rows)


@pytest.fixture
def catalogue_board():
    if not CATALOGUE.is_file():
        pytest.skip("no study of the catalogue is published in docs/blind")
    return json.loads(CATALOGUE.read_text())


def test_the_published_study_of_the_catalogue_is_complete(catalogue_board):
    board = catalogue_board
    assert are_fresh(board["seeds"]) or were_opened(board["seeds"])
    assert board["failed"] == ["58231/trial-001"]  # the page says why
    assert board["trials"] == sum(board["kinds"].values()) == 89 * len(board["seeds"])
    assert board["targets"] == compare_with_targets(board, CATALOGUE_TARGETS)
    assert CATALOGUE.with_suffix(".md").read_text() == markdown(document(board))
    assert set(LIBRARY) <= set(board["by_name"])


def test_the_pages_tell_the_study_of_the_catalogue(catalogue_board):
    board, told = catalogue_board, (BOARD.parents[1] / "how_often_right.md").read_text()
    page = CATALOGUE.with_suffix(".md").read_text().splitlines()
    for row in board["targets"]:
        (line, *_) = [one.strip() for one in page if one.startswith(f"| {row['words']} |")]
        assert line in told
    first, unknown = board["top_1"], board["false_unknown"]
    assert f"Of {board['trials']} further robots" in told
    assert f"for {unknown['hits']} of the {unknown['of']} robots" in told
    low, high = first["interval"]
    assert (f"{first['rate']:.2f} ({low:.2f} to {high:.2f}) of {first['of']} robots with one "
            "effect were named right") in " ".join(
                (BOARD.parents[2] / "README.md").read_text().split())
    assert board["false_alarm"]["hits"] == 0


@pytest.fixture
def imperfect_board():
    if not IMPERFECT.is_file():
        pytest.skip("no study of imperfect logs is published in docs/blind")
    return json.loads(IMPERFECT.read_text())


def test_the_published_imperfect_logs_follow_from_their_rows(imperfect_board):
    board = imperfect_board
    assert are_fresh(board["seeds"]) or were_opened(board["seeds"])
    assert board["trials"] == len(board["rows"]) >= 100
    assert board["command"].startswith("clie blind --imperfect --trials")
    again = json.loads(to_json(imperfect.figures(board["rows"])))
    assert again == {key: board[key] for key in again}
    assert compare(board, imperfect.TARGETS) == board["targets"]
    assert sum(held["of"] for held in board["by_damage"].values()) == board["trials"]


def test_the_published_page_of_imperfect_logs_shows_its_figures(imperfect_board):
    page = markdown(imperfect_page.document(imperfect_board))
    assert IMPERFECT.with_suffix(".md").read_text() == page


def test_the_page_shows_the_targets_of_imperfect_logs(imperfect_board):
    board, readme = imperfect_board, (IMPERFECT.parent.parent / "how_often_right.md").read_text()
    rows = [line.strip() for line in IMPERFECT.with_suffix(".md").read_text().splitlines()
            if any(line.startswith(f"| {row['words']} |") for row in board["targets"])]
    assert all(row in readme for row in rows[:len(board["targets"])])
    assert f"Of {board['trials']} further robots" in readme
    assert f"in one of {len(DAMAGES)} ways" in readme
    wrong = board["wrong_name_on_twins"]["hits"], board["wrong_name"]["hits"]
    assert "names of the same robots: {} with intact files, {} with damaged ones".format(
        *wrong) in readme
    named = {row["trial"]: (row["damage"], set(row["wrong"])) for row in board["rows"]
             if row["wrong"]}
    assert sorted(named.values()) == [
        ("logged_at_500_hz", {"coulomb"}), ("noise_x20", {"gravity"}),
        ("wrong_gear_ratio", {"torque_gain_error"})]


def test_each_confusion_of_the_catalogue_is_on_the_page(catalogue_board):
    """One row of the page per truth and answer, with the number of their trials."""
    page = (CATALOGUE.parents[2] / "confusions.md").read_text(encoding="utf-8")
    section = page.split("## Every name of the catalogue")[1].split("\n## ")[0]
    told = {(truth, answer): int(count) for truth, answer, count in re.findall(
        r"^\| `(\w+)` \| `(\w+)` \| (\d+) \|", section, re.MULTILINE)}
    decided = Counter(("parametric" if row["kind"] == "parametric" else row["true"][0],
                       row["said"]) for row in catalogue_board["wrong"])
    assert told == decided
    assert f"{catalogue_board['trials']} robots, {decided.total()} decided wrong" in section


@pytest.fixture
def arms_board():
    if not ARMS.is_file():
        pytest.skip("no study of arms in space is published in docs/blind")
    return json.loads(ARMS.read_text())


def test_the_published_study_of_arms_in_space_is_complete(arms_board):
    board = arms_board
    assert are_fresh(board["seeds"]) or were_opened(board["seeds"])
    assert board["failed"] == []
    assert board["trials"] == sum(board["kinds"].values()) >= 150
    assert board["targets"] == compare_with_targets(board, ARMS_TARGETS)
    assert ARMS.with_suffix(".md").read_text() == markdown(document(board))


def test_the_page_tells_the_study_of_arms_in_space(arms_board):
    told = (ARMS.parents[2] / "blind_trials.md").read_text()
    page = ARMS.with_suffix(".md").read_text().splitlines()
    for row in arms_board["targets"]:
        (line, *_) = [one.strip() for one in page if one.startswith(f"| {row['words']} |")]
        assert line in told
    assert f"{arms_board['command']} --jobs 2" in told
