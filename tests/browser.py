"""A headless browser for tests of pages: opens a file or an address, runs scripts, clicks, resizes, takes pictures.

It uses the DevTools protocol over a pipe (`--remote-debugging-pipe`: JSON messages that end in a zero byte, commands on
descriptor 3, answers on descriptor 4), so that it needs no driver and no port.
"""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
EXECUTABLE = next((found for name in NAMES if (found := shutil.which(name))), None)
NEEDED = "needs Chromium to draw the page: `apt-get install chromium`, or Google Chrome"
TIMEOUT_S = 60.0
FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars",
         "--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage")
LAUNCH = """
import fcntl, os, sys
commands, answers = (fcntl.fcntl(int(number), fcntl.F_DUPFD, 10) for number in sys.argv[1:3])
os.dup2(commands, 3)
os.dup2(answers, 4)
os.execv(sys.argv[3], sys.argv[3:])
"""                     # `subprocess` cannot pass chosen files as descriptors 3 and 4

needs_browser = pytest.mark.skipif(EXECUTABLE is None, reason=NEEDED)


class PageError(AssertionError):
    """A script of the page failed, a condition did not become true, or the browser did not answer in time."""


class Browser:
    """One page. `errors` has the uncaught exceptions and failed or remote loads since `show`."""

    def __init__(self, commands: int, answers: int) -> None:
        self._commands, self._answers = commands, answers
        self._buffer = b""
        self._count = 0
        self.errors: list[str] = []
        self._own: tuple[str, ...] = ()         # beginnings of addresses that the page may ask for
        target = self._call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._call(f"{domain}.enable", session=True)

    def show(self, page: Path | str, width: int = 1400, height: int = 900, *, dark: bool = False) -> None:
        """Open `page` and wait until it is loaded and drawn. The viewport is `width` x `height` CSS pixels.

        A page at an address may ask its own server for more, and nobody else.
        """
        address = page if isinstance(page, str) else page.absolute().as_uri()
        self._own = tuple(f"{scheme}://{urlsplit(page).netloc}/" for scheme in ("http", "ws", "https", "wss")) \
            if isinstance(page, str) else ()
        self._call("Emulation.setDeviceMetricsOverride", session=True, width=width, height=height, deviceScaleFactor=1,
                   mobile=False)
        self._call("Emulation.setEmulatedMedia", session=True,
                   features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"},
                             {"name": "prefers-reduced-motion", "value": "reduce"}])
        self.errors.clear()
        self._call("Page.navigate", session=True, url=address)
        self.until("document.readyState === 'complete' && location.href !== 'about:blank'")
        self.settle()

    def run(self, script: str) -> Any:
        """Return the value of a JavaScript expression, or of its promise; raises PageError if it throws."""
        answer = self._call("Runtime.evaluate", session=True, expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            details = answer["exceptionDetails"]
            raise PageError(details.get("exception", {}).get("description") or details["text"])
        return answer["result"].get("value")

    def until(self, condition: str) -> None:
        """Wait until a JavaScript expression is true; raises PageError after `TIMEOUT_S`."""
        end_s = time.monotonic() + TIMEOUT_S
        while not self.run(f"Boolean({condition})"):
            if time.monotonic() > end_s:
                raise PageError(f"after {TIMEOUT_S:g} s still not: {condition}")

    def settle(self) -> None:
        """Wait until two frames are drawn, so that layouts and charts have taken their sizes."""
        self.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")

    def click(self, selector: str) -> None:
        """Click in the middle of an element, as a user would; nothing may cover the element there."""
        place = self.run(f"""(() => {{
            const element = document.querySelector({json.dumps(selector)});
            if (!element) return null;
            element.scrollIntoView({{block: "center", behavior: "instant"}});
            const box = element.getBoundingClientRect(), x = box.x + box.width / 2, y = box.y + box.height / 2;
            const top = document.elementFromPoint(x, y);
            return {{x, y, top: element === top || element.contains(top)}};
        }})()""")
        assert place is not None, f"the page has no {selector}"
        assert place["top"], f"something covers {selector}"
        self.click_at(place["x"], place["y"])

    def click_at(self, x: float, y: float) -> None:
        """Click at a place of the viewport, in CSS pixels."""
        for kind in ("mousePressed", "mouseReleased"):
            self._call("Input.dispatchMouseEvent", session=True, type=kind, x=x, y=y, button="left", clickCount=1)
        self.settle()

    def write(self, selector: str, text: str) -> None:
        """Click an input and write `text` into it in place of what it holds, as a user would."""
        self.click(selector)
        self.run(f"document.querySelector({json.dumps(selector)}).select()")
        self._call("Input.insertText", session=True, text=text)
        self.settle()

    def press(self, key: str) -> None:
        """Press and release a key, such as "ArrowRight" or "Enter", where the focus is."""
        code = {"Enter": 13, "ArrowLeft": 37, "ArrowRight": 39}[key]
        text = {"text": "\r"} if key == "Enter" else {}
        for kind in ("keyDown", "keyUp"):
            self._call("Input.dispatchKeyEvent", session=True, type=kind, key=key, code=key,
                       windowsVirtualKeyCode=code, **text)
        self.settle()

    def picture(self, path: Path, *, whole: bool = True) -> None:
        found = self._call("Page.captureScreenshot", session=True, captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(found["data"]))

    def _call(self, method: str, *, session: bool = False, **parameters: Any) -> Any:
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method, "params": parameters}
        if session:
            message["sessionId"] = self._session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._commands, data):]
        end_s = time.monotonic() + TIMEOUT_S
        while True:
            answer = self._read(end_s, method)
            if answer.get("id") == message["id"]:
                assert "error" not in answer, f"{method}: {answer['error']}"
                return answer["result"]
            self._note(answer)

    def _note(self, event: dict[str, Any]) -> None:
        parameters = event.get("params", {})
        if event.get("method") == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description") or details["text"])
        elif event.get("method") == "Log.entryAdded" and parameters["entry"]["level"] == "error":
            self.errors.append(parameters["entry"]["text"])
        elif event.get("method") == "Network.requestWillBeSent":
            address = parameters["request"]["url"]
            if not address.startswith(("file:", "data:", "about:", "blob:", *self._own)):
                self.errors.append(f"the page asked the network for {address}")

    def _read(self, end_s: float, method: str) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._answers], [], [], max(0.0, end_s - time.monotonic()))
            if not ready:
                raise PageError(f"{method}: no answer in {TIMEOUT_S:g} s")
            more = os.read(self._answers, 1 << 20)
            if not more:
                raise PageError(f"{method}: the browser has ended")
            self._buffer += more
        line, _, self._buffer = self._buffer.partition(b"\0")
        found: dict[str, Any] = json.loads(line)
        return found


@contextmanager
def browser(profile: Path, home: Path | None = None) -> Iterator[Browser]:
    """Start a browser with the profile in the folder `profile`, empty at first; it ends with the `with` block.

    It takes certificates from the folder `home`, if one is given.
    """
    assert EXECUTABLE is not None, NEEDED
    command_read, command_write = os.pipe()
    answer_read, answer_write = os.pipe()
    process = subprocess.Popen(
        [sys.executable, "-c", LAUNCH, str(command_read), str(answer_write), EXECUTABLE, *FLAGS,
         "--remote-debugging-pipe", f"--user-data-dir={profile}", "about:blank"],
        pass_fds=(command_read, answer_write), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL, env={**os.environ, **({} if home is None else {"HOME": str(home)})})
    os.close(command_read)
    os.close(answer_write)
    try:
        yield Browser(command_write, answer_read)
    finally:
        os.close(command_write)         # the browser ends when its pipe is closed
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        os.close(answer_read)
