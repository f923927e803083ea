"""The HTML page: one file that holds its pictures and movies and opens from disk."""
import base64
from html import escape
from pathlib import Path

__all__ = ["write_page"]


def write_page(sections, root, *, quick=False):
    """Write ``index.html`` into ``root`` from the sections, whose files lie in ``root/<key>``; returns its path."""
    parts = ["<!doctype html><meta charset=utf-8><title>pysph_boiling: the paper, reproduced</title>"]
    for section in sections:
        parts.append(f"<h2 id={section.key}>{escape(section.title)}</h2>")
        for picture in section.pictures:
            raw = base64.b64encode((Path(root) / section.key / picture.file).read_bytes()).decode()
            parts.append(f'<figure><img src="data:image/png;base64,{raw}"><figcaption>{escape(picture.caption)}'
                         "</figcaption></figure>")
        for statement in section.statements:
            parts.append(f"<p>{escape(statement.paper)}: {escape(statement.ours)}: {statement.agrees}</p>")
    path = Path(root) / "index.html"
    path.write_text("\n".join(parts), encoding="utf-8")
    return path
