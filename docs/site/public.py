"""Directives that write the reference from the code: ``public`` and ``verbs``."""

import contextlib
import importlib
import inspect
import io
import pkgutil
import textwrap
from types import ModuleType
from unittest.mock import patch

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import clie_blocks
from clie_blocks.analysis import cli

WIDTH = "88"  # columns of a help text


class Public(SphinxDirective):
    """``.. public:: PACKAGE`` documents every public name of a package, each name once."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the nodes of autodoc for all names."""
        package = importlib.import_module(self.arguments[0])
        return self.parse_text_to_nodes("\n".join(
            line for name in public_names(package) for line in entry(package, name)))


def public_names(package: ModuleType) -> list[str]:
    """Return what a package exports; of one that exports nothing by name, its modules."""
    if not hasattr(package, "__all__"):
        return [module.name for module in pkgutil.iter_modules(package.__path__)
                if not module.ispkg]
    functions = [name for name in package.__all__ if not inspect.ismodule(getattr(package, name))]
    return sorted(functions, key=str.lower) + sorted(set(package.__all__) - set(functions))


def entry(package: ModuleType, name: str) -> list[str]:
    """Return the lines of reStructuredText that document one name."""
    full = f"{package.__name__}.{name}"
    thing = getattr(package, name, None) or importlib.import_module(full)
    if package is not clie_blocks and thing is getattr(clie_blocks, name, None):
        return [f"* :py:obj:`clie_blocks.{name}`", ""]
    if inspect.ismodule(thing):
        if hasattr(thing, "__path__"):
            return [f"* :doc:`{thing.__name__} <{thing.__name__}>`", ""]
        return [f".. automodule:: {thing.__name__}", "   :members:", "   :undoc-members:",
                "   :exclude-members: main", ""]
    if inspect.isclass(thing):
        return [f".. autoclass:: {full}", "   :members:", ""]
    if callable(thing) and hasattr(thing, "__name__"):
        return [f".. autofunction:: {full}", ""]
    return [f".. autodata:: {full}", "   :no-value:", ""]


class Verbs(SphinxDirective):
    """``.. verbs::`` shows the help of every verb of ``clie``, as its parser prints it."""

    def run(self) -> list[nodes.Node]:
        """Return a section for each verb."""
        lines = [line for verb, (_, text) in cli.VERBS.items() for line in (
            f"clie {verb}", "-" * (len(verb) + 5), "", text[0].upper() + text[1:] + ".", "",
            ".. code-block:: text", "", *textwrap.indent(help_of(verb), "   ").splitlines(), "")]
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def help_of(verb: str) -> str:
    """Return what ``clie VERB --help`` prints."""
    shown = io.StringIO()
    with patch.dict("os.environ", COLUMNS=WIDTH), contextlib.redirect_stdout(shown), \
            contextlib.suppress(SystemExit):
        cli.main([verb, "--help"])
    return shown.getvalue()


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directives."""
    app.add_directive("public", Public)
    app.add_directive("verbs", Verbs)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
