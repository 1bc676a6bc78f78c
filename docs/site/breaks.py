"""Places where a browser may break a long name in code: after an underscore or a slash."""

import re
from typing import Any

from sphinx.application import Sphinx

NAME = re.compile(r'(<span class="pre">)(.*?)(</span>)')


def break_names(app: Sphinx, page: str, template: str, context: dict[str, Any],
                tree: object) -> None:
    """Add the places to the code of a page."""
    if "body" in context:
        context["body"] = NAME.sub(
            lambda name: name[1] + re.sub(r"(?<=[^<][_/])(?=\w)", "<wbr>", name[2]) + name[3],
            context["body"])


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the change of a page."""
    app.connect("html-page-context", break_names)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
