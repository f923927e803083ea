"""Every scene in a small form, made but not compiled."""
from pysph_boiling.examples import scene_class
from pysph_boiling.runs.ledger import Ledger

__all__ = ["SMALL", "built"]

POOL = ["--flat", "--width", "12", "--fill", "8"]
BUBBLE = ["--flat", "--width", "14", "--fill", "30"]
SMALL = {  # scene -> options that make it small
    "steady_boiling": [*POOL, "--sites", "2"], "superheat_sites": [*POOL, "--sites", "2"],
    "cooling": [*POOL, "--sites", "2"], "rolling_boil": [*POOL, "--sites", "2"],
    "explosive_boiling": POOL, "bubble_rise": BUBBLE, "bubble_held": BUBBLE,
    "bubble_merge": BUBBLE, "bubble_split": BUBBLE, "dam_break": ["--quick"], "heated_slab": [],
    "geyser": ["--flat", "--chamber", "5", "--chamber-height", "4", "--pool", "6", "--vent-height", "4", "--sky", "6"],
    "vessel": ["--radius", "0.016", "--sites", "2"]}


def built(name, *options):
    """A scene made, but not compiled, with its small form and some options."""
    application = scene_class(name)()
    application.set_args([*SMALL[name], *options])
    application._parse_command_line(force=True)
    application._prepare()
    application.particles = application.prepared
    application.scheme.arrays = [pa for pa in application.particles if pa.name in application.scheme.fluids]
    application.ledger = Ledger(application.scheme)
    return application
