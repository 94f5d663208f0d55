"""Reports of a run: one self-contained HTML page and one typeset PDF with the same contents."""

from reports.cli import report, write_reports
from reports.contents import build
from reports.html import render_html
from reports.pdf import render_pdf

__all__ = ["build", "render_html", "render_pdf", "report", "write_reports"]
