"""``pysph-boiling reproduce --quick``: every figure is produced and complete, and its verdicts are the stored ones.

Whether ours agrees with the paper is reported on the page, not asserted here. A verdict that changed is a change of the
model or of a scene; if it was meant, store the new ones with the command that the failure prints.
"""
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from browser import browse

from pysph_boiling.evaluation.reproduce.figure import figures
from pysph_boiling.report.page import MEDIA
from pysph_boiling.report.sections import Section

STORED = Path(__file__).with_name("verdicts.json")
RENEW = f"pysph-boiling reproduce --quick --json {STORED.relative_to(STORED.parents[2])}"
KEYS = [f"fig{k}" for k in range(1, 16)] + [f"table{k}" for k in range(1, 5)]
LIMIT = 480.0  # [s] on two cores, with nothing compiled before


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """The folder of the quick form, made by the command as a reader would type it."""
    folder = tmp_path_factory.mktemp("quick")
    begin = time.time()
    done = subprocess.run([sys.executable, "-m", "pysph_boiling", "reproduce", "--quick", "--directory", str(folder),
                           "--json", str(folder / "verdicts.json")], capture_output=True, text=True,
                          timeout=3.0 * LIMIT)
    assert done.returncode == 0, f"{done.stdout[-4000:]}\n{done.stderr[-4000:]}"
    print(f"reproduce --quick took {time.time() - begin:.0f} s of {LIMIT:.0f} s")
    return folder


def verdicts(path):
    return json.loads(path.read_text()) if path.exists() else {}


def test_every_figure_of_the_paper_is_known():
    assert list(figures()) == KEYS


@pytest.mark.parametrize("key", KEYS)
def test_figure_is_complete(quick, key):
    section = Section.load(quick / key)
    assert section.key == key and section.title and section.statements
    assert section.pictures or section.tables
    for picture in section.pictures:
        file = quick / key / picture.file
        assert file.suffix in MEDIA and picture.caption
        if file.suffix == ".mp4":
            assert file.stat().st_size > 1000
        else:
            from matplotlib.image import imread

            pixels = imread(file)
            assert min(pixels.shape[:2]) >= 100 and np.std(pixels[..., :3]) > 0.0, f"{file.name} is empty"
    for table in section.tables:
        assert table.rows and all(len(row) == len(table.columns) for row in table.rows), table.caption
    for name in section.data:
        assert (quick / key / name).stat().st_size > 0
    for row in section.statements:
        assert row.paper and row.ours and row.agrees in (True, False, None)
        assert not any(bad in row.ours for bad in ("nan", "inf ", "None", "np.")), row.ours
        assert row.agrees is not False or row.why, f"nothing says why ours disagrees: {row.paper}"
    assert len({row.paper for row in section.statements}) == len(section.statements)


@pytest.mark.parametrize("key", KEYS)
def test_verdicts_are_the_stored_ones(quick, key):
    """Not that ours agrees with the paper, but that it agrees or disagrees as it did before."""
    now, before = (verdicts(path).get(key) for path in (quick / "verdicts.json", STORED))
    assert now == before, f"{key} is not as stored. Was that meant? Then look at the page, and renew: {RENEW}"


def test_page_holds_every_figure(quick):
    html = (quick / "index.html").read_text(encoding="utf-8")
    assert [html.count(f'<section id="{key}">') for key in KEYS] == [1] * len(KEYS)
    pictures = [picture for key in KEYS for picture in Section.load(quick / key).pictures]
    assert html.count("<figure>") == len(pictures) >= 15


def test_page_shows_in_a_browser(quick, tmp_path):
    seen, console = browse(quick / "index.html", tmp_path)
    assert len(seen["headings"]) == len(KEYS) and all(min(size) > 0 for size in seen["pictures"])
    assert (console, seen["fetched"]) == ([], [])


def test_second_call_runs_nothing_anew(quick):
    """Everything is kept: only the drawing is done again."""
    done = subprocess.run([sys.executable, "-m", "pysph_boiling", "reproduce", "fig2", "table4", "--quick",
                           "--directory", str(quick)], capture_output=True, text=True, timeout=LIMIT,
                          env={**os.environ, "COLUMNS": "300"})
    assert done.returncode == 0, done.stderr[-2000:]
    assert "[1/" not in done.stdout and "page: " in done.stdout
