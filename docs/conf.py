"""The documentation site: Sphinx with MyST, all Markdown documents from the root of the repository. tools/site builds it."""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parent.parent

project = "Loopbench"
author = "The Loopbench authors"
release = re.search(r"loopbench VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1]
extensions = ["myst_parser", "breathe"]
breathe_projects = {"loopbench": str(ROOT / "build/site-api/xml")}
breathe_default_project = "loopbench"
breathe_show_include = False
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
root_doc = "docs/index"
include_patterns = ["*.md", "docs/**", "results/**/*.md", "*/README.md", "configs/**/*.md", "tests/*/README.md"]
# tables of results with thousands of rows: their CSV files are easier to read
exclude_patterns = ["build", "results/runs", "results/*/full", "results/extremes/robustness-map.md"]
suppress_warnings = ["myst.header"]  # tables that commands write begin with a heading of level 2
html_theme = "furo"
# KaTeX from libjs-katex typesets equations, so that pages load nothing from other sites
html_static_path = ["/usr/share/javascript/katex"]
html_css_files = ["katex.min.css"]
html_js_files = ["katex.min.js", (None, {
    "body": "addEventListener('DOMContentLoaded', () => window.renderMathInElement?.(document.body))"})]
mathjax_path = "contrib/auto-render.js"  # loaded by pages with equations
mathjax_options = {"defer": "defer"}
html_title = f"Loopbench {release}"


def no_contents_entry(app, doctree):
    """Lets documents be pages without an entry in the table of contents, such as tables of results."""
    app.env.metadata[app.env.docname]["orphan"] = True


def setup(app):
    app.connect("doctree-read", no_contents_entry)
