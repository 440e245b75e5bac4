"""Headless Chromium driven over its DevTools pipe: real mouse and keys, no library, no port."""

from __future__ import annotations

import base64
import contextlib
import json
import os
import select
import shutil
import signal
import subprocess
import time
from pathlib import Path
from types import TracebackType
from typing import Any

WAIT = 120  # [s] for an answer: the processor may be shared with many
CLOSING = 5  # [s] for the browser to end by itself
LEFT = ("navigated or closed", "Cannot find context", "context was destroyed")  # the page asked
KEYS = {
    "ArrowRight": 39,
    "ArrowLeft": 37,
    "ArrowDown": 40,
    "ArrowUp": 38,
    " ": 32,
    "Tab": 9,
    "Enter": 13,
    "Escape": 27,
    "PageUp": 33,
    "PageDown": 34,
}


def chromium() -> str | None:
    """The browser's command, if there is one."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return next((found for name in names if (found := shutil.which(name))), None)


class Page:
    """A page of a browser of its own, 1400 x 1000 pixels."""

    def __init__(self, folder: Path, *flags: str, width: int = 1400, height: int = 1000) -> None:
        to_read, self._write = os.pipe()
        self._read, to_write = os.pipe()
        browser = chromium()
        if browser is None:
            raise FileNotFoundError("no Chromium on this machine")
        command = [
            browser,
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            f"--user-data-dir={folder / 'profile'}",
            f"--window-size={width},{height}",
            "--remote-debugging-pipe",
            *flags,
            "about:blank",
        ]
        # Chromium reads from 3 and writes to 4; dash knows no descriptor above 9
        shell = ["bash", "-c", f'exec "$@" 3<&{to_read} 4>&{to_write}', "bash", *map(str, command)]
        self._process = subprocess.Popen(
            shell,
            pass_fds=(to_read, to_write),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        os.close(to_read)
        os.close(to_write)
        self._number, self._rest, self._session = 0, b"", ""
        self.faults: list[str] = []  # errors and warnings of the page
        self.requests: list[str] = []  # addresses that it asked for
        try:
            self._attach(width, height)
        except BaseException:
            self.close()
            raise

    def _attach(self, width: int, height: int) -> None:
        """Take the first page of the browser."""
        targets = self.send("Target.getTargets")["targetInfos"]
        target = next(t["targetId"] for t in targets if t["type"] == "page")
        attached = self.send("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.send(f"{domain}.enable")
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.send("Emulation.setDeviceMetricsOverride", **size)

    def __enter__(self) -> Page:
        return self

    def __exit__(self, kind: type | None, value: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """End the browser and its helpers, which else write to its profile while that goes."""
        with contextlib.suppress(OSError):
            os.write(self._write, b'{"id": 0, "method": "Browser.close"}\0')
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(CLOSING)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        os.close(self._write)
        os.close(self._read)

    def send(self, method: str, **parameters: Any) -> dict:
        """What the browser answers to a command."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._number:
                if "error" in answer:
                    raise AssertionError(f"{method}: {answer['error']}")
                return answer["result"]
            self._note(answer)

    def _next(self) -> dict:
        end = time.monotonic() + WAIT
        while b"\0" not in self._rest:
            ready = select.select([self._read], [], [], max(end - time.monotonic(), 0))[0]
            if not ready:
                raise AssertionError("the browser does not answer")
            self._rest += os.read(self._read, 1 << 20)
        text, self._rest = self._rest.split(b"\0", 1)
        return json.loads(text)

    def _note(self, event: dict) -> None:
        data = event.get("params", {})
        match event.get("method"):
            case "Runtime.exceptionThrown":
                details = data["exceptionDetails"]
                self.faults.append(details.get("exception", {}).get("description", str(details)))
            case "Runtime.consoleAPICalled" if data["type"] in ("error", "warning", "assert"):
                self.faults.append(str([a.get("value") for a in data["args"]]))
            case "Log.entryAdded" if data["entry"]["level"] == "error":
                self.faults.append(data["entry"]["text"])
            case "Network.requestWillBeSent":
                self.requests.append(data["request"]["url"])

    def open(self, address: str, *, ready: str = "document.body?.dataset.ready === 'yes'") -> None:
        """Go to an address and wait until the page says that it is ready."""
        self.send("Page.navigate", url=address)
        self.until(ready)

    def value(self, expression: str) -> Any:
        """What JavaScript gives, awaited."""
        found = self.send("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in found:
            raise AssertionError(found["exceptionDetails"]["exception"]["description"])
        return found["result"].get("value")

    def until(self, expression: str) -> None:
        """Wait until JavaScript gives true; a page that is just being left gives nothing."""
        end = time.monotonic() + WAIT
        while not self._value_of_a_page(expression):
            if time.monotonic() > end:
                raise AssertionError(f"never came: {expression}; faults: {self.faults}")
            time.sleep(0.02)

    def _value_of_a_page(self, expression: str) -> Any:
        """What JavaScript gives; None where the page went while it was asked."""
        try:
            return self.value(expression)
        except AssertionError as fault:
            if not any(words in str(fault) for words in LEFT):
                raise
            return None

    def place(self, selector: str, across: float = 0.5, down: float = 0.5) -> tuple[float, float]:
        """A place of an element in the window, scrolled into view."""
        text = json.dumps(selector)
        how = "{block: 'center', behavior: 'instant'}"  # pages scroll smoothly: the mouse is faster
        # A link to a part of the page may still be scrolling it: the place counts once two frames agree
        frame = "await new Promise((on) => requestAnimationFrame(on));"
        sizes = "(({x, y, width, height}) => [x, y, width, height])"
        measure = f"{sizes}(document.querySelector({text}).getBoundingClientRect())"
        end, box, before = time.monotonic() + WAIT, [], None
        while box != before:
            if time.monotonic() > end:
                raise AssertionError(f"does not come to rest: {selector}")
            self.value(f"document.querySelector({text}).scrollIntoView({how})")
            before = self.value(f"(async () => {{ {frame} return {measure}; }})()")
            box = self.value(f"(async () => {{ {frame} {frame} return {measure}; }})()")
        return box[0] + across * box[2], box[1] + down * box[3]

    def click(self, selector: str, across: float = 0.5, down: float = 0.5) -> None:
        """Press and release the mouse on an element."""
        x, y = self.place(selector, across, down)
        self.mouse("mouseMoved", x, y)
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y)

    def drag(self, selector: str, start: float, end: float, steps: int = 8) -> None:
        """Drag the mouse along an element, from one share of its width to another."""
        (x, y), (to, _) = self.place(selector, start), self.place(selector, end)
        self.mouse("mouseMoved", x, y)
        self.mouse("mousePressed", x, y)
        for i in range(1, steps + 1):
            self.mouse("mouseMoved", x + (to - x) * i / steps, y, held=True)
        self.mouse("mouseReleased", to, y)

    def mouse(self, kind: str, x: float, y: float, *, held: bool = False) -> None:
        """One event of the mouse."""
        button = "none" if kind == "mouseMoved" and not held else "left"
        more = {"button": button, "clickCount": 1, "buttons": int(button == "left")}
        self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def press(self, key: str, times: int = 1) -> None:
        """Press a key on what has the focus."""
        code = {"key": key, "code": key, "windowsVirtualKeyCode": KEYS.get(key, ord(key[0]))}
        said = "\r" if key == "Enter" else key if len(key) == 1 else ""
        text = {"text": said} if said else {}
        for _ in range(times):
            self.send("Input.dispatchKeyEvent", type="keyDown", **code, **text)
            self.send("Input.dispatchKeyEvent", type="keyUp", **code)

    def screenshot(self, path: Path, *, whole: bool = True) -> None:
        """What the page looks like (PNG)."""
        found = self.send("Page.captureScreenshot", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(found["data"]))
