"""What a report holds, whatever it is about: a verdict, then sections in the order of reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from clie_blocks.errors import visible

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GOOD, BAD, UNSURE = "good", "bad", "unsure"


@dataclass(frozen=True)
class Link:
    """A cell that leads to another page of the same folder.

    Parameters
    ----------
    text : str
        What is read.
    page : str
        File name of the page.

    """

    text: str
    page: str

    def __str__(self) -> str:
        return self.text

    def __html__(self) -> str:
        """The link, with its text as text, for the templates."""
        from html import escape
        from urllib.parse import quote

        return f'<a href="{quote(self.page)}">{escape(visible(self.text))}</a>'


@dataclass(frozen=True)
class Table:
    """A table of cells: texts, and links to other pages.

    Parameters
    ----------
    head : sequence of str
        Column heads.
    rows : sequence of sequence of str or Link
        Cells.
    caption : str
        One line above it.
    marks : sequence of str
        Per row ``'good'``, ``'bad'``, ``'unsure'`` or empty; colours its first cell.

    """

    head: Sequence[str]
    rows: Sequence[Sequence[str | Link]]
    caption: str = ""
    marks: Sequence[str] = ()

    def marked_rows(self) -> list[tuple[str, Sequence[str | Link]]]:
        """Mark and cells of each row, for the templates."""
        marks = self.marks or ("",) * len(self.rows)
        return list(zip(marks, self.rows))


@dataclass(frozen=True)
class Picture:
    """A Matplotlib figure with its caption.

    Parameters
    ----------
    stem : str
        File name without ending.
    figure : matplotlib.figure.Figure
        The figure.
    caption : str
        What to see in it; also read out to those who do not.

    """

    stem: str
    figure: Figure
    caption: str


@dataclass(frozen=True)
class Section:
    """A section: sentences and points first, then tables and pictures.

    Parameters
    ----------
    title : str
        Its heading.
    sentences : sequence of str
        Paragraphs.
    points : sequence of str
        A list after them.
    tables : sequence of Table
        Tables.
    pictures : sequence of Picture
        Pictures.
    collapsed : bool
        Show the title alone until a reader opens the section.

    """

    title: str
    sentences: Sequence[str] = ()
    points: Sequence[str] = ()
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()
    collapsed: bool = False


@dataclass(frozen=True)
class Document:
    """A report.

    Parameters
    ----------
    title : str
        Its title.
    verdict : str
        The answer, in one sentence.
    mood : {'good', 'bad', 'unsure'}
        Colour of the verdict.
    sections : sequence of Section
        The body.
    facts : sequence of (str, str)
        Name and value of the few results that a reader wants first.
    answers : sequence of (str, str)
        The questions that a reader asks first, with their answers.

    """

    title: str
    verdict: str
    mood: str
    sections: Sequence[Section]
    facts: Sequence[tuple[str, str]] = ()
    answers: Sequence[tuple[str, str]] = ()

    def pictures(self) -> list[Picture]:
        """All pictures in order."""
        return [picture for section in self.sections for picture in section.pictures]
