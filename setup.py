"""The description of the package on PyPI, where links relative to the README lead nowhere.

Everything else is in pyproject.toml.
"""

import re
import tomllib
from pathlib import Path

from setuptools import setup

HERE = Path(__file__).parent
LINK = re.compile(r"(!?)\[([^\]]*)\]\((?![a-z]+:|#)([^)\s]+)\)")  # to a file of the project


def description(readme: str, source: str | None) -> str:
    """README with links to the source, as GitHub has them, or without links where it has none."""
    def link(match: re.Match[str]) -> str:
        image, text, path = match.groups()
        if source is None:
            return f"*{text}.*" if image else text
        return f"{image}[{text}]({source.rstrip('/')}/{'raw' if image else 'blob'}/HEAD/{path})"

    return LINK.sub(link, readme)


if __name__ == "__main__":
    project = tomllib.loads((HERE / "pyproject.toml").read_text())["project"]
    setup(long_description=description((HERE / "README.md").read_text(),
                                       project.get("urls", {}).get("Source")),
          long_description_content_type="text/markdown")
