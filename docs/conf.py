"""Configuration of the site, which ``python -m sphinx -W docs out/site`` builds offline."""

import shutil
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "site"))

import clie_blocks  # noqa: E402

project, author = "clie_blocks", "clie_blocks developers"
release = version = clie_blocks.__version__
copyright = author  # noqa: A001  the name that Sphinx reads

extensions = ["myst_nb", "sphinx.ext.autodoc", "numpydoc", "mathml", "public", "breaks"]
exclude_patterns = ["blind/*.json", "site"]
root_doc = "index"

html_theme = "furo"
html_title = "clie_blocks"
html_static_path = ["site/static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False
html_last_updated_fmt = None
html_theme_options = {"top_of_page_buttons": []}
html_domain_indices = False

myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = {"math"}  # as GitHub has it
myst_heading_anchors = 4
myst_links_external_new_tab = False
nb_execution_mode = "off"  # the notebook is committed with its outputs
nb_ipywidgets_js: dict = {}  # else from a server

default_role = "py:obj"
add_module_names = False
autodoc_typehints = "none"  # numpydoc sections state types, shapes and units
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False
# a notebook has its own levels, and lines that are no Python
suppress_warnings = ["myst.header", "misc.highlighting_failure"]


def setup(app):  # noqa: D103
    course = HERE / "course"  # pages lie below this folder
    shutil.rmtree(course, ignore_errors=True)
    shutil.copytree(HERE.parent / "notebooks", course, ignore=shutil.ignore_patterns("*.py", ".*"))
    app.connect("source-read", _link_course)


def _link_course(app, page, text):
    if page.startswith("course/"):
        text[0] = text[0].replace("../docs/", "../")
    else:
        text[0] = text[0].replace("../../notebooks/", "../course/")
