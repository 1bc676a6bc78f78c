"""A document as one self-contained HTML file and as Markdown with its pictures as files."""

from __future__ import annotations

import io
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from clie_blocks.analysis.report.document import Document, Picture
from clie_blocks.errors import visible
from clie_blocks.output import description, write

if TYPE_CHECKING:
    from jinja2 import Template

TEMPLATES = Path(__file__).parent
KEPT = "\n\u2060"  # line ends, and the word joiner that keeps a range on one line


def save_document(document: Document, folder: str | os.PathLike[str], stem: str) -> list[str]:
    """Write ``STEM.html``, ``STEM.md`` and its pictures as SVG; return the paths."""
    drawn = drawings(document)
    texts = {f"{stem}.html": html(document, drawn), f"{stem}.md": markdown(document),
             **{f"{name}.svg": drawing for name, drawing in drawn.items()}}
    return [str(write(Path(folder) / name, text)) for name, text in texts.items()]


def drawings(document: Document) -> dict[str, str]:
    """Pictures of a document as SVG elements by stem."""
    return {picture.stem: svg(picture) for picture in document.pictures()}


def html(document: Document, drawn: Mapping[str, str]) -> str:
    """A document with its `drawings` as one HTML page: no script, no network, pictures inside."""
    from markupsafe import Markup

    return _template("document.html.j2").render(
        document=document, style=Markup((TEMPLATES / "style.css").read_text()),
        drawings={stem: Markup(drawing) for stem, drawing in drawn.items()})


def markdown(document: Document) -> str:
    """A document as Markdown that shows ``STEM.svg`` for each picture."""
    text = _template("document.md.j2").render(document=document)
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def svg(picture: Picture) -> str:
    """A picture as an inline SVG element that scales with the page."""
    import matplotlib

    buffer = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": picture.stem}):
        picture.figure.savefig(buffer, format="svg", metadata={"Date": None})
    text = buffer.getvalue().decode()
    body = text[text.index("<svg"):]
    opening, rest = body.split(">", 1)
    opening = re.sub(r'\s(width|height)="[^"]*"', "", opening)
    rest = re.sub(r"<metadata>.*?</metadata>", "", rest, flags=re.DOTALL)
    prefix = f"{picture.stem}-"  # ids are global to a page
    rest = re.sub(r'\bid="([^"]+)"', rf'id="{prefix}\1"', rest)
    rest = re.sub(r'(url\(|href=")#', rf"\1#{prefix}", rest)
    said = _attribute(f"{picture.caption} {description(picture.figure)}".strip())
    return f'{opening} role="img" aria-label="{said}">{rest}'


def _attribute(text: str) -> str:
    from markupsafe import escape

    return str(escape(visible(text)))


def _template(name: str) -> Template:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES), undefined=jinja2.StrictUndefined,
        finalize=lambda value: visible(value, keep=KEPT) if type(value) is str else value,
        autoescape=".html" in name, trim_blocks=True, lstrip_blocks=True)
    environment.filters["plain"] = lambda text: str(text).replace("<", "&lt;")
    environment.filters["cell"] = lambda text: (
        str(text).replace("<", "&lt;").replace("|", "\\|").replace("\n", " "))
    return environment.get_template(name)
