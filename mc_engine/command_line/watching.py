"""`mc-engine run --watch`: flies a campaign again on every saved change, and updates a page with its report.

Each flight is a separate process, so that an error in a model ends only that flight.  The page is a file, which the
browser can open without a server: it shows the latest report, and reads a small file next to it every second for
changes.
"""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import datetime
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import typer

from mc_engine.campaign.search import campaign_name, campaign_section, find_campaign
from mc_engine.command_line.app import USAGE, leave, refuse_unwritable_folder, write_reports
from mc_engine.durable_file import make_folder, write_durably
from mc_engine.interruption import advise, unsignalled_children
from mc_engine.store.run_files import JOURNAL, stem_of

CASES = 200  # of each flight, unless told otherwise
_NOTE = re.compile(r"preparing; |[0-9,]+ (further cases are flown|of [0-9,]+ cases)")  # on how far a flight is
_LOOK_EVERY_S = 0.3
_PATIENCE_S = 5.0  # for a flight that is no longer wanted to end
_MOST_FILES = 2000  # that are looked at
_OF_A_KEPT_RUN = ("--shard", "--publish", "--until", "--judge", "--max-failed", "--no-report")
_PAGE, _REPORT, _STATE = "watch.html", "report.html", "state.js"
_HTML = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<title>{title}, watched</title>
<style>
  body {{ margin: 0; font: 15px/1.5 system-ui, sans-serif; display: flex; flex-direction: column; height: 100vh; }}
  #line {{ padding: 0.3em 1em; color: #555; }}
  #mistake {{ margin: 0; padding: 0.7em 1em; background: #fbe3d6; white-space: pre-wrap; }}
  iframe {{ border: 0; flex: 1; }}
</style>
<div id="line">the first cases are being flown</div>
<pre id="mistake" hidden></pre>
<iframe id="report" title="report"></iframe>
<script>
  let shown = -1, report = -1;
  const element = (id) => document.getElementById(id);
  function state(now) {{
    if (now.number === shown) return;
    shown = now.number;
    element("line").textContent = now.line;
    element("mistake").textContent = now.mistake;
    element("mistake").hidden = !now.mistake;
    if (now.report !== report) {{
      report = now.report;
      element("report").src = "{report}?" + report;
    }}
  }}
  function look() {{
    const script = document.createElement("script");
    script.src = "{state}?" + Date.now();
    script.onload = script.onerror = () => {{ script.remove(); setTimeout(look, 1000); }};
    document.head.append(script);
  }}
  look();
</script>
</html>
"""


def watch_campaign(reference: str, folder: Path | None, context: typer.Context) -> None:
    """Fly the campaign, and again whenever one of its files is saved, until interrupted.

    folder : of the page; by default runs/<campaign>-watch.
    context : of the command, whose other options are those of each flight.
    CampaignError if there is no such campaign.
    """
    options = {"--cases": str(CASES), **_options_given(context)}
    if unfit := [option for option in options if option in _OF_A_KEPT_RUN]:
        leave(USAGE, f"{unfit[0]}: is not for --watch, which keeps no run")
    from mc_engine.runner.backends import Backend

    if "--backend" in options:  # one that this machine lacks is refused now, not at every saved change
        Backend(options["--backend"], options.get("--scheduler"))
    file = find_campaign(reference)
    name = campaign_name(file)
    arguments = [reference, *(word for option in options.items() for word in option)]
    if folder is not None:
        refuse_unwritable_folder(folder)
    page = _Page(folder or Path("runs", f"{stem_of(name)}-watch"), name)
    advise(lambda: f"no longer watched; the latest results stay in {page.path}")
    typer.echo(f"page         {page.path}")
    typer.echo(f"watching     {file} and the files beside it and its model; Ctrl-C ends it")
    seen: dict[Path, tuple[int, ...]] = {}
    while True:
        while seen == (now := _stamps(file)):
            time.sleep(_LOOK_EVERY_S)
        seen = now
        _fly_once(file, arguments, page, seen)


def _options_given(context: typer.Context) -> dict[str, str]:
    """The options of the command that differ from their defaults, without those of watching itself."""
    given = {param.opts[0]: (context.params[str(param.name)], param.default) for param in context.command.params}
    own = ("file", "--watch", "--out")
    return {name: str(value) for name, (value, usual) in given.items() if value != usual and name not in own}


def _fly_once(file: Path, arguments: Sequence[str], page: "_Page", seen: dict[Path, tuple[int, ...]]) -> None:
    """Fly once and show the result; given up if a file is saved before the flight has ended."""
    begun = time.monotonic()
    with TemporaryDirectory(prefix="mc-engine-watch-") as place:
        run = Path(place) / "run"
        command = [sys.executable, "-m", "mc_engine", "run", *arguments, "--out", str(run), "--no-report"]
        with unsignalled_children():  # Ctrl-C ends this process, which then ends the flight
            flight = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            ended = _outcome(flight, file, seen)
        finally:
            _end(flight)
        if ended is None:
            return
        told, complaint = ended
        clock = f"{datetime.now():%H:%M:%S}"
        if flight.returncode != 0:
            page.complain(f"{clock}, not flown", complaint)
            typer.echo(f"{clock}     {complaint}", err=True)
            return
        flown = f"flown in {time.monotonic() - begun:.1f} s"
        lines = [line for line in told.splitlines() if not line.startswith("run ")]
        typer.echo("\n".join([f"{clock}     {flown}", *lines]))
        page.show(run, f"{clock}, {flown}")


def _outcome(flight: "subprocess.Popen[str]", file: Path, seen: dict[Path, tuple[int, ...]]) -> tuple[str, str] | None:
    """What a flight wrote to its outputs, without its notes on progress; None if a file was saved meanwhile."""
    while True:
        with suppress(subprocess.TimeoutExpired):
            out, error = flight.communicate(timeout=_LOOK_EVERY_S)
            return out, "\n".join(line for line in error.splitlines() if not _NOTE.match(line)).strip()
        if _stamps(file) != seen:
            return None


def _end(flight: "subprocess.Popen[str]") -> None:
    if flight.poll() is None:
        flight.terminate()
        try:
            flight.communicate(timeout=_PATIENCE_S)
        except subprocess.TimeoutExpired:
            flight.kill()
            flight.communicate()


def _stamps(file: Path) -> dict[Path, tuple[int, ...]]:
    """Times of the last change [ns], size and number of every file on which the results may depend, by path.

    A copy that keeps its time, and a link to another file, change the other time or the number.
    """
    stamps: dict[Path, tuple[int, ...]] = {}
    for folder in _folders(file):
        for path in _files_in(folder):
            with suppress(OSError):  # removed since it was listed
                facts = path.stat()
                stamps[path] = facts.st_mtime_ns, facts.st_ctime_ns, facts.st_size, facts.st_ino
            if len(stamps) >= _MOST_FILES:
                return stamps
    return stamps


def _folders(file: Path) -> list[Path]:
    """The folder of the campaign file, and that of the model if it is another one."""
    home = file.absolute().parent
    model = campaign_section(file).get("model")
    if not isinstance(model, str):
        return [home]
    if model.endswith(".py"):
        other = (home / model).resolve().parent
    else:
        places = (Path(root) / model.replace(".", "/") for root in [str(home), *sys.path])
        other = next((place for place in places if place.is_dir()), home)
    return [home] if other.is_relative_to(home) else [home, other]


def _files_in(folder: Path) -> Iterator[Path]:
    """The files of a folder and of those in it, except hidden ones, caches, and directories of results."""
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if name[0] not in "._" and not _holds_results(Path(place, name)))
        yield from (Path(place, name) for name in sorted(names) if name[0] != "." and not name.endswith((".pyc", "~")))


def _holds_results(folder: Path) -> bool:
    return (folder / JOURNAL).exists() or (folder / _STATE).exists()


class _Page:
    """The page that is redrawn, in a folder of its own.  path : what a browser opens."""

    def __init__(self, folder: Path, name: str):
        self.path = folder / _PAGE
        self._folder, self._number, self._report = folder, 0, -1
        make_folder(folder)
        write_durably(self.path, _HTML.format(title=escape(name), report=_REPORT, state=_STATE).encode())
        (folder / _REPORT).unlink(missing_ok=True)
        self._say("the first cases are being flown", "")

    def show(self, run: Path, line: str) -> None:
        """Show the report of a run."""
        (made,) = write_reports(run, ("html",))
        write_durably(self._folder / _REPORT, made.read_bytes())
        self._report = self._number
        self._say(line, "")

    def complain(self, line: str, mistake: str) -> None:
        """Show an error above the latest report, which is that of the last successful flight."""
        before = "; below, the results before the mistake" if self._report >= 0 else ""
        self._say(f"{line}{before}", mistake)

    def _say(self, line: str, mistake: str) -> None:
        now = {"number": self._number, "line": line, "mistake": mistake, "report": self._report}
        write_durably(self._folder / _STATE, f"state({json.dumps(now)});\n".encode())
        self._number += 1
