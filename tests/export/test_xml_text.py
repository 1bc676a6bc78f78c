"""Edits of an XML file change what they name, byte by byte nothing else."""

import pytest

from clie_blocks.analysis.export.xml_text import XmlText
from clie_blocks.errors import RecordError

TEXT = ("<a>\n  <!-- größe: <b x='1'/> -->\n"
        "  <b x = 'one'   y=\"a>b\" />\n  <c>\n    <d/>\n  </c>\n</a>\n")


def edited(edit):
    """The text after an edit of its document."""
    document = XmlText(TEXT, "a.xml")
    edit(document, {one.name: one for one in document.root.every("b", "c", "d")})
    return document.text


def test_without_edits_nothing_changes():
    assert edited(lambda document, at: None) == TEXT


def test_attributes_are_set_in_their_place_behind_the_others_or_taken_away():
    assert edited(lambda document, at: document.set(at["b"], {"x": 2.5})) == TEXT.replace(
        "'one'", '"2.5"')
    assert edited(lambda document, at: document.set(at["b"], {"z": "3"})) == TEXT.replace(
        '"a>b" />', '"a>b" z="3" />')
    assert edited(lambda document, at: document.set(at["b"], {"y": None})) == TEXT.replace(
        '   y="a>b"', "")


def test_a_value_is_escaped():
    assert 'x = "a &amp; &lt;b"' in edited(lambda document, at: document.set(
        at["b"], {"x": "a & <b"}))


def test_elements_are_renamed_and_inserted_with_the_indentation_of_their_place():
    assert "  <e x = 'one'" in edited(lambda document, at: document.rename(at["b"], "e"))
    assert "    <n/>\n    <d/>\n" in edited(
        lambda document, at: document.insert_before(at["d"], "<n/>"))
    assert "    <d/>\n    <n>\n      <m/>\n    </n>\n  </c>" in edited(
        lambda document, at: document.append(at["c"], "<n>\n  <m/>\n</n>"))


def test_an_element_gets_another_text_and_an_empty_one_content():
    assert "<d>a &lt; b</d>" in edited(lambda document, at: document.write(at["d"], "a < b"))
    assert "    <d>\n      <n/>\n    </d>\n" in edited(
        lambda document, at: document.append(at["d"], "<n/>"))
    document = XmlText("<a>\n <b>1</b> <!-- one -->\n</a>", "a.xml")
    document.write(document.root.child("b"), "2")
    assert document.root.child("b").text == "1" and document.root.child("c") is None
    assert document.text == "<a>\n <b>2</b> <!-- one -->\n</a>"


def test_what_is_broken_is_refused():
    with pytest.raises(RecordError, match=r"a.xml is no well-formed XML"):
        XmlText("<a><b></a>", "a.xml")
