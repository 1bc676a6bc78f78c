"""Writes the table of recognised column names into ``docs/logs.md``, from the table of the reader.

python docs/log_names.py
"""

from pathlib import Path

from clie_blocks.analysis.records.aliases import SOURCES, Names, Source

PAGE = Path(__file__).parent / "logs.md"
BEGIN, END = "<!-- names: docs/log_names.py -->", "<!-- end of names -->"


def tables() -> str:
    """One table for each source of names."""
    return "\n\n".join(_table(source) for source in SOURCES)


def page(text: str) -> str:
    """The page with the tables of today."""
    before, _, rest = text.partition(BEGIN)
    return f"{before}{BEGIN}\n\n{tables()}\n\n{END}{rest.partition(END)[2]}"


def _table(source: Source) -> str:
    title = f"[{source.title}]({source.reference})" if source.reference else source.title
    mark = f"Only where a column has `{source.mark}` in its name.\n\n" if source.mark else ""
    rows = [_row(names) for names in source.names]
    return "\n".join([f"### {title}\n", f"{mark}| signal | columns | unit | side |",
                      "|---|---|---|---|", *rows])


def _row(names: Names) -> str:
    signal = "not read" if names.signal is None else f"`{names.signal}`"
    signal += ", if no other column is" if names.second else ""
    columns = " ".join(f"`{name}`" for name in names.written.split())
    return f"| {signal} | {columns} | {names.unit} | {names.side} |"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text()))
