"""The page: valid, complete, one file; in a browser its pictures show, and nothing is fetched or complained about."""
import re
import struct
import subprocess
import zlib
from html.parser import HTMLParser

import numpy as np
import pytest
from browser import browse

from pysph_boiling.evaluation.reproduce.wording import PAPER
from pysph_boiling.report.page import EMBEDDED, label, origin, text, write_page
from pysph_boiling.report.sections import Picture, Section, Statement, Table

VOID = {"meta", "img", "br", "hr", "link", "input"}  # elements without an end tag
NASTY = '<b>5 < 6 & "7"</b>'
GIF = bytes.fromhex("47494638396101000100800000ff0000ffffff2c00000000010001000002024401003b")  # one pixel
RECORD = dict(machine="x86_64 Linux, 2 cores", processor="A & B", finished="2024-05-06T07:08:09+00:00",
              versions=dict(python="3.11.2", pysph="1.0b2"))


def png(width=3, height=2):
    """A grey PNG."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = (b"\x00" + b"\x80" * width) * height
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


@pytest.fixture
def sections(tmp_path):
    """Two figures and a table, with everything that a section can have; their files lie in ``tmp_path``."""
    files = {"fig3": {"a.png": png(), "b.gif": GIF, "n.csv": b"t,n\n0,1\n", "big.npz": bytes(EMBEDDED)},
             "fig14": {"c.png": png(5, 4)}, "table1": {}}
    for key, contents in files.items():
        (tmp_path / key).mkdir()
        for name, raw in contents.items():
            (tmp_path / key / name).write_bytes(raw)
    return [
        Section("fig3", "Figure 3: steady boiling", pictures=[Picture("a.png", NASTY), Picture("b.gif", "moving")],
                tables=[Table(("name", "n"), [[NASTY, "12"], ["b", "3.5"]], NASTY)],
                statements=[Statement(NASTY, "ours", True), Statement("p", NASTY, False, NASTY),
                            Statement("q", "?", None, "too small")],
                data=["n.csv", "big.npz"], text=f"One.\n\n{NASTY}", commands=["run a", "run b", "run a"],
                origins=[origin(RECORD), origin(RECORD)]),
        Section("fig14", "superheated particles", pictures=[Picture("c.png", "c")],
                statements=[Statement("p", "o", True)], commands=[NASTY], origins=[origin({})]),
        Section("table1", "methods"),
    ]


class Checked(HTMLParser):
    """Tags must nest; collects ids, addresses, texts by element."""

    def __init__(self):
        super().__init__()
        self.open, self.ids, self.addresses, self.tags, self.text = [], [], [], [], []

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        self.ids += [value for name, value in attributes if name == "id"]
        self.addresses += [value for name, value in attributes if name in ("src", "href", "data", "action", "srcset")]
        names = [name for name, _ in attributes]
        assert len(names) == len(set(names)), f"<{tag}> has an attribute twice"
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-1:]} at {self.getpos()}"
        self.open.pop()

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("style", "script"):
            self.text.append(data)


def parsed(html):
    page = Checked()
    page.feed(html)
    page.close()
    assert page.open == [], f"not closed: {page.open}"
    assert len(page.ids) == len(set(page.ids)), "an id is there twice"
    return page


def test_page_is_valid_complete_and_alone(sections, tmp_path):
    path = write_page(sections, tmp_path, wording=PAPER)
    assert path == tmp_path / "index.html"
    html = path.read_text(encoding="utf-8")
    page = parsed(html)
    assert html.startswith("<!doctype html>") and [tag for tag, _ in page.tags].count("h1") == 1
    assert "script" not in [tag for tag, _ in page.tags] and not re.search(r"@import|url\(|https?:", html)
    for address in page.addresses:
        assert address.startswith("data:") or address[0] == "#" and address[1:] in page.ids, address[:80]
    assert [attributes["src"][:15] for tag, attributes in page.tags if tag == "img"] == [
        "data:image/png;", "data:image/gif;", "data:image/png;"]
    text = " ".join(" ".join(page.text).split())
    assert "<b>" not in html and text.count(NASTY) == 8
    for piece in ("Of 4 statements", "2 agree", "1 disagree", "1 undecided", "Fig. 3 Steady boiling", "Table 1",
                  "Commands (2 runs) pysph-boiling reproduce fig3 run a run b", "n.csv (0.008 kB)",
                  "big.npz (2 MB), in the folder fig3", "Too small.",
                  "Runs made on A & B (x86_64 Linux, 2 cores).", "Finished 2024-05-06.",
                  "With python 3.11.2, pysph 1.0b2."):
        assert piece in text, piece
    assert text.count("Runs made on") == text.count("With ") == 1  # nothing is told of runs that tell nothing


def test_summary_counts_verdicts_and_links(sections, tmp_path):
    html = write_page(sections, tmp_path, wording=PAPER).read_text(encoding="utf-8")
    nav = html[html.index("<nav>"):html.index("</nav>")]
    rows = re.findall(r"<tr>.*", nav)
    assert [re.sub("<.*?>", " ", row).split() for row in rows] == [
        "Fig.&nbsp;3 Steady boiling 1 agree , 1 disagree , 1 undecided".split(),
        "Fig.&nbsp;14 Superheated particles 1 agree".split(), "Table&nbsp;1 Methods".split()]
    assert [re.search('href="#(.*?)"', row)[1] for row in rows] == ["fig3", "fig14", "table1"]


def test_formulas_and_options_are_not_broken_over_lines():
    assert text("0 <= e, e < L & T ≥ 1") == "0\u00a0&lt;=\u00a0e, e\u00a0&lt;\u00a0L &amp; T\u00a0≥\u00a01"
    assert text("With --phases.interrupt convert.") == "With <code>--phases.interrupt</code> convert."
    assert text("a--b -- c") == "a--b -- c"
    assert text("swings by +-6.6 %") == "swings by ±6.6 %"


def test_quick_page_says_so(sections, tmp_path):
    full, quick = (write_page(sections, tmp_path, wording=PAPER, quick=form).read_text() for form in (False, True))
    assert "--quick" not in full and "quick form" not in full
    assert "pysph-boiling reproduce fig14 --quick" in quick and "quick form" in quick


def test_small_data_is_embedded_and_large_is_named(sections, tmp_path):
    page = parsed(write_page(sections, tmp_path, wording=PAPER).read_text())
    links = [attributes for tag, attributes in page.tags if tag == "a" and "download" in attributes]
    assert [link["download"] for link in links] == ["fig3_n.csv"]
    assert links[0]["href"] == "data:text/csv;base64,dCxuCjAsMQo="


def test_what_cannot_be_shown_is_refused(sections, tmp_path):
    (tmp_path / "fig14" / "c.bmp").write_bytes(b"x")
    for file, error in (("c.bmp", ValueError), ("missing.png", FileNotFoundError)):
        sections[1].pictures = [Picture(file, "c")]
        with pytest.raises(error, match=file):
            write_page(sections, tmp_path, wording=PAPER)


def test_section_survives_its_file(sections, tmp_path):
    before = write_page(sections, tmp_path, wording=PAPER).read_text()
    for section in sections:
        section.save(tmp_path / section.key)
    again = [Section.load(tmp_path / section.key) for section in sections]
    assert write_page(again, tmp_path, wording=PAPER).read_text() == before


@pytest.mark.parametrize("agrees", [np.True_, np.False_, True, None])
def test_verdict_survives_its_file(tmp_path, agrees):
    Section("fig1", "t", statements=[Statement("p", "o", agrees)]).save(tmp_path)
    assert Section.load(tmp_path).statements[0].agrees is (None if agrees is None else bool(agrees))


def test_labels():
    assert (label("fig14"), label("table1")) == ("Fig. 14", "Table 1")


# --- in a browser -----------------------------------------------------------------------------------------------------

def test_pictures_show_and_nothing_is_fetched(sections, tmp_path):
    seen, console = browse(write_page(sections, tmp_path, wording=PAPER), tmp_path)
    assert [picture[:2] for picture in seen["pictures"]] == [[3, 2], [1, 1], [5, 4]]
    assert seen["headings"] == ["Fig. 3\nSteady boiling", "Fig. 14\nSuperheated particles", "Table 1\nMethods"]
    assert seen["verdicts"] == ["agrees", "disagrees", "undecided", "agrees"]
    assert (console, seen["fetched"]) == ([], [])


def test_movies_play(sections, tmp_path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    subprocess.run([ffmpeg, "-loglevel", "error", "-f", "lavfi", "-i", "color=red:size=64x48:rate=5:duration=0.4",
                    "-pix_fmt", "yuv420p", str(tmp_path / "fig3" / "m.mp4")], check=True)
    sections[0].pictures.append(Picture("m.mp4", "a movie"))
    seen, console = browse(write_page(sections, tmp_path, wording=PAPER), tmp_path)
    assert seen["movies"] == [[64, 48]] and console == []


def test_wide_pictures_and_tables_do_not_widen_a_narrow_page(sections, tmp_path):
    (tmp_path / "fig14" / "c.png").write_bytes(png(3000, 10))
    sections[1].tables = [Table([f"column {k}" for k in range(30)], [["text"] * 30])]
    seen, _ = browse(write_page(sections, tmp_path, wording=PAPER), tmp_path, width=500)
    assert seen["window"] == 500 and seen["width"] <= seen["window"]


@pytest.mark.parametrize("piece, kind", [
    ('<img src="https://example.org/a.png">', "console"), ("<script>fail()</script>", "console"),
    ('<img src="data:image/png;base64,AAAA">', "pictures")])
def test_the_browser_test_sees_what_is_wrong(sections, tmp_path, piece, kind):
    page = write_page(sections, tmp_path, wording=PAPER)
    page.write_text(page.read_text().replace("</main>", piece + "</main>"))
    seen, console = browse(page, tmp_path)
    assert {"console": console != [], "pictures": [0, 0] in [size[:2] for size in seen["pictures"]]}[kind]
