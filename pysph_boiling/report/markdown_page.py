"""The same as the HTML page, in Markdown to keep beside the code: statements and tables, one picture a section.

What takes hours is made in parts, so that the report keeps what it has of the sections that are not made anew: they lie
beside it as JSON.
"""
import json
from dataclasses import asdict
from html import escape
from pathlib import Path

from pysph_boiling.report import markdown
from pysph_boiling.report.page import VERDICTS, bare_title, counts, label, sentence
from pysph_boiling.report.sections import Section
from pysph_boiling.runs.ledger import write_json

__all__ = ["take_up", "write_report"]

WIDTH = 1000  # pixels; pictures are shrunk to it
COLOURS = 128  # of a picture's palette


def stored(path):
    """Key -> section as a dict, of the report ``path``; empty where there is none."""
    record = Path(path).with_suffix(".json")
    return json.loads(record.read_text(encoding="utf-8")) if record.exists() else {}


def take_up(path, root):
    """Put what the report ``path`` has of figures that the folder ``root`` lacks there, for figures that read others.

    Pictures and data stay behind: a report does not keep them whole.
    """
    for key, raw in stored(path).items():
        folder = Path(root) / key
        if not (folder / "section.json").exists():
            folder.mkdir(parents=True, exist_ok=True)
            Section.revived({**raw, "pictures": [], "data": []}).save(folder)


def write_report(sections, root, path, order, *, wording, quick=False):
    """Write or amend the report ``path`` (Markdown) by ``sections``, whose files lie in ``root/<key>``; returns it.

    ``order`` has the keys that a report may have; the rest is as for the page. The sections go to a JSON file of
    that name, the first PNG picture of each into the folder ``images`` beside it.
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
    """Copy a picture, at most ``WIDTH`` wide and with ``COLOURS`` colours."""
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
    yield (f"{intro} The page that `pysph-boiling {wording.command}` writes has all pictures and data."
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
            yield rows((*wording.sides, "verdict"), [
                (sentence(one.paper), " ".join(filter(None, (sentence(one.ours), one.why and sentence(one.why)))),
                 VERDICTS[one.agrees]) for one in section.statements])
        for one in section.tables:
            yield plain(sentence(one.caption)) if one.caption else ""
            yield rows(one.columns, one.rows)
        made = sorted({f"{one['processor']}, pysph_boiling {one['versions'].get('pysph_boiling', '')}"
                       for one in section.origins})
        runs = [f"{len(set(section.commands))} runs"] * bool(section.commands)
        yield ", ".join((*runs, *made)) + "." if made else ""


def plain(words):
    """Words on one line, with nothing in them that is taken for HTML."""
    return escape(" ".join(str(words).split()), quote=False)


def rows(columns, cells):
    """A table of plain words."""
    return markdown.table(map(plain, columns), (map(plain, row) for row in cells))
