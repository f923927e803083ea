"""The results of a study: rows of error and cost, the front, orders of convergence, and claims."""
import csv
import json
import math
from dataclasses import dataclass
from pathlib import Path

from pysph_boiling.evaluation.accuracy.front import Order, order, pareto, spread
from pysph_boiling.evaluation.accuracy.knobs import Study, changed, describe_settings
from pysph_boiling.report.sections import Statement
from pysph_boiling.schemes.quality import QUALITIES

__all__ = ["CLAIMS", "Findings", "Row", "find", "percent"]

CLAIMS = Path(__file__).with_name("claims.json")


@dataclass(frozen=True)
class Row:
    """One point; ``error`` is that of the front, NaN if the point failed, is the reference, or does not compete."""

    settings: str
    knobs: str
    error: float
    cost: float
    spread: float
    record: dict
    preset: str = ""


@dataclass(frozen=True)
class Findings:
    """The results of a study: rows, indices of the rows on the front, trend -> order, and claims."""

    study: Study
    rows: list
    front: list
    orders: dict
    statements: list

    def presets(self):
        """Name -> row."""
        return {row.preset: row for row in self.rows if row.preset}


def find(study, points, quick, claims=None):
    """The :class:`Findings` of a study after all of its problems were run."""
    error = errors(study, points)
    presets = study.preset_points()
    every = [(changed(study.problem, settings), describe_settings(settings), ", ".join(knobs))
             for settings, knobs in study.settings()]
    known = {problem for problem, _, _ in every}
    every += [(problem, "", "presets") for problem in dict.fromkeys(presets.values()) if problem not in known]
    promised = study.promised_points()
    if study.promised:
        every += [(problem, f"preset {name}, {describe_settings(study.promised)}", "presets")
                  for name, problem in promised.items() if problem not in known]
    rows = []
    for problem, settings, knobs in every:
        record = points.get(problem)
        names = [name for name, preset in presets.items() if preset == problem]
        cost, noise = math.nan, math.nan
        if record["seconds"]:
            cost, noise = (value / record["simulated"] if k == 0 else value
                           for k, value in enumerate(spread(record["seconds"])))
        own = error(record) if study.competes(problem, record.get("errors", {})) else math.nan
        rows.append(Row(settings or f"preset {', '.join(names)}", knobs, own, cost, noise, record, ", ".join(names)))
    orders = {}
    for trend in study.trends:
        h, values = trend_points(study, trend, points)
        try:
            orders[trend.name] = order(h, values)
        except ValueError:
            orders[trend.name] = Order(math.nan, math.nan, math.nan, 0)
    claims = json.loads(CLAIMS.read_text()) if claims is None else claims
    form = "quick" if quick else "full"
    own = [claim for claim in claims if claim["study"] == study.key and claim.get("form", form) == form]
    statements = [check(claim, study, points, orders) for claim in own]
    statements += promises(study, promised, points)
    return Findings(study, rows, pareto([row.cost for row in rows], [row.error for row in rows]), orders, statements)


def errors(study, points):
    """A function that maps a record to its error on the front."""
    if study.finest is None:
        return lambda record: size(record, study.error)
    finest = points.get(changed(study.problem, study.finest))
    best = finest.get("facts", {}).get(study.error)

    def error(record):
        value = record.get("facts", {}).get(study.error)
        return math.nan if None in (value, best) or record is finest else abs(value / best - 1.0)
    return error


def size(record, name):
    """Absolute value of an error of a record, NaN if there is none."""
    value = record.get("errors", {}).get(name)
    return math.nan if value is None else abs(value)


def trend_points(study, trend, points):
    """Values of the parameter along a :class:`Trend` (their inverses if larger is finer), and the errors."""
    problems = [changed(study.problem, settings) for settings in trend.points]
    h = [float(getattr(problem, trend.parameter)) for problem in problems]
    error = (lambda record: size(record, trend.error)) if trend.error else errors(study, points)
    return [1.0 / x if trend.finer == "larger" else x for x in h], [error(points.get(problem)) for problem in problems]


# --- claims -----------------------------------------------------------------------------------------------------------


def check(claim, study, points, orders):
    """The :class:`Statement` of one claim of ``claims.json``: an order within bounds, or an error below one."""
    if "trend" in claim:
        low, high = claim["order"]
        found = orders.get(claim["trend"], Order(math.nan, math.nan, math.nan, 0))
        return Statement(f"order of convergence, {claim['trend']}: {low:g} to {high:g}",
                         f"{found.order:.2f}{f' +- {found.spread:.2f}' if found.spread >= 0.0 else ''}, through "
                         f"{found.points} points", low <= found.order <= high, claim["why"])
    records = [points.get(changed(study.problem, settings)) for settings, knobs in study.settings()
               if not claim.get("of") or set(knobs) & set(claim["of"])]
    worst = max((size(record, claim["error"]) for record in records), key=lambda x: math.inf if math.isnan(x) else x)
    of = f" of {', '.join(claim['of'])}" if claim.get("of") else ""
    return Statement(f"{claim['error'].replace('_', ' ')} is at most {percent(claim['at_most'])}, every point{of}",
                     f"{percent(worst)} at the most, {len(records)} points", worst <= claim["at_most"], claim["why"])


def promises(study, presets, points):
    """Statements that the presets keep within the errors that they promise, at the settings of the study for that."""
    where = f", {describe_settings(study.promised)}" if study.promised else ""
    for name, problem in presets.items():
        for (key, error), bound in QUALITIES[name].stated.items():
            if key == study.key:
                value = size(points.get(problem), error)
                yield Statement(f"preset {name}: {error.replace('_', ' ')} at most {percent(bound)}{where}",
                                percent(value), value <= bound)


def percent(value):
    """An error as text in per cent."""
    if math.isnan(value):
        return "none"
    return f"{value:.1e}" if 0.0 < value < 1e-5 else f"{100.0 * value:.3g}\N{NO-BREAK SPACE}%"


def write_points(findings, path):
    """Write all rows to a CSV file; returns the file's name."""
    errors = sorted({name for row in findings.rows for name in row.record.get("errors", {})})
    facts = sorted({name for row in findings.rows for name in row.record.get("facts", {})})
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["settings", "knobs", "preset", "on the front", f"front error: {findings.study.error} [-]",
                         "wall seconds per simulated second", "half range over median", "repeats", "load",
                         "particles", "steps", *(f"error {name}" for name in errors), *facts, "failed", "problem"])
        for k, row in enumerate(findings.rows):
            record = row.record
            writer.writerow([row.settings, row.knobs, row.preset, int(k in findings.front), row.error, row.cost,
                             row.spread, len(record["seconds"]), max(record["load"], default=""),
                             record.get("particles", ""), record.get("steps", ""),
                             *(record.get("errors", {}).get(name, "") for name in errors),
                             *(record.get("facts", {}).get(name, "") for name in facts), record.get("failed", ""),
                             record["problem"]])
    return Path(path).name
