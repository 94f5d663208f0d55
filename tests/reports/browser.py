"""A headless Chromium for tests: opens a file, runs scripts in it, and keeps what it logs and asks of the network.

Speaks the DevTools protocol over a pair of pipes (--remote-debugging-pipe): JSON messages, each ended by a zero byte.
"""

import json
import os
import select
import shutil
import subprocess
import time
from contextlib import contextmanager
from dataclasses import dataclass, field

SWITCHES = [
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-quic", "--disable-dev-shm-usage",
    "--window-size=1280,900", "--remote-debugging-pipe",
]  # fmt: skip
PATIENCE_S = 60.0
LOCAL = ("file:", "data:", "blob:", "about:")
INSTALLED = shutil.which("chromium") is not None


@dataclass
class Page:
    """One page.  logged : errors and warnings of its console; requests : what it asked of a network."""

    to_browser: int
    from_browser: int
    session: str = ""
    logged: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)
    _number: int = 0
    _unread: bytes = b""
    _loaded: bool = False

    def ask(self, method, **params):
        """The answer to one command."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.to_browser, json.dumps(message).encode() + b"\0")
        while True:
            found = self._read()
            if found.get("id") == self._number:
                assert "error" not in found, found
                return found["result"]

    def run(self, script):
        """The value of a script, which may be a promise."""
        done = self.ask("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in done, done["exceptionDetails"]
        return done["result"].get("value")

    def open(self, file):
        """Load a file and wait until it stands."""
        self._loaded = False
        self.ask("Page.navigate", url=file.as_uri())
        while not self._loaded:
            self._read()
        self.painted()

    def painted(self):
        """Wait until what was scrolled or changed is on the screen: the mouse meets what is painted."""
        self.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 0))))")

    def until(self, script):
        """Wait until a script is true."""
        end = time.monotonic() + PATIENCE_S
        while not self.run(script):
            assert time.monotonic() < end, f"never true: {script}"
            time.sleep(0.02)

    def settled(self, script):
        """The value of a script that scrolls, once it stays the same: sections grow as they come in sight."""
        end = time.monotonic() + PATIENCE_S
        before, now = None, (self.run(script), self.run("window.scrollY"))
        while now != before:
            assert time.monotonic() < end, f"never the same twice: {script}"
            self.painted()
            before, now = now, (self.run(script), self.run("window.scrollY"))
        return now[0]

    def click(self, selector):
        """A real click in the middle of an element."""
        x, y = self.run(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)});"
            " e.scrollIntoView({block: 'center', behavior: 'instant'});"
            " const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()"
        )
        self.drag([(x, y)])

    def drag(self, places):
        """Press the mouse at the first place, move it over the others, release it at the last."""
        self.painted()
        steps = [
            ("mousePressed", places[0]),
            *(("mouseMoved", place) for place in places),
            ("mouseReleased", places[-1]),
        ]
        for kind, (x, y) in steps:
            self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def key(self, name, text=""):
        """Press one key."""
        for kind in ("keyDown", "keyUp"):
            codes = {"Enter": 13, "Tab": 9, "Escape": 27}
            self.ask("Input.dispatchKeyEvent", type=kind, key=name, code=name, text=text if kind == "keyDown" else "",
                     windowsVirtualKeyCode=codes[name])  # fmt: skip

    def _read(self):
        """The next message; events are noted on the way."""
        end = time.monotonic() + PATIENCE_S
        pieces = [self._unread]
        while b"\0" not in pieces[-1]:  # only the newest is looked through: a page on paper comes in a thousand pieces
            ready, _, _ = select.select([self.from_browser], [], [], max(0.0, end - time.monotonic()))
            assert ready, "the browser does not answer"
            pieces.append(os.read(self.from_browser, 1 << 20))
        last, self._unread = pieces[-1].split(b"\0", 1)
        message = json.loads(b"".join([*pieces[:-1], last]))
        self._note(message.get("method", ""), message.get("params", {}))
        return message

    def _note(self, event, params):
        if event == "Page.loadEventFired":
            self._loaded = True
        elif event == "Network.requestWillBeSent" and not params["request"]["url"].startswith(LOCAL):
            self.requests.append(params["request"]["url"])
        elif event == "Runtime.exceptionThrown":
            self.logged.append(str(params["exceptionDetails"]))
        elif event == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.logged.append(str(params["args"]))
        elif event == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.logged.append(params["entry"]["text"])
        elif event == "Page.javascriptDialogOpening":
            self.logged.append(f"dialog: {params['message']}")


@contextmanager
def chromium(profile):
    """A `Page` of a fresh browser with its profile in this folder; the browser ends with the block."""
    commands, our_end = os.pipe()
    their_end, answers = os.pipe()[::-1]
    # The browser reads file descriptor 3 and writes 4; bash puts them there (not sh, whose numbers have one digit).
    command = f'exec "$0" "$@" 3<&{commands} 4>&{their_end}'
    process = subprocess.Popen(
        ["bash", "-c", command, "chromium", *SWITCHES, f"--user-data-dir={profile}", "about:blank"],
        pass_fds=(commands, their_end), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(commands)
    os.close(their_end)
    try:
        page = Page(our_end, answers)
        target = page.ask("Target.createTarget", url="about:blank")["targetId"]
        page.session = page.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            page.ask(f"{domain}.enable")
        yield page
    finally:
        process.terminate()
        process.wait(timeout=30)
        os.close(our_end)
        os.close(answers)
