"""The README is true: its links lead somewhere, its commands exist."""

import re
from pathlib import Path

from clie_blocks.analysis import cli

ROOT = Path(__file__).resolve().parents[1]
TEXT = (ROOT / "README.md").read_text()


def test_links_lead_to_files():
    links = re.findall(r"\]\((?!http)([^)#]+)", TEXT)
    assert links
    assert not [link for link in links if not (ROOT / link).exists()]


def test_every_verb_is_a_verb():
    named = set(re.findall(r"\bclie ([a-z]+)\b", TEXT)) - {"blocks"}
    assert named <= set(cli.VERBS)


def test_every_script_exists():
    scripts = re.findall(r"python ([a-z_]+/[a-z_/]+\.py)", TEXT)
    assert scripts
    assert not [script for script in scripts if not (ROOT / script).is_file()]
