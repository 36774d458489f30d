"""The documentation site: `python -m sphinx -W --keep-going -b html docs build/site`.

Sources are the pages of this folder, the docstrings of the public names, and the notebooks (shown as they are stored,
not run). Everything a page needs is in the site: formulas are drawn into it at build time, and no page asks the
network.
"""

import sys
from importlib.metadata import version as installed_version
from pathlib import Path

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
sys.path[:0] = [str(ROOT), str(DOCS / "extensions")]

project = "floatframe"
author = "the developers of floatframe"
copyright = author
try:
    release = installed_version("floatframe")
except Exception:  # a checkout that is not installed
    release = "unreleased"
version = release

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.viewcode",
    "numpydoc",
    "myst_nb",
    "sphinx_design",
    "sphinx_copybutton",
    "drawn_math",
    "public_names",
    "plain_text",
    "copied_pages",
    "reference_pages",
    "offline",
]
exclude_patterns = ["extensions", "gallery/*", "**.ipynb_checkpoints"]
source_suffix = {".md": "myst-nb", ".ipynb": "myst-nb", ".rst": "restructuredtext"}

# pages
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist", "attrs_block"]
myst_dmath_double_inline = True
myst_heading_anchors = 3
nb_execution_mode = "off"

# docstrings
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autosummary_generate = False
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False
add_module_names = False
smartquotes = False  # u' is a derivative
python_use_unqualified_type_names = True

# the look
html_theme = "pydata_sphinx_theme"
html_title = "floatframe"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_sidebars = {"index": [], "gallery": [], "api/*": ["sidebar-nav-bs"]}
html_theme_options = {
    "show_toc_level": 2,
    "navigation_depth": 3,
    "header_links_before_dropdown": 7,
    "navbar_align": "left",
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "show_prev_next": True,
    "back_to_top_button": True,
    "pygments_light_style": "tango",
    "pygments_dark_style": "github-dark",
}
