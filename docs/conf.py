"""The documentation site: Sphinx reads docs/, notebooks/ and a few pages at the top, offline.

make docs            (or: python -m sphinx -c docs -W . build/site)
"""

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import generated

ROOT = Path(__file__).parents[1]

project = "loomopt"
author = "the authors of loomopt"
smartquotes = False  # what is written in scenes has straight ones
root_doc = "docs/index"
extensions = ["myst_nb", "generated"]
include_patterns = ["docs/**", "notebooks/*.ipynb", "notebooks/README.md", "benchmarks/README.md", "C*.md"]
exclude_patterns = [".*", "build", "dist", "loomopt", "problems", "results", "tests"]

html_theme = "pydata_sphinx_theme"
html_title = "loomopt"
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_extra_path = ["start"]
html_copy_source = False
html_show_sourcelink = False
html_show_search_summary = False  # a summary is fetched, which no browser does from the file system
html_math_renderer = "mathml"
html_theme_options = {
    "logo": {"text": "loomopt"},
    "header_links_before_dropdown": 6,
    "navigation_with_keys": False,
    "show_prev_next": True,
    "use_edit_page_button": False,
    "footer_start": [],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
}
html_sidebars = {"docs/index": [], "docs/hard-cases": []}

myst_enable_extensions = ["dollarmath", "deflist", "attrs_block", "attrs_inline"]
myst_heading_anchors = 4
myst_update_mathjax = False
myst_links_external_new_tab = False

nb_execution_mode = "cache"
nb_execution_cache_path = str(ROOT / "build" / "executed" / f"pages-{generated.run.program()[:16]}")
nb_execution_excludepatterns = ["*.ipynb"]  # these are run as notebooks/run.py runs them: see generated.py
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_execution_in_temp = True
nb_merge_streams = True
nb_output_stderr = "remove-warn"  # an error of the build
os.environ["PYTHONPATH"] = os.pathsep.join(str(ROOT / name) for name in (".", "tests"))
nb_ipywidgets_js = {}  # or each page would ask for it elsewhere
