"""Edits of an XML file that leave everything else as it stands: comments, order, spaces."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Mapping
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr

from clie_blocks.errors import RecordError


@dataclasses.dataclass(eq=False)
class Element:
    """One element and where its text lies: ``[start, head)`` is its start tag."""

    name: str
    attributes: dict[str, str]
    parent: Element | None
    start: int
    head: int = 0
    end: int = 0
    children: list[Element] = dataclasses.field(default_factory=list)
    text: str = ""

    def child(self, name: str) -> Element | None:
        """Return the first element right below that has a name."""
        return next((one for one in self.children if one.name == name), None)

    def every(self, *names: str) -> Iterator[Element]:
        """Yield the elements below that have one of some names, in the order of the file."""
        for child in self.children:
            if child.name in names:
                yield child
            yield from child.every(*names)


class XmlText:
    """An XML file as text with elements that can be edited; `text` applies all edits at once.

    Parameters
    ----------
    text : str
        Content of the file.
    source : str
        What to call it in a message.

    Raises
    ------
    RecordError
        If it is no well-formed XML.

    """

    def __init__(self, text: str, source: str) -> None:
        self._data = text.encode()
        self._edits: list[tuple[int, int, str]] = []
        self._changed: dict[Element, dict[str, str | None]] = {}
        self._renamed: dict[Element, str] = {}
        self.root = _parse(self._data, source)

    def set(self, element: Element, attributes: Mapping[str, str | float | None]) -> None:
        """Set attributes of an element; None takes one away."""
        shown = {key: _shown(value) for key, value in attributes.items()}
        self._changed.setdefault(element, {}).update(shown)

    def line(self, element: Element) -> int:
        """Return the line of the original text in which an element begins, from 1."""
        return self._data.count(b"\n", 0, element.start) + 1

    def rename(self, element: Element, name: str) -> None:
        """Give an element another name; it must be empty (``<motor .../>``)."""
        self._renamed[element] = name

    def insert_before(self, element: Element, text: str) -> None:
        """Insert lines in front of an element, with its indentation."""
        indent = self._indent(element.start)
        body = "".join(f"{line}\n{indent}" for line in text.splitlines())
        self._edits.append((element.start, element.start, body))

    def write(self, element: Element, text: str) -> None:
        """Give an element another text; it must hold no other element."""
        if element.end == element.head:
            self._close(element, escape(text))
        else:
            closing = self._data.rindex(b"</", 0, element.end)
            self._edits.append((element.head, closing, escape(text)))

    def append(self, element: Element, text: str) -> None:
        """Insert lines at the end of an element."""
        if element.end == element.head:
            indent = self._indent(element.start)
            inside = "".join(f"\n{indent}  {one}" for one in text.splitlines())
            self._close(element, f"{inside}\n{indent}")
            return
        closing = self._data.rindex(b"</", 0, element.end)
        line = self._data.rfind(b"\n", 0, closing) + 1
        indent = self._indent(closing)
        lines = "".join(f"{indent}  {one}\n" for one in text.splitlines())
        if self._data[line:closing].strip():
            line, lines = closing, f"\n{lines}{indent}"
        self._edits.append((line, line, lines))

    def _close(self, element: Element, inside: str) -> None:
        """Open an element without content (``<a/>``), fill it and close it."""
        tag = self._data[element.start:element.head - 2].decode().rstrip()
        self._edits.append((element.start, element.end, f"{tag}>{inside}</{element.name}>"))

    @property
    def text(self) -> str:
        """The file with all edits."""
        edits = [*self._edits, *(self._of_tag(element) for element in
                                 dict.fromkeys([*self._changed, *self._renamed]))]
        data, last, parts = self._data, 0, []
        for start, end, text in sorted(edits, key=lambda edit: edit[:2]):
            parts += [data[last:start], text.encode()]
            last = end
        return b"".join([*parts, data[last:]]).decode()

    def _of_tag(self, element: Element) -> tuple[int, int, str]:
        tag = self._data[element.start:element.head].decode()
        if element in self._renamed:
            tag = f"<{self._renamed[element]}{tag[1 + len(element.name):]}"
        for key, value in self._changed.get(element, {}).items():
            tag = _with_attribute(tag, key, value)
        return element.start, element.head, tag

    def _indent(self, at: int) -> str:
        line = self._data[self._data.rfind(b"\n", 0, at) + 1:at].decode()
        return line[:len(line) - len(line.lstrip())]


def _with_attribute(tag: str, key: str, value: str | None) -> str:
    """Start tag with an attribute set, in its place, or behind the others."""
    found = re.search(rf"\s+{re.escape(key)}\s*=\s*(\"[^\"]*\"|'[^']*')", tag)
    if value is None:
        return tag if found is None else tag[:found.start()] + tag[found.end():]
    if found is not None:
        return tag[:found.start(1)] + quoteattr(value) + tag[found.end(1):]
    end = len(tag) - (2 if tag.endswith("/>") else 1)
    body = tag[:end].rstrip()
    return f"{body} {key}={quoteattr(value)}{tag[len(body):]}"


def _shown(value: str | float | None) -> str | None:
    return value if value is None or isinstance(value, str) else f"{value:.9g}"


def _parse(data: bytes, source: str) -> Element:
    parser = expat.ParserCreate()
    top = Element("", {}, None, 0)
    stack = [top]

    def begin(name: str, attributes: dict[str, str]) -> None:
        at = parser.CurrentByteIndex
        element = Element(name, attributes, stack[-1], at, _end_of_tag(data, at))
        stack[-1].children.append(element)
        stack.append(element)

    def finish(name: str) -> None:
        element, at = stack.pop(), parser.CurrentByteIndex
        empty = data[element.head - 2:element.head] == b"/>"
        element.end = element.head if empty else data.index(b">", at) + 1

    def read(text: str) -> None:
        stack[-1].text += text

    parser.StartElementHandler, parser.EndElementHandler = begin, finish
    parser.CharacterDataHandler = read
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise RecordError(f"{source} is no well-formed XML ({error}); load it in the simulator, "
                          "which says where it is broken") from None
    return top.children[0]


def _end_of_tag(data: bytes, at: int) -> int:
    """Where a start tag ends; a ``>`` may stand in an attribute."""
    found = re.compile(rb"<(?:[^>\"']|\"[^\"]*\"|'[^']*')*>").match(data, at)
    assert found is not None  # the parser has read it
    return found.end()
