"""A document as one self-contained HTML file and as Markdown with its pictures beside it."""

import io
import re
from pathlib import Path

from clie_blocks.output import write

TEMPLATES = Path(__file__).parent


def save_document(document, folder, stem):
    """Write a document as HTML and Markdown, and its pictures as SVG for the Markdown.

    Parameters
    ----------
    document : Document
        The report.
    folder : path-like
        Where to.
    stem : str
        File name without ending.

    Returns
    -------
    list of str
        The paths, the HTML first.

    """
    folder, drawn = Path(folder), drawings(document)
    texts = {f"{stem}.html": html(document, drawn), f"{stem}.md": markdown(document),
             **{f"{name}.svg": drawing for name, drawing in drawn.items()}}
    return [str(write(folder / name, text)) for name, text in texts.items()]


def drawings(document):
    """Return the pictures of a document as SVG elements by stem.

    Parameters
    ----------
    document : Document
        The report.

    """
    return {picture.stem: svg(picture) for picture in document.pictures()}


def html(document, drawn):
    """Return a document as one HTML page: no script, no network, pictures inside.

    Parameters
    ----------
    document : Document
        The report.
    drawn : dict
        Its `drawings`.

    """
    from markupsafe import Markup

    return _template("document.html.j2").render(
        document=document, style=Markup((TEMPLATES / "style.css").read_text()),
        drawings={stem: Markup(drawing) for stem, drawing in drawn.items()})


def markdown(document):
    """Return a document as Markdown that shows ``STEM.svg`` for each picture.

    Parameters
    ----------
    document : Document
        The report.

    """
    text = _template("document.md.j2").render(document=document)
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def svg(picture):
    """Return a picture as an inline SVG element that scales with the page.

    Parameters
    ----------
    picture : Picture
        The picture.

    """
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
    return f'{opening} role="img" aria-label="{_attribute(picture.caption)}">{rest}'


def _attribute(text):
    from markupsafe import escape

    return str(escape(text))


def _template(name):
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES), undefined=jinja2.StrictUndefined,
        autoescape=".html" in name, trim_blocks=True, lstrip_blocks=True)
    environment.filters["plain"] = lambda text: str(text).replace("<", "&lt;")
    environment.filters["cell"] = lambda text: (
        str(text).replace("<", "&lt;").replace("|", "\\|").replace("\n", " "))
    return environment.get_template(name)
