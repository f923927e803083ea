"""A page in headless Chromium: what it shows, what it fetches, what the browser's console says of it."""
import json
import os
import re
import shutil
import subprocess
from html import unescape

import pytest

from pysph_boiling.report.page import POLICY

FLAGS = ("--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
         "--disable-component-update --disable-sync --enable-logging=stderr --log-level=0 --mute-audio").split()
FLAGS.append("--host-resolver-rules=MAP * ~NOTFOUND")  # what the browser itself would ask for goes nowhere
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
