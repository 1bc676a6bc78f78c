"""What a report holds, whatever it is about: a verdict, then sections in the order of reading."""

from dataclasses import dataclass, field

GOOD, BAD, UNSURE = "good", "bad", "unsure"


@dataclass(frozen=True)
class Table:
    """A table of text cells.

    Parameters
    ----------
    head : sequence of str
        Column heads.
    rows : sequence of sequence of str
        Cells.
    caption : str
        One line above it.
    marks : sequence of str
        Per row ``'good'``, ``'bad'``, ``'unsure'`` or empty; colours its first cell.

    """

    head: tuple
    rows: tuple
    caption: str = ""
    marks: tuple = ()

    def marked_rows(self):
        """Return (mark, cells) pairs."""
        marks = self.marks or ("",) * len(self.rows)
        return list(zip(marks, self.rows))


@dataclass(frozen=True)
class Picture:
    """A Matplotlib figure with its place in the report.

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
    figure: object
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
    sentences: tuple = ()
    points: tuple = ()
    tables: tuple = ()
    pictures: tuple = ()
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
        What follows.
    facts : sequence of (str, str)
        Name and value of the few numbers that a reader wants first.

    """

    title: str
    verdict: str
    mood: str
    sections: tuple
    facts: tuple = field(default=())

    def pictures(self):
        """Return all pictures in order."""
        return [picture for section in self.sections for picture in section.pictures]
