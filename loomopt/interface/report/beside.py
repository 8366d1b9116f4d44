"""The parts of a page on what was computed beside an answer: the terminal's tables, and a chart of what they tell."""

import math
from collections.abc import Iterator

import numpy as np

from loomopt.base.units import factor
from loomopt.interface.report.charts import COLOURS, Axis, Bars, Chart, Series, bars, figure, headed, ticks
from loomopt.interface.report.markup import Block, Markup, Part
from loomopt.interface.report.turn import TICKS, thinned
from loomopt.interface.text import budget as budget_text
from loomopt.interface.text import effects as effects_text
from loomopt.interface.text import sensitivity as sensitivity_text
from loomopt.interface.text import tolerance as tolerance_text
from loomopt.physics.cycle import TURN
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.solving.answer.solution import Words
from loomopt.studies import budget as torque
from loomopt.studies.effects import study as worth
from loomopt.studies.sensitivity import study as derivatives
from loomopt.studies.tolerance import study as machines
from loomopt.studies.tolerance.study import BINS, REACH

MOST = 20
"""Bars of a chart at most."""


def _charts(drawn: Iterator[str]) -> list[Block]:
    told = "".join(drawn)
    return [Markup(f'<div class="charts">{told}</div>')] if told else []


def budget(found: torque.Found) -> list[Part]:
    """Return where the crank torque comes from."""
    drawn = _charts(iter([figure(_shares(found))]))
    return [Part("Where the crank torque comes from", (*drawn, *budget_text.parts(found)))]


def _shares(found: torque.Found) -> Chart:
    """Draw each effect's share over the turn, and their sum."""
    own, unit, shown = found.found, found.scene.shown_in("torque"), found.scene.shown_in("angle")
    size, angle = factor(unit), factor(shown)
    kept = thinned(np.degrees(own.phi))
    phi = own.phi[kept] / angle
    names = list(own.curves)
    series = [
        Series(phi, own.curves[name][kept] / size, f"c{(place + 1) % COLOURS}", name)
        for place, name in enumerate(names)
    ]
    total = Series(phi, np.sum([own.curves[name][kept] for name in names], axis=0) / size, "c0", "crank torque")
    step = math.radians(TICKS)
    numbered = [step * k / angle for k in range(round(TURN / step) + 1)]
    peak = f"peak {found.scene.show(own.total.at_peak, 'torque')}"
    return Chart(
        headed("torque", unit),
        Axis(float(phi.min()), float(phi.max()), numbered),
        [*series, total],
        dots=[(own.angle / angle, own.total.at_peak / size, "c0")],
        key=[*((each.kind, each.label) for each in (total, *series)), ("dot c0", peak)],
        cursor=True,
    )


def tolerance(found: machines.Found) -> list[Part]:
    """Return how machines spread as they are made."""
    return [Part("Machines as they are made", (*_charts(_histograms(found)), *tolerance_text.parts(found)))]


def _histograms(found: machines.Found) -> Iterator[str]:
    """Draw how each figure spreads that judges machines or is sought; what no machine may have is shaded."""
    words, judged = Words(found.plan.scene), {each.name: each for each in found.plan.judged}
    for name in dict.fromkeys([*judged, *(level.figure for level in found.plan.program.objectives)]):
        each = found.figures.get(name)
        if each is None or not each.sigma or not each.sigma_linear:
            continue
        unit, own = words.unit(name), judged.get(name)
        edges = (each.nominal + REACH * each.sigma_linear * np.linspace(-1, 1, BINS + 1)) / factor(unit)
        low, high = float(edges[0]), float(edges[-1])
        shares = np.array(each.counts) / found.samples * 100
        steps = Series(np.repeat(edges, 2), np.concatenate([[0.0], np.repeat(shares, 2), [0.0]]), "c0")
        least, most = (
            None if end is None else min(max(end / factor(unit), low), high)
            for end in ((own.low, own.high) if own else (None, None))
        )
        outside = [(low, least)] if least is not None and least > low else []
        outside += [(most, high)] if most is not None and most < high else []
        nominal = 0.0 if abs(each.nominal) <= SHOWN_AS_ZERO * each.sigma else each.nominal
        key = [("k-place", f"nominal {words.shown(name, nominal)}")]
        key += [("k-span", f"does not hold; {100 * found.yields[name].value:.4g} % hold")] if outside else []
        yield figure(
            Chart(
                f"machines [%] over {headed(name, unit)}",
                Axis(low, high, ticks(low, high, 4)),
                [steps],
                spans=outside,
                places=[nominal / factor(unit)],
                key=key,
            )
        )


def sensitivity(found: derivatives.Found) -> list[Part]:
    """Return how the optimum moves with every number."""
    drawn = _charts(bars(_tornado(found, name)) for name in sensitivity_text.sought(found))
    return [Part("How the optimum moves with each number", (*drawn, *sensitivity_text.parts(found)))]


def _tornado(found: derivatives.Found, name: str) -> Bars:
    lines = sensitivity_text.lines(found, name)[:MOST]
    title = f"{headed(name, Words(found.scene).unit(name))}, by one sigma of a number or by 1 %"
    return Bars(title, [(number, (moved,)) for number, moved in lines])


def effects(found: worth.Found) -> list[Part]:
    """Return what each effect is worth."""
    drawn = _charts(bars(_worth(found, name)) for name in (found.reference.scales if found.rows else ()))
    return [Part("What each effect is worth", (*drawn, *effects_text.parts(found)))]


def _worth(found: worth.Found, name: str) -> Bars:
    lines = [
        (
            f"{row.effect}{' (may go)' if row.effect in found.left_out else ''}",
            tuple(None if each is None else 100 * each for each in (row.shift.get(name), row.regret.get(name))),
        )
        for row in found.rows
    ]
    told = ("shift without it", "regret of the design found without it")
    return Bars(f"{name} without an effect, % of its natural size", lines, told)
