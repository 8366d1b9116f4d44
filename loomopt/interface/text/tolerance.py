"""Machines as they are made, for people: how figures spread, which limits hold how often, what to tighten first."""

import math
from typing import TYPE_CHECKING

from loomopt.base.units import factor
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.picture.table import TextTable
from loomopt.scenes.provenance import provenance
from loomopt.solving.answer.solution import Words
from loomopt.studies.tolerance.study import ALL, Found, Spread

if TYPE_CHECKING:
    import pandas as pd

LEAST_SHARE = 0.005
"""Of a figure's variance: what is not told in a terminal."""
MOST_TOLD = 3
"""Numbers whose shares are told."""


def parts(found: Found) -> list[str | TextTable]:
    """Return the parts of a study in a terminal: spreads, yields, and what to tighten first."""
    plan = found.plan
    numbers = ", ".join(each.number for each in plan.made.values())
    head = f"{plan.scene.name}, limits of {plan.target}: {found.samples} machines, {numbers} as they are made"
    lost = f"{found.bad} of them do not assemble or lack a figure" if found.bad else "all of them assemble"
    worst: list[str | TextTable] = [_worst(found)] if found.worst else []
    return [f"{head}; {lost}", _spreads(found), _yields(found), *worst, *_told(found)]


def _spreads(found: Found) -> TextTable:
    words, lines = Words(found.plan.scene), []
    for name, each in found.figures.items():
        unit = words.unit(name)
        size = factor(unit)
        sigma = each.sigma / size
        nominal = 0.0 if abs(each.nominal) <= SHOWN_AS_ZERO * each.sigma else each.nominal / size
        shown = (f"{nominal:.6g}", _size(each.sigma_linear / size), _size(sigma))
        lines.append((name, *shown, "" if unit == "1" else unit, _shares(each)))
    heads = ("figure", "nominal", "sigma\nlinear", "sigma\nsampled", "unit", "shares")
    return TextTable("", heads, tuple(lines), (1, 2, 3), first=(0, 1, 3, 4, 2), more="--json")


def _size(value: float) -> str:
    return "0" if value == 0.0 else f"{value:.4g}"


def _shares(each: Spread) -> str:
    told = sorted(each.shares.items(), key=lambda pair: -pair[1])[:MOST_TOLD]
    text = ", ".join(f"{name} {100 * share:.3g} %" for name, share in told if share >= LEAST_SHARE)
    return f"{text} (a corner)" if each.corner and text else text


def _yields(found: Found) -> TextTable:
    lines = []
    for name, each in found.yields.items():
        called = "all together" if name == ALL else name
        lines.append((called, f"{100 * each.value:.4g}", f"{100 * each.se:.2g}"))
    return TextTable("", ("machines that hold", "%", "standard error\n%"), tuple(lines), (1, 2), more="--json")


def _worst(found: Found) -> TextTable:
    """Return the worst cases: the least and the most of each figure within the tolerances, and whether it is proven."""
    words, lines = Words(found.plan.scene), []
    for name, each in found.worst.items():
        unit = words.unit(name)
        size = factor(unit)
        sides = zip((each.min, each.max), each.found, (-1.0, 1.0), ("or less", "or more"), strict=True)
        shown = [_end(end, beyond, size, sign, more) for end, beyond, sign, more in sides]
        lines.append((name, *shown, "" if unit == "1" else unit, "proven" if each.proven else each.why))
    heads = ("within all tolerances", "at least", "at most", "unit", "")
    return TextTable("", heads, tuple(lines), (1, 2), first=(0, 1, 2, 4, 3), more="--json")


def _end(end: float | None, found: float, size: float, sign: float, more: str) -> str:
    """Return a proven end, outward of itself; of one that is undecided the farthest machine."""
    if end is not None:
        return _outward(end / size, sign)
    return f"{found / size:.{DIGITS}g} {more}" if math.isfinite(found) else ""


DIGITS = 7
"""Digits of a worst case: more than its gap has."""


def _outward(value: float, sign: float) -> str:
    """Return the nearest number of so many digits that is no less, or no more, than a value."""
    if value == 0.0:
        return "0"
    step = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - DIGITS)
    return f"{(math.ceil if sign > 0 else math.floor)(value / step) * step:.{DIGITS}g}"


def _told(found: Found) -> list[str]:
    first = [f"{name} ({100 * share:.3g} %)" for name, share in found.tighten[:MOST_TOLD] if share >= LEAST_SHARE]
    lost = any(found.yields[each.name].value < 1.0 for each in found.plan.judged)
    of = "what is lost" if lost else "what is sought spreads by; no machine that was drawn is lost"
    said = [f"Tighten first: {', '.join(first)} of {of}."] if first else []
    names = found.plan.unjudged
    if names:
        said.append(f"No machine is judged by {', '.join(names)}, an equality or a goal: [accept] gives it a band.")
    return said


def frame(found: Found, si: bool) -> "pd.DataFrame":
    """Return one line per figure with its spread and shares; si: in SI, else in the scene's own units."""
    import pandas as pd

    words, rows = Words(found.plan.scene), []
    for name, each in found.figures.items():
        unit = words.si(name) if si else words.unit(name)
        size = factor(unit)
        rows.append(
            {
                "figure": name,
                "unit": unit,
                "nominal": each.nominal / size,
                "sigma_linear": each.sigma_linear / size,
                "sigma": each.sigma / size,
                **_ends(found, name, size),
                **{f"share {number}": share for number, share in each.shares.items()},
            }
        )
    table = pd.DataFrame(rows)
    table.attrs |= provenance(found.plan.scene, samples=found.samples, seed=found.plan.seed)
    return table


def _ends(found: Found, name: str, size: float) -> dict[str, float]:
    """Return the proven ends of a figure, none of one whose worst case is not asked for, or undecided."""
    if not found.worst:
        return {}
    each = found.worst.get(name)
    ends = {"worst min": each.min if each else None, "worst max": each.max if each else None}
    return {head: math.nan if end is None else end / size for head, end in ends.items()}
