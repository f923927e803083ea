"""The help of a scene by topic: a short one, one for all effects, one for each effect, and one for PySPH's options."""
import argparse
import dataclasses
import shutil
import textwrap

from pysph_boiling.names import Parser, option, unknown
from pysph_boiling.schemes.effects import EFFECTS

__all__ = ["MAIN", "SceneParser"]

# Group -> the options that plain --help shows, beside the variants of the scene.
MAIN = {
    "duration and output": ("--duration", "--frame", "--seed", "--directory", "--resume", "--post-process",
                            "--no-pictures", "--quiet", "--disable-output", "--results-every"),
    "accuracy": ("--quality", "--spacing", "--substeps"),
    "model": ("--material", "--mode", "--effects", "--forms", "--describe"),
    "machine": ("--no-openmp", "--opencl", "--cuda", "--no-lean"),
}
TOPICS = {
    "scene": "the parameters of this scene",
    "effects": "the effects, one line each",
    "NAME": "the parameters of one effect, such as heat",
    "pysph": "the options of PySPH",
    "all": "everything",
}
WIDTH = 100  # of the text, at most


class Formatter(argparse.HelpFormatter):
    """argparse's formatter, which does not break the names of options at their hyphens."""

    def __init__(self, prog):
        super().__init__(prog, max_help_position=30, width=min(WIDTH, shutil.get_terminal_size().columns - 2))

    def _split_lines(self, text, width):
        return textwrap.wrap(" ".join(text.split()), width, break_on_hyphens=False)

    def _fill_text(self, text, width, indent):
        return "\n".join(indent + line for line in self._split_lines(text, width - len(indent)))


class Help(argparse.Action):
    """``--help [TOPIC]``."""

    def __call__(self, parser, namespace, values, option_string=None):
        print(parser.text(values), end="")
        parser.exit()


class SceneParser(Parser):
    """The parser of a scene. PySPH makes it; :meth:`take_over` gives it this class.

    ``pysph`` are the names of PySPH's options, and ``scheme`` is that of the scene, whose values the help shows.
    """

    def take_over(self, pysph, scheme):
        self.pysph, self.scheme = set(pysph), scheme
        self.formatter_class = Formatter
        self.add_argument_group(conflict_handler="resolve").add_argument(
            "-h", "--help", action=Help, dest=argparse.SUPPRESS, default=argparse.SUPPRESS, nargs="?", metavar="TOPIC",
            help="this help, or that on a topic")

    @property
    def slots(self):
        """The slots whose effects have options."""
        return tuple(getattr(self.scheme, "slots", ()))

    @property
    def effects(self):
        """Slot -> effect of this scene."""
        return getattr(self.scheme, "effects", {})

    def listed(self):
        """All options that work, in order."""
        return [action for action in self._actions if action.help != argparse.SUPPRESS]

    def topic_of(self, action):
        """The topic of an option: "scene", "pysph", "main", or the slot of an effect."""
        if self.pysph & set(action.option_strings):
            return "pysph"
        slot = action.dest.partition(".")[0]
        if slot in self.slots:
            return slot
        return "main" if slot != "scene" and any(action.option_strings[-1] in flags for flags in MAIN.values()) else \
            "scene"

    def format_help(self):
        return self.text(None)

    def text(self, topic):
        """The help on a topic; ends the command with the topics there are for an unknown one."""
        if topic is None:
            return self.short()
        name = topic.lstrip("-").removeprefix("no-").replace("-", "_")
        if name == "effects" and self.slots:
            return self.all_effects()
        if name in self.slots:
            return self.one_effect(name)
        own = {"scene": f"parameters of {self.prog.split()[-1]}", "pysph": "options of PySPH (docs/options.md)",
               "main": "options of every scene"}
        if name == "all":
            parts = [(title, self.of(topic)) for topic, title in own.items()]
            return self.formatted([*parts, *((self.title(slot), self.of(slot)) for slot in self.slots)])
        if name in ("scene", "pysph") and self.of(name):
            return self.formatted([(own[name], self.of(name))])
        known = [one for one in ("scene", "pysph", "all") if one == "all" or self.of(one)]
        known += ["effects", *self.slots] if self.slots else []
        self.error(str(unknown("topic of the help", topic, known)))

    def of(self, topic):
        """The options of a topic."""
        return [action for action in self.listed() if self.topic_of(action) == topic]

    def formatted(self, sections, description=None):
        """Text of sections (title, options)."""
        formatter = self._get_formatter()
        formatter.add_text(description)
        for title, actions in sections:
            formatter.start_section(title)
            formatter.add_arguments(actions)
            formatter.end_section()
        return formatter.format_help()

    def short(self):
        """The options that most users need."""
        actions = {name: action for action in self.listed() for name in action.option_strings}
        own = self.of("scene")
        variants = [action for action in own if action.dest == "variant"]
        shown = {title: [actions[flag] for flag in flags if flag in actions] for title, flags in MAIN.items()}
        given = [action for action in own if action not in variants and not any(action in group for group in
                                                                                shown.values())]
        topics = {name: text for name, text in TOPICS.items()
                  if (name not in ("effects", "NAME") or self.slots) and (name != "scene" or given)}
        formatter = self._get_formatter()
        formatter.add_usage(self.usage, self._actions, self._mutually_exclusive_groups)
        formatter.add_text(self.description)
        text = formatter.format_help()
        text += "\n" + self.formatted([*([("forms of the scene", variants)] if variants else []), *shown.items()])
        if given:
            formatter = self._get_formatter()
            formatter.start_section("parameters of the scene")
            formatter.add_text(", ".join(action.option_strings[-1] for action in given))
            formatter.end_section()
            text += "\n" + formatter.format_help()
        return text + "\nmore help:\n" + "".join(f"  --help {name:8} {what}\n" for name, what in topics.items())

    def title(self, slot):
        """The slot and the titles of its effects."""
        return f"{slot} ({' or '.join(cls.title for cls in EFFECTS[slot])})"

    def all_effects(self):
        """One line for each effect: its switch, whether this scene has it, its title, and its parameters."""
        wide = max(len(option(slot)) for slot in self.slots)
        lines = [f"  {option(slot):{wide}}  {'on ' if slot in self.effects else 'off'}  "
                 f"{' or '.join(cls.title for cls in EFFECTS[slot])}" for slot in self.slots]
        return "\n".join(["effects, and whether this scene has them:", *lines, "",
                          "--heat switches an effect on, --no-heat off, and --help heat lists its parameters.", ""])

    def one_effect(self, slot):
        """The parameters of an effect, with unit, bounds and default, and what this scene makes of it."""
        text = self.formatted([(self.title(slot), self.of(slot))])
        effect = self.effects.get(slot)
        if effect is None:
            return f"{text}\nThis scene leaves it out.\n"
        own = [f"{option(f'{slot}.{spec.name}')} {getattr(effect, spec.name)}" for spec in dataclasses.fields(effect)
               if "unit" in spec.metadata and getattr(effect, spec.name) != spec.default]
        here = f"This scene has it, with {', '.join(own) or 'its defaults'}."
        return f"{text}\n{textwrap.fill(here, WIDTH, break_on_hyphens=False)}\n"

    def meant(self, flag):
        name = flag.lstrip("-").removeprefix("no-").replace("-", "_").partition(".")[0]
        if self.slots and name in EFFECTS and name not in self.slots:
            return f"; the scheme of this scene has no effect '{name}'"
        found = super().meant(flag)
        slot = next((slot for slot in self.slots if f"'{option(slot)}." in found), None)
        return f"{found} --help {slot.replace('_', '-')} lists the parameters of this effect" if slot else found

