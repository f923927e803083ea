"""The HTML page: one file that contains its pictures, movies and data, and needs no network."""
import base64
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from pathlib import Path

__all__ = ["VERDICTS", "Wording", "bare_title", "counts", "label", "origin", "sentence", "write_page"]

VERDICTS = {True: "agrees", False: "disagrees", None: "undecided"}
COUNTS = {True: "agree", False: "disagree", None: "undecided"}
MEDIA = {".png": "image/png", ".gif": "image/gif", ".mp4": "video/mp4"}
EMBEDDED = 2_000_000  # bytes; larger data files are only named, not embedded
POLICY = "default-src 'none'; img-src data:; media-src data:; style-src 'unsafe-inline'"  # no scripts and no network

STYLE = """
:root { color-scheme: light dark; --ink: #1c2430; --quiet: #5a6472; --line: #d5dae1; --paper: #ffffff; --tint: #f4f6f8;
  --link: #1d5fa8; --agrees: #1a7f4b; --disagrees: #b3261e; --undecided: #6b5b00; }
@media (prefers-color-scheme: dark) { :root { --ink: #e4e8ee; --quiet: #a0a9b6; --line: #3a424e; --paper: #14181e;
  --tint: #1d232b; --link: #82b5f2; --agrees: #5fcb93; --disagrees: #ff8f85; --undecided: #d9c35a; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 64rem; padding: 1rem 1.25rem 3rem; background: var(--paper); color: var(--ink);
  font: 1rem/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", sans-serif; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 1.5rem 0 .5rem; }
h2 { font-size: 1.35rem; line-height: 1.3; margin: 0 0 .75rem; }
h2 small { display: block; color: var(--quiet); font-size: .85rem; font-weight: 600; }
h3 { font-size: 1rem; margin: 1.5rem 0 .5rem; }
p { max-width: 44rem; }
a { color: var(--link); }
section { border-top: 1px solid var(--line); margin-top: 2.5rem; padding-top: 1.75rem; }
figure { margin: 1rem 0 1.5rem; }
img, video { display: block; max-width: 100%; height: auto; background: #ffffff; border-radius: 4px; }
figcaption, caption { color: var(--quiet); font-size: .9rem; text-align: left; }
figcaption { margin-top: .4rem; max-width: 44rem; }
caption { padding-bottom: .4rem; }
.wide { overflow-x: auto; margin: 1rem 0; }
table { border-collapse: collapse; font-size: .92rem; }
th, td { border-bottom: 1px solid var(--line); padding: .4rem .9rem .4rem 0; text-align: left; vertical-align: top; }
thead th { color: var(--quiet); font-weight: 600; }
.number { text-align: right; font-variant-numeric: tabular-nums; }
.statements { width: 100%; table-layout: fixed; }
.statements .verdict { width: 8rem; padding-right: 0; }
.verdict { font-weight: 600; white-space: nowrap; }
.agrees { color: var(--agrees); } .disagrees { color: var(--disagrees); } .undecided { color: var(--undecided); }
.why { color: var(--quiet); margin: .3rem 0 0; }
code { font-size: .9em; white-space: nowrap; }
pre { background: var(--tint); border-radius: 4px; font-size: .85rem; overflow-x: auto; padding: .75rem 1rem; }
summary { cursor: pointer; }
footer { border-top: 1px solid var(--line); color: var(--quiet); font-size: .9rem; margin-top: 3rem; }
nav td:last-child { padding-right: 0; }
@media (max-width: 40rem) {
  nav tr { display: block; border-bottom: 1px solid var(--line); padding: .4rem 0; }
  nav td { border: 0; display: inline; padding: 0 .3rem 0 0; }
  .statements thead { display: none; }
  .statements, .statements tbody, .statements tr, .statements td { display: block; width: 100%; }
  .statements tr { border-bottom: 1px solid var(--line); padding: .6rem 0; }
  .statements td { border: 0; padding: .15rem 0; }
  .statements td::before { color: var(--quiet); content: attr(data-label); display: block; font-size: .8rem;
    font-weight: 600; }
}
@media print {
  html { font-size: 10pt; }
  body { max-width: none; padding: 0; }
  figure, tr, h2, h3 { break-inside: avoid; }
  h2, h3 { break-after: avoid; }
  pre { white-space: pre-wrap; }
}
""".strip()


@dataclass(frozen=True, kw_only=True)
class Wording:
    """The texts of a report.

    ``intro`` is HTML, in which ``{form}`` becomes ``quick`` in the quick form and nothing in the full one. ``counted``
    says what kind of statements there are, ``sides`` are the headings of their two columns, and ``command`` is the
    command that makes the report. ``caveat(section)`` returns a sentence to be put above a section, or an empty string.
    """

    title: str
    intro: str
    quick: str
    counted: str
    sides: tuple[str, str]
    command: str
    caveat: Callable = lambda section: ""


def write_page(sections, root, *, wording, quick=False):
    """Write ``index.html`` to ``root`` from the sections, whose files are in ``root/<key>``; returns its path.

    Errors: ``FileNotFoundError`` for a missing picture or data file, ``ValueError`` for a picture that is neither PNG,
    GIF nor MP4.
    """
    root = Path(root)
    body = [*head(sections, quick, wording), *contents(sections), "<main>"]
    for section in sections:
        body += one_section(section, root / section.key, quick, wording)
    body += ["</main>", *foot(sections)]
    path = root / "index.html"
    path.write_text("\n".join([
        "<!doctype html>", '<html lang="en">', "<head>", '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(wording.title)}</title>", f"<style>\n{STYLE}\n</style>", "</head>",
        '<body id="top">', *body, "</body>", "</html>", ""]), encoding="utf-8")
    return path


def label(key):
    """``Fig. 14`` for the key ``fig14``; an empty string for a section that is no figure or table of the paper."""
    found = re.fullmatch(r"(fig|table)(\d+)", key)
    return f"{dict(fig='Fig.', table='Table')[found[1]]} {found[2]}" if found else ""


def origin(record):
    """Machine, time and versions with which a run was made, from its ``run.json``."""
    return {**{name: record.get(name, "") for name in ("machine", "processor", "finished")},
            "versions": record.get("versions", {})}


# --- parts ------------------------------------------------------------------------------------------------------------


def head(sections, quick, wording):
    total = [statement for section in sections for statement in section.statements]
    return ["<header>", f"<h1>{escape(wording.title)}</h1>",
            f"<p>{wording.intro.replace('{form}', wording.quick if quick else '')}</p>",
            *([f"<p>Of {len(total)} {wording.counted}: {counted(total)}.</p>"] if total else []), "</header>"]


def contents(sections):
    rows = [f'<tr><td><a href="#{section.key}">{label(section.key).replace(" ", "&nbsp;")}</a></td>'
            f"<td>{text(bare_title(section))}</td><td>{counted(section.statements)}</td></tr>" for section in sections]
    return ["<nav>", "<table>", "<tbody>", *rows, "</tbody>", "</table>", "</nav>"]


def one_section(section, folder, quick, wording):
    parts = [f'<section id="{section.key}">',
             f"<h2>{f'<small>{label(section.key)}</small>' * bool(label(section.key))}{text(bare_title(section))}</h2>"]
    caveat = wording.caveat(section)
    parts += [f"<p><strong>{text(caveat)}</strong></p>"] * bool(caveat)
    parts += [f"<p>{text(' '.join(paragraph.split()))}</p>" for paragraph in section.text.split("\n\n")
              if paragraph.strip()]
    parts += [line for picture in section.pictures for line in media(picture, folder)]
    if section.statements:
        parts += statements(section, wording.sides)
    for one in section.tables:
        rows = [[text(str(cell)) for cell in row] for row in one.rows]
        numbers = [k for k in range(len(one.columns)) if rows and all(is_number(str(row[k])) for row in one.rows)]
        parts += table([text(name) for name in one.columns], rows, numbers, text(one.caption))
    if section.data:
        parts.append("<p>Data: " + ", ".join(data_file(folder / name) for name in section.data) + "</p>")
    command = f"pysph-boiling {wording.command} {section.key}" + " --quick" * quick
    runs = list(dict.fromkeys(section.commands))
    count = f"Commands ({len(runs)} {'run' if len(runs) == 1 else 'runs'})" if runs else "Command"
    parts += ["<details>", f"<summary>{count}</summary>",
              f"<pre>{escape(chr(10).join([command, *runs]))}</pre>", "</details>",
              '<p><a href="#top">Contents</a></p>', "</section>"]
    return parts


def basis(section, statement):
    """What a statement is judged on, and why its criterion is fair; empty if neither is known."""
    return " ".join(sentence(words) for words in (section.judged_on, statement.fair) if words)


def statements(section, sides):
    parts = ['<table class="statements">', f'<thead><tr><th scope="col">{sides[0]}</th><th scope="col">{sides[1]}</th>'
             '<th scope="col" class="verdict">verdict</th></tr></thead>', "<tbody>"]
    for row in section.statements:
        why = f'<p class="why">{text(sentence(row.why))}</p>' if row.why else ""
        on = f'<p class="why">Judged on: {text(basis(section, row))}</p>' if basis(section, row) else ""
        parts.append(f'<tr><td data-label="{sides[0]}">{text(sentence(row.paper))}{on}</td>'
                     f'<td data-label="{sides[1]}">{text(sentence(row.ours))}{why}</td>'
                     f'<td data-label="verdict" class="verdict {css(row.agrees)}">{VERDICTS[row.agrees]}</td></tr>')
    return [*parts, "</tbody>", "</table>"]


def table(columns, rows, numbers=(), caption=""):
    """Lines of a table of HTML cells; the columns ``numbers`` are aligned right."""
    kind = ['class="number"' if k in numbers else "" for k in range(len(columns))]
    heading = "".join(f'<th scope="col" {kind[k]}>{name}</th>' for k, name in enumerate(columns))
    return ['<div class="wide">', "<table>", *([f"<caption>{caption}</caption>"] if caption else []),
            f"<thead><tr>{heading}</tr></thead>", "<tbody>",
            *("<tr>" + "".join(f"<td {kind[k]}>{cell}</td>" for k, cell in enumerate(row)) + "</tr>" for row in rows),
            "</tbody>", "</table>", "</div>"]


def media(picture, folder):
    file = folder / picture.file
    if file.suffix not in MEDIA:
        raise ValueError(f"a picture must be PNG, GIF or MP4, got {file}")
    address = data_address(file, MEDIA[file.suffix])
    if file.suffix == ".mp4":
        shown = f'<video controls loop muted playsinline preload="metadata" src="{address}"></video>'
    else:
        shown = f'<img src="{address}" alt="{escape(picture.caption)}">'
    return ["<figure>", shown, f"<figcaption>{text(picture.caption)}</figcaption>", "</figure>"]


def data_file(file):
    """A link with the file embedded, or the name and folder of a large file."""
    size = file.stat().st_size
    text = f"{escape(file.name)} ({size / 1e3:.3g} kB)" if size < 1e6 else f"{escape(file.name)} ({size / 1e6:.3g} MB)"
    if size >= EMBEDDED:
        return f"{text}, in the folder {escape(file.parent.name)}"
    kind = "text/csv" if file.suffix == ".csv" else "application/octet-stream"
    return f'<a download="{escape(file.parent.name)}_{escape(file.name)}" href="{data_address(file, kind)}">{text}</a>'


def foot(sections):
    """The footer: machines, versions and dates of the runs."""
    origins = [one for section in sections for one in section.origins]
    machines = dict.fromkeys(f"{one['processor']} ({one['machine']})" for one in origins if one["machine"])
    dates = sorted({one["finished"][:10] for one in origins} - {""})
    versions = dict.fromkeys(", ".join(f"{name} {number}" for name, number in one["versions"].items())
                             for one in origins if one["versions"])
    lines = [f"Runs made on {escape(machine)}." for machine in machines]
    if dates:
        lines.append(f"Finished {' to '.join(dict.fromkeys([dates[0], dates[-1]]))}.")
    lines += [f"With {escape(one)}." for one in versions]
    return ["<footer>", *(f"<p>{line}</p>" for line in lines), "</footer>"]


# --- small things -----------------------------------------------------------------------------------------------------


def css(agrees):
    return VERDICTS[agrees].replace(" ", "-")


def text(words):
    """Plain text as HTML: options in a fixed font, no line breaks around the signs of formulas."""
    words = re.sub(r"(?<!\S)\+-(?=\d)", "±", words)
    words = re.sub(r"(?<=\S) ([<>≤≥=]+) (?=\S)", "\u00a0\\1\u00a0", words)
    return re.sub(r"(?<!\S)(--[a-z][\w.-]*\w)", r"<code>\1</code>", escape(words))


def counted(statements):
    """:func:`counts` as coloured HTML."""
    return counts(statements, lambda agrees, words: f'<span class="verdict {css(agrees)}">{words}</span>')


def counts(statements, show=lambda agrees, words: words):
    """Numbers of statements that agree, disagree and are undecided, without zeros: ``3 agree, 1 undecided``."""
    count = Counter(statement.agrees for statement in statements)
    return ", ".join(show(agrees, f"{count[agrees]} {word}") for agrees, word in COUNTS.items() if count[agrees])


def bare_title(section):
    """The title without a leading "Figure 14:", since the page shows that separately."""
    title = re.sub(r"^(fig\.|figure|table)\s*\d+\s*[:.,]?\s*", "", section.title, flags=re.IGNORECASE) or section.title
    return sentence(title).removesuffix(".")


def sentence(words):
    """The text with a capital letter at its start and a full stop at its end."""
    words = words.strip()
    return words[:1].upper() + words[1:] + ("" if words.endswith((".", "?", "!")) else ".")


def is_number(text):
    return re.fullmatch(r"[-+−]?[\d.,]+(e[-+]?\d+)?\s?%?", text) is not None


def data_address(file, kind):
    return f"data:{kind};base64,{base64.b64encode(file.read_bytes()).decode()}"
