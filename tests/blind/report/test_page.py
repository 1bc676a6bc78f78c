"""The scoreboard in a headless browser, with every section that it can have."""

import re
import shutil
import subprocess
from html import escape
from pathlib import Path

import pytest

from clie_blocks.analysis.blind.comparison import leave_one_out, methods
from clie_blocks.analysis.blind.population import spatial_arms, wrong_controller
from clie_blocks.analysis.blind.protocol.targets import compare_with_targets
from clie_blocks.analysis.blind.report.page import save_page
from clie_blocks.analysis.blind.scoring import robustness
from clie_blocks.analysis.blind.scoring.intervals import estimate, rate
from clie_blocks.analysis.blind.scoring.score import score

PHONE = 390


def trials(count):
    """Robots of all kinds with right answers, some with a wrong one."""
    label = {"severity": "strong", "ratio": 9.0, "robot": "arm of 6", "gear_ratios": [100.0],
             "excitations": ["chirp", "steps", "other"],
             "gap": {"nominal": 4e-4, "true_model": 1e-4, "achievable_reduction": 0.75}}
    names = ("load_dependent_friction", "velocity_filter_mismatch", "encoder_eccentricity")
    labels, answers = {}, {}
    for i in range(count):
        name, named = names[i % 3], names[i % 3 if i % 5 else (i + 1) % 3]
        labels[f"{41 + i % 2}/trial-{i:03d}"] = {
            **label, "kind": "single", "labels": [name],
            "effects": [{"effect": name, "joints": [1]}]}
        answers[f"{41 + i % 2}/trial-{i:03d}"] = {
            "effects": [{"effect": named, "joint": [1], "probability": 0.95}],
            "set_90": [named], "unexplained": False, "gap_before": 4e-4, "gap_after": 1e-4,
            "seconds": 3.0}
    return answers, labels


@pytest.fixture
def page(tmp_path):
    answers, labels = trials(60)
    board = {"seeds": [41, 42], "command": "clie blind --trials 30 --seed 41 42 --baselines",
             **score(answers, labels)}
    board |= {"targets": compare_with_targets(board),
              **leave_one_out.score_left_out(answers, labels),
              "compared": [methods.method_row(name, answers, labels)
                           | {"paired": methods.paired_differences(answers, answers, labels)}
                           for name in (methods.FULL, "no sensitivity filter")],
              "controllers": robustness.score_misdescribed(answers, {
                  name: {"labels": [list(wrong_controller.MISSTATEMENTS)[i % 6]], "wrong": "x 1.1",
                         "robot": "arm of 2",
                         "present": []} for i, name in enumerate(labels)}),
              "spatial": robustness.score_misdescribed(answers, {
                  name: {"labels": [spatial_arms.LINKS_ONLY], "robot": "spatial of 3",
                         "wrong": "links hold 12% of the inertia", "present": []}
                  for name in labels}),
              "engines": [{"learned_on": "own_robots", "tested_on": "MuJoCo", "robots": 60,
                           "loss": estimate([0.1, 0.2], max), "top_1": rate([True, False]),
                           "ece": estimate([0.1, 0.2], max)}]}
    return Path(save_page(board, tmp_path)).read_text()


def test_page_has_every_section_and_needs_no_network(page):
    for title in ("Target and measured", "Calibration and gap reduction", "Confusions",
                  "By gear ratio", "Each effect removed from the library", "other methods reach",
                  "Protocol",
                  "Wrong description of the controller", "Arms that no planar chain describes",
                  "Calibrated on one engine, tested on the other", "Wrong decisions"):
        assert title in page
    assert len(page) < 2_000_000 and not re.search(r'(src|href)="(?!#|data:)', page)
    assert not re.search(r">(None|nan)\b", page)


@pytest.mark.skipif(shutil.which("chromium") is None, reason="chromium is not installed")
def test_page_fits_a_phone(page, tmp_path):
    host = tmp_path / "host.html"
    host.write_text(
        f'<!doctype html><body><iframe id="f" width="{PHONE}" height="800" style="border:0" '
        f'srcdoc="{escape(page)}"></iframe><script>onload = () => {{'
        'const root = document.getElementById("f").contentDocument.documentElement;'
        'document.body.dataset.width = root.scrollWidth;'
        'const wide = [...root.querySelectorAll(".wide")].filter('
        'box => box.scrollWidth > box.clientWidth + 1);'
        'document.body.dataset.wide = wide.length;}</script>')
    run = subprocess.run(
        ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom",
         f"--user-data-dir={tmp_path / 'profile'}", host.as_uri()],
        capture_output=True, text=True, timeout=60, check=True)
    assert 0 < int(re.search(r'data-width="(\d+)"', run.stdout)[1]) <= PHONE
    assert int(re.search(r'data-wide="(\d+)"', run.stdout)[1]) <= 2  # lists of single trials
