"""A page in headless Chromium: what it shows, what it fetches, what the browser's console says of it."""
import base64
import io
import json
import os
import re
import shutil
import subprocess
from contextlib import contextmanager
from html import unescape
from time import monotonic, sleep

import pytest

from pysph_boiling.report.page import POLICY

FLAGS = ("--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
         "--disable-component-update --disable-sync --enable-logging=stderr --log-level=0 --mute-audio").split()
FLAGS.append("--host-resolver-rules=MAP * ~NOTFOUND")  # what the browser itself would ask for goes nowhere
# A page served by this machine, with WebGL by the processor
LOCAL = [flag for flag in FLAGS if flag != "--disable-gpu" and "resolver" not in flag] + [
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--remote-debugging-port=0", "--window-size=1000,700"]
PROBE = """<script>addEventListener("load", async () => {
  await Promise.all(Array.from(document.querySelectorAll("video"), video => new Promise(done => {
    if (video.readyState > 0 || video.error) done();
    video.onloadedmetadata = video.onerror = done; })));
  const seen = {
    pictures: Array.from(document.images, i => [i.naturalWidth, i.naturalHeight, i.getBoundingClientRect().width]),
    movies: Array.from(document.querySelectorAll("video"), v => [v.videoWidth, v.videoHeight]),
    fetched: performance.getEntriesByType("resource").map(e => e.name).filter(name => !name.startsWith("data:")),
    width: document.documentElement.scrollWidth, window: innerWidth,
    headings: Array.from(document.querySelectorAll("h2"), h => h.innerText),
    verdicts: Array.from(document.querySelectorAll("td.verdict"), v => v.innerText),
  };
  document.documentElement.dataset.seen = JSON.stringify(seen); });</script>"""


def find_chromium():
    """The browser's command; without one the test is skipped and says so, or fails where CI is set."""
    names = [os.environ.get("CHROMIUM"), "chromium", "chromium-browser", "google-chrome", "chrome"]
    found = next(filter(None, (shutil.which(name) for name in names if name)), None)
    if found is None:
        message = ("the page was NOT tested in a browser: no chromium (Debian, Ubuntu: apt install chromium, or name "
                   "one in the environment variable CHROMIUM)")
        pytest.fail(message) if os.environ.get("CI") else pytest.skip(message)
    return found


def browse(page, tmp_path, width=1280):
    """Open a copy of the page that reports on itself; returns what it saw and the lines of the console.

    What the page would fetch is refused by its own policy and told on the console, or listed as ``fetched``.
    """
    chromium, html = find_chromium(), page.read_text(encoding="utf-8")
    assert html.count(POLICY) == 1
    copy = tmp_path / "probe.html"
    copy.write_text(html.replace(POLICY, POLICY + "; script-src 'unsafe-inline'").replace("</body>", PROBE + "</body>"),
                    encoding="utf-8")
    done = subprocess.run([chromium, *FLAGS, f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={width},900",
                           "--virtual-time-budget=20000", "--dump-dom", copy.as_uri()],
                          capture_output=True, text=True, timeout=180)
    told = re.search(r'data-seen="([^"]*)"', done.stdout)
    assert told, f"the browser did not get to the end of the page:\n{done.stderr[-2000:]}"
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return json.loads(unescape(told[1])), console


class Tab:
    """A tab of Chromium that is spoken to by its DevTools protocol."""

    def __init__(self, socket):
        self.socket, self.asked = socket, 0

    def ask(self, method, **parameters):
        """Send a command; returns its result."""
        self.asked += 1
        self.socket.send(json.dumps({"id": self.asked, "method": method, "params": parameters}))
        while True:
            told = json.loads(self.socket.recv(timeout=120))
            if told.get("id") == self.asked:
                assert "error" not in told, told
                return told["result"]

    def value(self, script):
        """The value of an expression of JavaScript."""
        told = self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        return told["result"].get("value")

    def press(self, key):
        """Press and release a key, such as "ArrowRight"."""
        for kind in ("rawKeyDown", "keyUp"):
            code = {"ArrowRight": 39, "ArrowLeft": 37, "Home": 36, "End": 35}[key]
            self.ask("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)

    def pixels(self):
        """What is seen, as colours (height, width, 3) 0 .. 255."""
        from matplotlib.image import imread

        picture = base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"])
        return imread(io.BytesIO(picture), format="png")[..., :3] * 255.0


@contextmanager
def tab(address, tmp_path):
    """A :class:`Tab` that shows the page at an address of this machine; it fetches nothing from elsewhere."""
    from websockets.sync.client import connect

    log = tmp_path / "chromium.log"
    with open(log, "w") as errors:
        browser = subprocess.Popen([find_chromium(), *LOCAL, f"--user-data-dir={tmp_path / 'profile'}", address],
                                   stdout=subprocess.DEVNULL, stderr=errors)
    try:
        port = until(lambda: re.search(r"DevTools listening on ws://127.0.0.1:(\d+)/", log.read_text()), log)[1]
        pages = until(lambda: [page for page in listed(port) if page["url"].startswith(address)], log)
        with connect(pages[0]["webSocketDebuggerUrl"], max_size=None, proxy=None) as socket:
            yield Tab(socket)
    finally:
        browser.terminate()
        browser.wait(30)


def listed(port):
    """The pages of a Chromium whose DevTools are at a port."""
    from urllib.request import ProxyHandler, build_opener

    with build_opener(ProxyHandler({})).open(f"http://127.0.0.1:{port}/json/list", timeout=30) as answer:
        return json.loads(answer.read())


def until(found, log=None, seconds=90.0):
    """The result of ``found()`` once it is true; fails after a time."""
    end = monotonic() + seconds
    while monotonic() < end:
        result = found()
        if result:
            return result
        sleep(0.2)
    pytest.fail(f"waited {seconds:.0f} s in vain" + (f":\n{log.read_text()[-2000:]}" if log else ""))
