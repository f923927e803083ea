"""A report in Markdown, to be kept with the code: statements and tables, with one picture per section.

All results of a report can take hours, so it may be made in parts: sections that are not made again are kept from the
JSON file beside the report.
"""
import json
from dataclasses import asdict
from html import escape
from pathlib import Path

from pysph_boiling.report import markdown
from pysph_boiling.report.page import VERDICTS, bare_title, basis, counts, label, sentence
from pysph_boiling.report.sections import Section
from pysph_boiling.runs.ledger import write_json

__all__ = ["take_up", "write_report"]

WIDTH = 1000  # largest width of a picture [pixel]
COLOURS = 128  # colours in the palette of a picture


def stored(path):
    """Key -> section (a dict) of an existing report ``path``; empty if there is none."""
    record = Path(path).with_suffix(".json")
    return json.loads(record.read_text(encoding="utf-8")) if record.exists() else {}


def take_up(path, root):
    """Write sections of the report ``path`` that the folder ``root`` lacks to it, for figures that depend on others.

    Pictures and data are left out, since a report does not keep all of them.
    """
    for key, raw in stored(path).items():
        folder = Path(root) / key
        if not (folder / "section.json").exists():
            folder.mkdir(parents=True, exist_ok=True)
            Section.revived({**raw, "pictures": [], "data": []}).save(folder)


def write_report(sections, root, path, order, *, wording, quick=False):
    """Write the report ``path`` (Markdown), or update it with ``sections``, whose files are in ``root/<key>``.

    ``order`` lists the keys of all possible sections; ``wording`` and ``quick`` are those of the HTML page. The
    sections are also written to a JSON file of the same name, and the first PNG picture of each to the folder
    ``images`` beside it. Returns ``path``.
    """
    path = Path(path)
    kept = stored(path)
    images = path.parent / "images"
    images.mkdir(parents=True, exist_ok=True)
    for section in sections:
        first = next((one for one in section.pictures if one.file.endswith(".png")), None)
        if first:
            shrink(Path(root) / section.key / first.file, images / f"{path.stem}_{section.key}.png")
        kept[section.key] = {**asdict(section), "pictures": [asdict(first)] if first else []}
    kept = {key: kept[key] for key in order if key in kept}
    write_json(path.with_suffix(".json"), kept)
    everything = [Section.revived(raw) for raw in kept.values()]
    return markdown.write(path, *blocks(everything, path.stem, quick, wording))


def shrink(source, target):
    """Copy a picture, reduced to at most ``WIDTH`` pixels in width and ``COLOURS`` colours."""
    from PIL import Image

    with Image.open(source) as picture:
        picture = picture.convert("RGB")
        picture.thumbnail((WIDTH, 10 * WIDTH), Image.Resampling.LANCZOS)
        picture.quantize(COLOURS).save(target, optimize=True)


def blocks(sections, stem, quick, wording):
    """The blocks of the report, for :func:`pysph_boiling.report.markdown.page`."""
    total = [one for section in sections for one in section.statements]
    intro = wording.intro.replace("{form}", wording.quick if quick else "")
    yield f"# {wording.title}"
    yield f"<!-- Written by `pysph-boiling {wording.command} --report docs/{stem}.md`; do not edit. -->"
    yield (f"{intro} The HTML page that `pysph-boiling {wording.command}` writes has all pictures and data."
           + f" Of {len(total)} {wording.counted}, {counts(total)}." * bool(total))
    yield rows(("", "", ""), [(label(section.key) or section.key, bare_title(section), counts(section.statements))
                              for section in sections])
    for section in sections:
        yield f"## {label(section.key) or section.key}: {plain(bare_title(section))}"
        caveat = plain(wording.caveat(section))
        yield f"**{caveat}**" if caveat else ""
        yield plain(section.text)
        for picture in section.pictures:
            caption = plain(sentence(picture.caption))
            yield f"![{caption}](images/{stem}_{section.key}.png)"
            yield f"*{caption}*"
        if section.statements:
            table = [(sentence(one.paper), basis(section, one),
                      " ".join(filter(None, (sentence(one.ours), one.why and sentence(one.why)))),
                      VERDICTS[one.agrees]) for one in section.statements]
            shown = [k for k in range(4) if k != 1 or any(row[1] for row in table)]
            columns = (wording.sides[0], "judged on", wording.sides[1], "verdict")
            yield rows([columns[k] for k in shown], [[row[k] for k in shown] for row in table])
        for one in section.tables:
            yield plain(sentence(one.caption)) if one.caption else ""
            yield rows(one.columns, one.rows)
        made = sorted({f"{one['processor']}, pysph_boiling {one['versions'].get('pysph_boiling', '')}"
                       for one in section.origins})
        runs = [f"{len(set(section.commands))} runs"] * bool(section.commands)
        yield ", ".join((*runs, *made)) + "." if made else ""


def plain(words):
    """Text on one line, with HTML characters escaped."""
    return escape(" ".join(str(words).split()), quote=False)


def rows(columns, cells):
    """The lines of a table of plain text."""
    return markdown.table(map(plain, columns), (map(plain, row) for row in cells))
