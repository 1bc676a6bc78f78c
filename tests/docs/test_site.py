"""The site: it builds without a warning, its links lead somewhere, it needs no network.

One test, for the site is built once, in the folder of its sources.
"""

import importlib
import inspect
import pkgutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

ROOT = Path(__file__).resolve().parents[2]
LOADING = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src"}
PACKAGES = ("clie_blocks", "clie_blocks.analysis", "clie_blocks.analysis.gap",
            "clie_blocks.analysis.records", "clie_blocks.compiled", "clie_blocks.controllers",
            "clie_blocks.effects", "clie_blocks.robot_loop")


class Page(HTMLParser):
    """Places of a page, what it links to, and what it loads."""

    def __init__(self, path):
        super().__init__()
        self.ids, self.links, self.loaded, self.tags = set(), [], [], set()
        self.feed(path.read_text())

    def handle_starttag(self, tag, attrs):
        at = dict(attrs)
        self.tags.add(tag)
        self.ids |= {at[key] for key in ("id", "name") if at.get(key)}
        if tag == "a" and at.get("href"):
            self.links.append(at["href"])
        if at.get(LOADING.get(tag)):
            self.loaded.append(at[LOADING[tag]])


@pytest.mark.slow
def test_the_site_is_whole(tmp_path):
    pytest.importorskip("furo", reason="needs the extra clie-blocks[docs]")
    run = subprocess.run([sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "docs",
                          str(tmp_path)], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr  # a warning is an error
    pages = {path: Page(path) for path in sorted(tmp_path.rglob("*.html"))}
    check_that_no_link_and_no_anchor_is_dead(pages)
    check_that_nothing_is_loaded_from_elsewhere(tmp_path, pages)
    check_that_formulas_are_set_as_formulas(pages)
    check_that_every_public_name_is_in_the_reference(tmp_path)
    check_that_every_verb_is_in_the_reference(tmp_path)


def check_that_no_link_and_no_anchor_is_dead(pages):
    dead = []
    for path, page in pages.items():
        for link in page.links + page.loaded:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            place = unquote(parts.fragment)
            if not target.exists() or (place and target in pages
                                       and place not in pages[target].ids):
                dead.append(f"{path.name}: {link}")
    assert len(pages) > 40 and not dead


def check_that_nothing_is_loaded_from_elsewhere(site, pages):
    assert not [url for page in pages.values() for url in page.loaded if urlsplit(url).netloc]
    for style in site.rglob("*.css"):
        assert "url(http" not in style.read_text() and "@import" not in style.read_text(), style


def check_that_formulas_are_set_as_formulas(pages):
    with_formulas = {path.name for path, page in pages.items() if "math" in page.tags}
    assert {"paper.html", "how_the_diagnosis_works.html", "laws.html",
            "effects.html"} <= with_formulas
    assert not [path.name for path in pages  # the code of the course has its own
                if path.parent.name != "course" and r"\hat\Theta" in path.read_text()]


def check_that_every_public_name_is_in_the_reference(site):
    from sphinx.util.inventory import InventoryFile

    found = InventoryFile.loads((site / "objects.inv").read_bytes(), uri="")
    documented = {name for kind in found.data.values() for name in kind}
    top = importlib.import_module("clie_blocks")
    names, missing = 0, []
    for package in map(importlib.import_module, PACKAGES):
        for name in package.__all__:
            thing = getattr(package, name)
            full = thing.__name__ if inspect.ismodule(thing) else f"{package.__name__}.{name}"
            if thing is getattr(top, name, None) and not inspect.ismodule(thing):
                full = f"clie_blocks.{name}"  # described once, under its shortest name
            names += 1
            missing += [full] if full not in documented else []
    assert names > 80 and not missing
    import clie_blocks.diagrams as diagrams
    assert not {f"clie_blocks.diagrams.{module.name}" for module in pkgutil.iter_modules(
        diagrams.__path__) if not module.ispkg} - documented


def check_that_every_verb_is_in_the_reference(site):
    from clie_blocks.analysis import cli

    text = (site / "reference" / "command_line.html").read_text()
    assert not [verb for verb in cli.VERBS if f"usage: clie {verb} " not in text]
    assert "--simulated" in text and "np.float64" not in text
