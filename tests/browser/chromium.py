"""Debian's Chromium without a screen, driven over the DevTools protocol."""

import json
import re
import shutil
import subprocess
import tempfile
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic, sleep
from typing import Any

from websockets.sync.client import ClientConnection, connect

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--remote-debugging-port=0",
)
STARTS_S, ANSWERS_S = 90.0, 120.0


class Tab:
    """One page, and everything that it said and asked for."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.events: list[dict[str, Any]] = []
        self._last = 0
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """What the browser answers."""
        self._last += 1
        self.socket.send(json.dumps({"id": self._last, "method": method, "params": params}))
        while True:
            message = json.loads(self.socket.recv(timeout=ANSWERS_S))
            if message.get("id") == self._last:
                assert "error" not in message, message["error"]
                return message["result"]
            self.events.append(message)

    def run(self, script: str) -> Any:
        """The value of an expression on the page."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def open(self, page: Path) -> float:
        """Seconds until the page was there with all its scripts run."""
        self.events.clear()
        began = monotonic()
        self.call("Page.navigate", url=page.resolve().as_uri())
        while not self.run("document.readyState === 'complete' && document.body.dataset.ready === 'yes'"):
            assert monotonic() - began < ANSWERS_S, "the page never became ready"
            sleep(0.02)
        return monotonic() - began

    def scroll_through(self) -> None:
        """Bring every figure into sight once, as a reader would."""
        self.run(
            "(async () => { for (const f of document.querySelectorAll('figure.plot')) {"
            "if (!f.offsetParent) continue; f.scrollIntoView(); const late = Date.now() + 20000;"
            "while (!f.dataset.drawn && Date.now() < late) await new Promise((r) => setTimeout(r, 20));"
            "} scrollTo(0, 0); })()"
        )

    def look(self, scheme: str, width: int, height: int) -> None:
        """Light or dark, and how wide the window is."""
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 700,
        )

    def screenshot(self, target: Path, whole: bool = True) -> None:
        """A PNG of the page, or of what is in sight."""
        shot = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        target.write_bytes(b64decode(shot["data"]))

    @property
    def complaints(self) -> list[str]:
        """Errors and warnings on the console, and exceptions."""
        self.run("0")
        said = []
        for event in self.events:
            method, params = event.get("method"), event.get("params", {})
            if method == "Runtime.exceptionThrown":
                said.append(json.dumps(params["exceptionDetails"])[:500])
            if method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
                said.append(json.dumps(params["args"])[:500])
            if method == "Log.entryAdded" and params["entry"]["level"] == "error":
                said.append(params["entry"]["text"])
        return said

    @property
    def requests(self) -> list[str]:
        """Addresses that were asked for and are not this file or in it."""
        self.run("0")
        sent = [
            e["params"]["request"]["url"]
            for e in self.events
            if e.get("method") == "Network.requestWillBeSent"
        ]
        return [url[:200] for url in sent if not re.match(r"(file|data|blob):", url)]


@contextmanager
def chromium() -> Iterator[Tab]:
    """A browser with a folder of its own, closed and removed at the end."""
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    assert program, "chromium is not installed: make test-browser installs Debian's"
    folder = tempfile.mkdtemp(prefix="irl-chromium-")
    process = subprocess.Popen(
        [program, *FLAGS, f"--user-data-dir={folder}", "about:blank"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        with connect(_address(Path(folder), process), max_size=None, proxy=None) as socket:
            yield Tab(socket)
    finally:
        process.terminate()
        process.wait(timeout=30)
        shutil.rmtree(folder, ignore_errors=True)


def _address(folder: Path, process: subprocess.Popen[bytes]) -> str:
    """Where the first tab listens."""
    began, file = monotonic(), folder / "DevToolsActivePort"
    while not (file.is_file() and len(file.read_text().split()) == 2):
        assert process.poll() is None, f"chromium ended with status {process.returncode}"
        assert monotonic() - began < STARTS_S, "chromium did not start"
        sleep(0.05)
    port, browser = file.read_text().split()
    with connect(f"ws://127.0.0.1:{port}{browser}", proxy=None) as socket:
        while True:
            socket.send(json.dumps({"id": 1, "method": "Target.getTargets"}))
            answer = json.loads(socket.recv(timeout=ANSWERS_S))
            for target in answer.get("result", {}).get("targetInfos", ()):
                if target["type"] == "page":
                    return f"ws://127.0.0.1:{port}/devtools/page/{target['targetId']}"
            assert monotonic() - began < STARTS_S, "chromium opened no tab"
            sleep(0.05)
