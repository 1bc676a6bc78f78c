"""Reports: everything escaped, nothing from the network, one file."""

import re
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import pytest
from matplotlib.figure import Figure

from clie_blocks.analysis.report.document import Document, Picture, Section, Table
from clie_blocks.analysis.report.render import drawings, html, markdown, save_document

NASTY = "<script>alert('x')</script> & \"q\""


class Ids(HTMLParser):
    """Collects ids and references of a page."""

    def __init__(self):
        super().__init__()
        self.ids, self.references, self.tags = [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        for key, value in attrs:
            if key == "id":
                self.ids.append(value)
            if key in ("href", "xlink:href") and value.startswith("#"):
                self.references.append(value[1:])
            self.references += re.findall(r"url\(#([^)]+)\)", value or "")


@pytest.fixture
def document():
    pictures = []
    for stem in ("first", "second"):
        figure = Figure(figsize=(3, 2))
        figure.subplots().plot([0, 1], [1, 0])
        pictures.append(Picture(stem, figure, f"caption {NASTY}"))
    table = Table((f"head {NASTY}", "b"), ((NASTY, "a | b"), ("plain", "2")), "caption",
                  ("bad", ""))
    return Document(f"title {NASTY}", "verdict", "bad",
                    (Section("one", (NASTY,), ("point",), (table,), tuple(pictures)),),
                    (("fact", "1"),))


def test_text_is_escaped(document):
    page = html(document, drawings(document))
    assert "<script" not in page and page.count("&lt;script&gt;") >= 5


def test_page_needs_no_network_and_forbids_it(document):
    page = html(document, drawings(document))
    assert "default-src 'none'" in page
    fetched = re.findall(r'(?:src|href)="(?!#)([^"]*)"', page)
    assert fetched == []


def test_ids_are_unique_and_every_reference_has_its_target(document):
    reader = Ids()
    reader.feed(html(document, drawings(document)))
    assert len(reader.ids) == len(set(reader.ids))
    assert set(reader.references) <= set(reader.ids)
    assert reader.tags.count("svg") == 2


def test_markdown_keeps_the_table_in_one_piece(document):
    text = markdown(document)
    lines = text.splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("|---"))
    assert lines[start + 1].startswith("| &lt;script>") and r"a \| b" in lines[start + 1]
    assert lines[start + 2].startswith("| plain")
    assert "![caption" in text and "(first.svg)" in text


def test_saved_files_are_the_same_twice(document, tmp_path):
    def saved():
        return {Path(path).name: Path(path).read_bytes()
                for path in save_document(document, tmp_path, "r")}

    first = saved()
    assert set(first) == {"r.html", "r.md", "first.svg", "second.svg"}
    assert ElementTree.fromstring(first["first.svg"]).tag == "{http://www.w3.org/2000/svg}svg"
    assert saved() == first
