"""The page on logs has the names that the reader knows."""

import importlib.util
from pathlib import Path

from clie_blocks.analysis.records.aliases import SOURCES

DOCS = Path(__file__).resolve().parents[1] / "docs"


def test_the_page_has_the_tables_of_today():
    spec = importlib.util.spec_from_file_location("log_names", DOCS / "log_names.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    text = (DOCS / "logs.md").read_text()
    assert script.page(text) == text, "run python docs/log_names.py"
    assert all(f"### [{source.title}]({source.reference})" in text
               for source in SOURCES if source.reference)
    assert all(source.reference for source in SOURCES[:-1])
