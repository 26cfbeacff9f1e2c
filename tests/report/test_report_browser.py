"""The page in a browser: no error, no overflow, and plots that zoom together."""

from __future__ import annotations

import fcntl
import itertools
import json
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
SWITCHES = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-extensions",
    "--remote-debugging-pipe",
)
PREPARED = "document.querySelectorAll('.uplot').length"
PLOTS = 30  # of six channels: disturbance and static wrench, each with a residual beneath, and spectra
SPLIT_WORDS = """[...document.querySelectorAll('td')].filter(cell => cell.offsetParent).flatMap(cell => {
  const texts = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT), found = [], range = document.createRange();
  while (texts.nextNode()) for (const word of texts.currentNode.data.matchAll(/[^\\s-]+/g)) {
    range.setStart(texts.currentNode, word.index);
    range.setEnd(texts.currentNode, word.index + word[0].length);
    if (new Set([...range.getClientRects()].map(line => line.top)).size > 1) found.push(word[0]);
  }
  return found;
})"""
# WCAG 2's contrast of each visible text against the ground under it; below 4.5 it is hard to read.
FAINT_TEXTS = """(() => {
  const numbers = (color) => color.match(/[\\d.]+/g).map(Number);
  const light = (color) => numbers(color).slice(0, 3).map((part) => part / 255)
    .map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4))
    .reduce((sum, part, i) => sum + part * [0.2126, 0.7152, 0.0722][i], 0);
  const ground = (element) => {
    const own = getComputedStyle(element).backgroundColor;
    return numbers(own)[3] === 0 ? ground(element.parentElement) : own;
  };
  return [...document.querySelectorAll('body *')].filter((element) => element.offsetParent
    && [...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim())).filter((element) => {
    const [low, high] = [light(getComputedStyle(element).color), light(ground(element))].sort((a, b) => a - b);
    return (high + 0.05) / (low + 0.05) < 4.5;
  }).map((element) => element.textContent.slice(0, 40));
})()"""

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine")]


class Browser:
    """A headless Chromium, spoken to over a pipe in the DevTools protocol."""

    def __init__(self, profile: Path) -> None:
        to_browser, self._write = os.pipe()
        self._read, from_browser = os.pipe()
        # The protocol's descriptors are 3 and 4; moved up first so that neither overwrites the other.
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (to_browser, from_browser)]
        self._process = subprocess.Popen(
            [str(CHROMIUM), *SWITCHES, f"--user-data-dir={profile}"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=(3, 4, *ends),
            preexec_fn=lambda: [os.dup2(end, place) for place, end in zip((3, 4), ends, strict=True)],  # noqa: PLW1509
        )
        for end in (to_browser, from_browser, *ends):
            os.close(end)
        self._ids = itertools.count(1)
        self._pending = b""
        self._session = ""
        self.complaints: list[str] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **params: object) -> dict[str, Any]:
        """Send a command and return its result, noting errors that the page reports meanwhile."""
        number = next(self._ids)
        message: dict[str, object] = {"id": number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._receive()
            self._note(answer)
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return answer["result"]

    def evaluate(self, expression: str) -> Any:
        """Return the value of a JavaScript expression; promises are awaited."""
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def open(self, page: Path, width: int) -> None:
        """Open a page and scroll through it, so that every figure is drawn."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
        self.call("Page.navigate", url=page.as_uri())
        self.evaluate(
            "new Promise(done => document.readyState === 'complete' ? done() : addEventListener('load', done))"
        )
        self.evaluate(
            "(async () => { document.querySelectorAll('details').forEach(d => d.open = true);"
            "for (const f of document.querySelectorAll('figure')) { f.scrollIntoView({behavior: 'instant'});"
            "await new Promise(r => setTimeout(r, 60)); } scrollTo(0, 0); })()"
        )

    def close(self) -> None:
        """End the browser that was started here."""
        os.close(self._write)
        os.close(self._read)
        self._process.terminate()
        self._process.wait(timeout=20)

    def _receive(self) -> dict[str, Any]:
        while b"\0" not in self._pending:
            piece = os.read(self._read, 1 << 20)
            assert piece, "the browser went away"
            self._pending += piece
        message, self._pending = self._pending.split(b"\0", 1)
        return json.loads(message)

    def _note(self, event: dict[str, Any]) -> None:
        params = event.get("params", {})
        if event.get("method") == "Runtime.exceptionThrown":
            self.complaints.append(str(params["exceptionDetails"]))
        elif event.get("method") == "Log.entryAdded" and params["entry"]["level"] in ("warning", "error"):
            self.complaints.append(params["entry"]["text"])
        elif event.get("method") == "Runtime.consoleAPICalled":
            self.complaints.append(str(params["args"]))
        elif event.get("method") == "Network.requestWillBeSent":
            url = params["request"]["url"]
            if not url.startswith(("file:", "data:", "about:")):
                self.complaints.append(f"asked for {url}")


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    started = Browser(tmp_path_factory.mktemp("profile"))
    yield started
    started.close()


@pytest.fixture
def opened(browser: Browser, six_channels: Path) -> Callable[[int], Browser]:
    def at(width: int) -> Browser:
        browser.complaints.clear()
        browser.open(six_channels, width)
        return browser

    return at


@pytest.mark.parametrize("width", [1280, 800, 400])
def test_the_page_renders_without_error_or_overflow(opened: Callable[[int], Browser], width: int) -> None:
    browser = opened(width)
    assert browser.evaluate("document.documentElement.scrollWidth") <= width
    assert browser.evaluate(PREPARED) == PLOTS
    assert browser.evaluate(SPLIT_WORDS) == []
    assert browser.evaluate("[...document.images].every(i => i.complete && (i.naturalWidth || !i.offsetParent))")
    assert browser.complaints == []


def test_one_channel_renders_too(browser: Browser, one_channel: Path) -> None:
    browser.complaints.clear()
    browser.open(one_channel, 800)
    assert browser.evaluate("document.documentElement.scrollWidth") <= 800
    assert browser.evaluate(PREPARED) == 5
    assert browser.complaints == []


def test_the_residual_has_a_plot_of_its_own_beneath(opened: Callable[[int], Browser]) -> None:
    browser = opened(1280)
    labels = (
        "[...document.querySelector('.live').querySelectorAll('.uplot')].map(plot => "
        "[...plot.querySelectorAll('.u-series .u-label')].slice(1).map(label => label.textContent))"
    )
    assert browser.evaluate(labels) == [["predicted", "measured"], ["residual"]] * 6


def test_plots_take_the_place_of_plates_on_screen_and_give_it_back_on_paper(opened: Callable[[int], Browser]) -> None:
    browser = opened(1280)
    displays = "['.live', '.plates'].map(s => getComputedStyle(document.querySelector(s)).display)"
    assert browser.evaluate(displays) == ["block", "none"]
    browser.call("Emulation.setEmulatedMedia", media="print")
    assert browser.evaluate(displays) == ["none", "block"]
    browser.call("Emulation.setEmulatedMedia", media="")


def test_zooming_one_channel_zooms_all_and_another_recording_can_be_chosen(opened: Callable[[int], Browser]) -> None:
    browser = opened(1280)
    axes = "[...document.querySelectorAll('.live')[0].querySelectorAll('.u-over')]"
    browser.evaluate(f"{axes}[0].scrollIntoView({{block: 'center', behavior: 'instant'}})")
    box = browser.evaluate(f"(() => {{ const r = {axes}[0].getBoundingClientRect(); return [r.x, r.y, r.width]; }})()")
    before = _pixels(browser)
    x, y, width = box
    for kind, at in (("mousePressed", 0.3), ("mouseMoved", 0.4), ("mouseMoved", 0.5), ("mouseReleased", 0.5)):
        browser.call(
            "Input.dispatchMouseEvent", type=kind, x=x + at * width, y=y + 30, button="left", buttons=1, clickCount=1
        )
    browser.evaluate("new Promise(done => setTimeout(done, 200))")
    after = _pixels(browser)
    assert all(now != then for now, then in zip(after, before, strict=True)), "all six channels follow"
    browser.evaluate("document.querySelector('.choices button').click()")
    browser.evaluate("new Promise(done => setTimeout(done, 200))")
    assert _pixels(browser) == before, "see all"
    browser.evaluate(
        "(() => { const s = document.querySelector('.choices select'); s.value = 'EL089P00_1';"
        "s.dispatchEvent(new Event('change')); })()"
    )
    browser.evaluate("new Promise(done => setTimeout(done, 200))")
    assert browser.evaluate(PREPARED) == PLOTS
    assert _pixels(browser) != before
    assert browser.complaints == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_is_easy_to_read_in_either_scheme(opened: Callable[[int], Browser], scheme: str) -> None:
    browser = opened(1280)
    browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    assert browser.evaluate(FAINT_TEXTS) == []
    browser.call("Emulation.setEmulatedMedia", features=[])


def test_plots_are_drawn_anew_in_the_dark(opened: Callable[[int], Browser]) -> None:
    browser = opened(1280)
    in_the_light = _pixels(browser)
    browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    browser.evaluate("new Promise(done => setTimeout(done, 300))")
    assert all(now != then for now, then in zip(_pixels(browser), in_the_light, strict=True))
    assert browser.evaluate(PREPARED) == PLOTS
    browser.call("Emulation.setEmulatedMedia", features=[])
    assert browser.complaints == []


def test_a_mark_gives_differences(opened: Callable[[int], Browser]) -> None:
    browser = opened(1280)
    over = "document.querySelector('.live .u-over')"
    browser.evaluate(f"{over}.scrollIntoView({{block: 'center', behavior: 'instant'}})")
    x, y = browser.evaluate(f"(() => {{ const r = {over}.getBoundingClientRect(); return [r.x, r.y]; }})()")
    for kind, place in (("mouseMoved", 200), ("mousePressed", 200), ("mouseReleased", 200), ("mouseMoved", 420)):
        browser.call("Input.dispatchMouseEvent", type=kind, x=x + place, y=y + 30, button="left", clickCount=1)
    reading = browser.evaluate("document.querySelector('.reading').textContent")
    assert reading.startswith("From the mark: Δt ")
    assert "ΔTz" in reading


def test_keys_move_and_zoom_all_channels(opened: Callable[[int], Browser]) -> None:
    browser = opened(1280)
    whole = _pixels(browser)
    browser.evaluate("document.querySelector('.plots').focus()")

    def press(key: str) -> list[str]:
        browser.evaluate(
            f"document.activeElement.dispatchEvent(new KeyboardEvent('keydown', {{key: '{key}', bubbles: true}}))"
        )
        browser.evaluate("new Promise(done => setTimeout(done, 200))")
        return _pixels(browser)

    nearer = press("+")
    later = press("ArrowRight")
    assert all(one != other for one, other in zip(nearer, whole, strict=True))
    assert all(one != other for one, other in zip(later, nearer, strict=True))
    assert press("0") == whole


def test_a_table_is_saved_as_numbers_that_programs_read(opened: Callable[[int], Browser]) -> None:
    browser = opened(1280)
    browser.evaluate(
        "(() => { const cell = document.querySelector('.grid td.r');"
        "cell.textContent = '−1.50\u00a0×\u00a010⁻³'; cell.nextElementSibling.textContent = 'a \"b\", c';"
        "window.saved = []; URL.createObjectURL = (blob) => { window.saved.push(blob); return '#'; };"
        "cell.closest('.grid').previousElementSibling.querySelector('.save').click(); })()"
    )
    lines = browser.evaluate("window.saved[0].text()").split("\r\n")
    assert lines[0].startswith("Requirement,Band,Measured")
    assert '-1.50e-3,"a ""b"", c"' in lines[1]


def _pixels(browser: Browser) -> list[str]:
    """What is drawn on each canvas of the first figure, as a digest-like string."""
    found: list[str] = browser.evaluate(
        "[...document.querySelectorAll('.live')[0].querySelectorAll('canvas')].map(c => c.toDataURL())"
    )
    return found
