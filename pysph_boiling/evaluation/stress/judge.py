"""The rules by which a difficult case passes; their bounds are read from ``bounds.json`` before anything runs."""
import json
from fnmatch import fnmatch
from pathlib import Path

import numpy as np

__all__ = ["RULES", "bounds_of", "judge", "load_bounds"]


def load_bounds(path=None):
    """The bounds in the file: ``rules`` is name -> {bound, unit, reason}, ``exceptions`` is a list.

    Errors: ``ValueError`` for an unknown or missing rule, and for a bound without a reason.
    """
    bounds = json.loads(Path(path or Path(__file__).with_name("bounds.json")).read_text())
    wrong = set(bounds["rules"]) ^ set(RULES)
    wrong |= {entry["rule"] for entry in bounds["exceptions"]} - set(RULES)
    if wrong:
        raise ValueError(f"bounds: unknown or missing rules: {', '.join(sorted(wrong))}")
    for entry in (*bounds["rules"].values(), *bounds["exceptions"]):
        if not entry.get("reason"):
            raise ValueError(f"bounds: there is no reason for {entry}")
    return bounds


def bounds_of(name, bounds):
    """Rule -> bound of one case, ``None`` if the rule does not apply.

    Exceptions name cases by patterns and override the rules; later ones override earlier ones.
    """
    found = {rule: entry["bound"] for rule, entry in bounds["rules"].items()}
    for entry in bounds["exceptions"]:
        if any(fnmatch(name, pattern) for pattern in entry["cases"]):
            found[entry["rule"]] = entry["bound"]
    return found


def column(name, reduce=np.max, until=None, after=False, only=None, scale=None):
    """A rule that a column of the table, reduced over the steps, is at most the bound."""
    def rule(run, bound, bounds):
        if name not in run.table or (only and not only(run)) or (until and run.setup.factor > bounds[until]):
            return None
        values = np.abs(np.array(run.table[name], float)[int(bounds["settle"]) // run.setup.every if after else 0:])
        found = reduce(values) / (scale(run) if scale else 1.0) if len(values) else 0.0
        return found if not found <= bound else None

    return rule


def rise(run, bound, bounds):
    """Increase of kinetic plus potential energy since the start, over m g H."""
    if not run.setup.closed:
        return None
    found = (np.max(run.table["mechanical"]) - run.first) / run.scale
    return found if not found <= bound else None


def free_fall(run):
    """Speed [m/s] after a fall through the depth that begins with the fastest speed at the start."""
    return np.sqrt(2.0 * run.g * run.depth + run.fastest**2)


def never(run, bound, bounds):
    return None


RULES = {
    "bad": column("bad"),
    "outside": column("outside"),
    "speed": column("speed", scale=free_fall),
    "density_mean": column("density_error_mean", after=True),
    "density_max": column("density_error_max", after=True),
    "energy_residual": column("energy_residual"),
    "mass_residual": column("mass_residual"),
    "limited": column("n_limited", until="counted_until"),
    "projected": column("n_projected", until="counted_until"),
    "rise": rise,
    "counted_until": never,
    "settle": never,
}


def judge(case, run, bounds):
    """The faults of a run as a list of (rule, sentence), empty if it passes.

    A case that must be refused passes if it was refused with the right message. Any other case passes if it ran to its
    end within all bounds and its end state has no faults.
    """
    if case.refused:
        said = run.refusal or run.stopped
        if not said:
            return [("refused", f"it ran, but should have been refused with '{case.refused}'")]
        return [] if case.refused in said else [("refused", f"it was refused with '{said}', not '{case.refused}'")]
    if run.refusal:
        return [("refused", run.refusal)]
    wrong = [("stopped", run.stopped)] if run.stopped else []
    own = bounds_of(case.name, bounds)
    for rule, test in RULES.items():
        if own[rule] is not None and run.table:
            found = test(run, own[rule], own)
            if found is not None:
                wrong.append((rule, f"{rule.replace('_', ' ')} {found:.3g} > {own[rule]:g}"))
    if not run.stopped:
        wrong += [("end", sentence) for sentence in case.end(run)]
    return wrong
