"""Our docstrings for Sphinx: a parameter stands on one line with its meaning, as does what an equation reads."""
import dataclasses
import re

__all__ = ["parameters", "setup", "spread"]

PARAMETER = re.compile(r"( *)(\w[\w, ]* : \S.*?|\*\*\w+|\w+(?:, \w+)*) {2,}(\S.*)")
LABELS = "Reads and writes|Reads|Writes|Needs|Errors|Limits"
LABELLED = re.compile(rf"(?:{LABELS})(?: {{2,}}| nothing)")


def spread(lines):
    """Lines of a docstring as numpydoc has them: meanings under their parameters, and the rest as notes.

    What an equation reads and writes, what it needs and its errors become a list of fields.
    """
    done, lines, among_parameters = [], list(lines), False
    while lines:
        line = lines.pop(0)
        label, parameter = LABELLED.match(line), PARAMETER.fullmatch(line)
        if parameter and not label:
            indent, name, meaning = parameter.groups()
            while lines and re.match(rf"{indent} +\S", lines[0]):
                meaning += " " + lines.pop(0).strip()
            done += [indent + name, f"{indent}    {meaning}"]
            continue
        if among_parameters and re.match(r"\w(?!.* : )", line):
            done += ["Notes", "-----"]
            among_parameters = False
        if label:
            while lines and lines[0].strip():
                line += "\n" + lines.pop(0)
            fields = re.split(rf"(?:^|(?<=\n)| {{2,}})({LABELS})\b *", line)[1:]
            done += [f":{label}: {' '.join(text.split())}" for label, text in zip(fields[::2], fields[1::2])]
            continue
        done.append(line)
        among_parameters |= done[-2:] == ["Parameters", "----------"]
    return done


def parameters(cls):
    """Lines that document the fields of a dataclass which :func:`pysph_boiling.schemes.effects.param` made."""
    lines = []
    for field in dataclasses.fields(cls):
        if "meaning" in field.metadata:
            unit = "" if field.metadata["unit"] == "-" else f" [{field.metadata['unit']}]"
            default = "" if field.default in (dataclasses.MISSING, None) else f"; default {field.default}"
            meaning = re.sub(r"([|*_])", r"\\\1", field.metadata["meaning"])
            lines += [f"{field.name}", f"    {meaning}{unit}{default}"]
    return ["", "Parameters", "----------", *lines] if lines else []


def setup(app):
    """Connect :func:`spread` and :func:`parameters` before Napoleon, which reads numpydoc."""
    def process(app, what, name, obj, options, lines):
        lines[:] = spread(lines)
        if what == "class" and dataclasses.is_dataclass(obj):
            lines += parameters(obj)

    app.connect("autodoc-process-docstring", process, priority=400)
    return {"parallel_read_safe": True}
