"""Configuration of the site, which ``python -m sphinx -W docs out/site`` builds offline."""

import shutil
import sys
from pathlib import Path

HERE = Path(__file__).parent
NOTEBOOK = "notebooks/clie_and_the_gap.ipynb"
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
suppress_warnings = ["myst.header"]  # a notebook has its own levels


def setup(app):  # noqa: D103
    shutil.copy(HERE.parent / NOTEBOOK, HERE / "notebook.ipynb")  # pages lie in this folder
    app.connect("source-read", _link_notebook)


def _link_notebook(app, page, text):
    text[0] = text[0].replace(f"../../{NOTEBOOK}", "../notebook.ipynb")
