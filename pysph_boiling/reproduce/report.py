"""The same as the HTML page, in Markdown to keep beside the code: statements and tables, one picture a figure.

A reproduction takes hours and is made in parts, so that the report keeps what it has of the figures that are not made
anew: its sections lie beside it as JSON.
"""
import json
from dataclasses import asdict
from html import escape
from pathlib import Path

from pysph_boiling import markdown
from pysph_boiling.analysis.ledger import write_json
from pysph_boiling.reproduce.figure import Section, figures
from pysph_boiling.reproduce.page import VERDICTS, bare_title, counts, label, sentence

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


def write_report(sections, root, path):
    """Write or amend the report ``path`` (Markdown) by ``sections``, whose files lie in ``root/<key>``; returns it.

    The sections go to a JSON file of that name, the first PNG picture of each into the folder ``images`` beside it.
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
    kept = {key: kept[key] for key in figures() if key in kept}
    write_json(path.with_suffix(".json"), kept)
    everything = [Section.revived(raw) for raw in kept.values()]
    path.write_text("\n".join(lines(everything, path.stem)), encoding="utf-8")
    return path


def shrink(source, target):
    """Copy a picture, at most ``WIDTH`` wide and with ``COLOURS`` colours."""
    from PIL import Image

    with Image.open(source) as picture:
        picture = picture.convert("RGB")
        picture.thumbnail((WIDTH, 10 * WIDTH), Image.Resampling.LANCZOS)
        picture.quantize(COLOURS).save(target, optimize=True)


def lines(sections, stem):
    """The lines of the report."""
    total = [one for section in sections for one in section.statements]
    text = ["# The paper, reproduced: what came out", "",
            f"<!-- Written by `pysph-boiling reproduce --report docs/{stem}.md`; do not edit. -->", "",
            "Each figure and table of *Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation*, "
            "next to what the full form of `pysph-boiling reproduce` shows for it. Boiling is chaotic: figures over "
            "several seeds are mean (lowest to highest). The page that the command writes has all pictures, movies "
            f"and data. Of {len(total)} statements, {counts(total)}.", ""]
    text += rows(("", "", ""), [(label(section.key), bare_title(section), counts(section.statements))
                                for section in sections])
    for section in sections:
        text += [f"## {label(section.key)}: {plain(bare_title(section))}", ""]
        if section.text:
            text += [plain(section.text), ""]
        for picture in section.pictures:
            caption = plain(sentence(picture.caption))
            text += [f"![{caption}](images/{stem}_{section.key}.png)", "", f"*{caption}*", ""]
        if section.statements:
            text += rows(("the paper", "ours", "verdict"), [
                (sentence(one.paper), " ".join(filter(None, (sentence(one.ours), one.why and sentence(one.why)))),
                 VERDICTS[one.agrees]) for one in section.statements])
        for one in section.tables:
            text += [plain(sentence(one.caption)), ""] * bool(one.caption) + rows(one.columns, one.rows)
        made = {(one["processor"], one["versions"].get("pysph_boiling", "")) for one in section.origins}
        text += [f"{len(set(section.commands))} runs" + "".join(
            f", {processor}, pysph_boiling {version}" for processor, version in sorted(made)) + ".", ""] * bool(made)
    return text


def plain(words):
    """Words on one line, with nothing in them that is taken for HTML."""
    return escape(" ".join(str(words).split()), quote=False)


def rows(columns, cells):
    """A table of plain words, and an empty line."""
    return [*markdown.table(map(plain, columns), (map(plain, row) for row in cells)), ""]
