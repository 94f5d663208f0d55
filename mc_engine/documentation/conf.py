"""How Sphinx builds the site; `mc_engine.documentation.website` calls it."""

from mc_engine.runner.manifest import engine_version

project = "mc-engine"
version = release = engine_version()
html_title = "mc-engine" if release == "source" else f"mc-engine {release}"
extensions = ["myst_parser"]
html_theme = "furo"
html_static_path = ["site_style"]
html_css_files = ["columns.css"]
html_copy_source = False
html_show_copyright = False
html_show_sphinx = False
smartquotes = False  # it would make one dash of the two before an option
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3
# The signatures name types of other packages, which have their own pages elsewhere and none here.
nitpick_ignore_regex = [("py:.*", ".*")]
