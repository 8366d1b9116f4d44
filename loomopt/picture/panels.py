"""Panels of a figure of curves: groups of columns, names, marks and limits."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from loomopt.base.records import Frozen
from loomopt.base.units import SI_UNIT
from loomopt.maths import systems
from loomopt.model.curves import ANGLE, COLUMN, POWER, drive_name, load_name, split
from loomopt.model.drive import MOTOR, SPEED
from loomopt.model.drive import POWER as PEAK_POWER
from loomopt.model.model import COMPONENTS, read_at
from loomopt.model.sampling import Sampler
from loomopt.physics.effects.kinds import Check, Load, Speed, State
from loomopt.scenes.scene import Scene
from loomopt.scenes.tables import LimitRange

EXTREMES = ("peak", "most", "least")
"""Marks of a curve: its largest magnitude, its largest and its least value."""
BY_EFFECT, DRIVE = "by effect", "on the crank, by effect"
"""Panels that the loads' terms share."""
ORDERS = 3
"""Derivatives of a motion that have columns."""
_KIND = {unit: kind for kind, unit in SI_UNIT.items() if kind != "angular speed"}
"""SI unit → kind of quantity; what swings is shown in rad/s, whatever the shafts' unit."""


class Curve(NamedTuple):
    """Name of a column, and the figures among its extremes.

    panel: what comes behind "torques" or "angles" where several share a panel, one of its own without it. peak, most,
    least: figures that are its largest magnitude, its largest and its least value. at: mark → the figure that is its
    value there. wide: see `Panel`. shown: whether it is.
    """

    name: str = ""
    panel: str = ""
    peak: str = ""
    most: str = ""
    least: str = ""
    at: Mapping[str, str] = Frozen()
    wide: bool = False
    shown: bool = True


class Panel(NamedTuple):
    """One panel: columns of one unit, such as "N [N]", in order, and their names.

    marked: of EXTREMES, or marks of the figure at which the value is. levels: what a horizontal line says → where
    it stands, SI. wide: across the whole figure, above the others. unit: in which it is shown, SI without one.
    """

    columns: tuple[str, ...]
    name: str = ""
    names: tuple[str, ...] = ()
    marked: tuple[str, ...] = ()
    levels: Mapping[str, tuple[float, ...]] = Frozen()
    wide: bool = False
    unit: str = ""

    @property
    def si(self) -> str:
        """The columns' unit, SI."""
        return split(self.columns[0])[1]

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the columns."""
        return self.names or tuple(_column_title(column, Curve()) for column in self.columns)

    @property
    def title(self) -> str:
        """Name of the panel, or else of its only column."""
        return self.name or self.labels[0]

    @property
    def shown_unit(self) -> str:
        """Unit in which the panel is shown."""
        return self.unit or ("deg" if self.si == "rad" else self.si)


def in_units(scene: Scene, panel: Panel) -> Panel:
    """Panel in the scene's unit for its kind of quantity."""
    kind = _KIND.get(panel.si)
    return panel._replace(unit=scene.shown_in(kind) if kind else panel.si)


def arrange(
    scene: Scene, design: Mapping[str, float], columns: Sequence[str], words: Mapping[str, Curve]
) -> tuple[Panel, ...]:
    """Panels of all columns, limits as levels; effects share theirs, and a motion is shown per second.

    words: what is known of columns, by name; of name_1, name_2 it holds for name_t, name_tt too.
    """
    known = {split(column)[0]: column for column in columns if COLUMN.fullmatch(column) and column != ANGLE}
    speed = design.get("speed", scene.operation.get("speed", 1.0))
    curves = {split(POWER)[0]: Curve(peak=PEAK_POWER)} | _of_effects(scene) | dict(words)
    panels: dict[str, Panel] = {}
    for name, (shown, scale) in _time_columns(known, float(speed)).items():
        curve = curves.get(shown, curves.get(name, Curve()))
        if curve.shown:
            levels = dict(_levels(curve, scene.limits, 1.0 if shown in curves else scale))
            marked = (*(extreme for extreme in EXTREMES if getattr(curve, extreme)), *curve.at)
            called, kind = _column_title(known[shown], curve), _KIND.get(split(known[shown])[1], "curve")
            title = f"{kind}s {curve.panel}" if curve.panel else called
            alone = Panel((known[shown],), title, (called,), marked, Frozen(levels), curve.wide)
            panels[title] = _join(panels[title], alone) if title in panels else alone
    return tuple(panels.values())


def _column_title(column: str, curve: Curve) -> str:
    """Title of a column: description and symbol, "crank torque Md"; only the name without a description."""
    symbol = split(column)[0]
    return f"{curve.name} {symbol}" if curve.name else symbol.replace("_", " ")


def _join(panel: Panel, other: Panel) -> Panel:
    return panel._replace(columns=(*panel.columns, *other.columns), names=(*panel.names, *other.names))


def _of_effects(scene: Scene) -> dict[str, Curve]:
    """Descriptions of the columns of active effects."""
    curves = {}
    for effect in scene.active:
        if isinstance(effect, Load | State):
            symbol = load_name(effect)
            name = effect.name.replace("_", " ") if symbol != effect.name else ""
            curves[symbol] = Curve(name, BY_EFFECT if effect.acts == "output" else DRIVE)
            if isinstance(effect, Load) and effect.inside:
                curves[drive_name(effect)] = Curve(f"{effect.name.replace('_', ' ')} of rod and crank", DRIVE)
        elif isinstance(effect, Check):
            curves |= {name: Curve(peak=name) for name in (*effect.quantities, *effect.scalars)}
            curves |= {name: Curve(panel="in the joints", peak=name) for name in effect.vectors}
            parts = (f"{name}_{axis}" for name in effect.vectors for axis in COMPONENTS)
            curves |= {part: Curve(shown=False) for part in parts}
        elif isinstance(effect, Speed):
            curves |= {SPEED: Curve("crank speed"), MOTOR: Curve(most=effect.most)}
    return curves


def _time_columns(known: Collection[str], speed: float) -> dict[str, tuple[str, float]]:
    """Column → (column to show, its ratio to the first): a derivative by time where there is one."""
    orders = {f"{name}_{k}": (f"{name}_{'t' * k}", speed**k) for name in known for k in range(1, ORDERS + 1)}
    instead = {name: later for name, later in orders.items() if later[0] in known}
    shown = {later for later, _ in instead.values()}
    return {name: instead.get(name, (name, 1.0)) for name in known if name not in shown}


def _levels(curve: Curve, limits: Mapping[str, LimitRange], scale: float) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Yield the limits on a curve's figures as levels; scale: of the curve to its figures."""
    for figure in (curve.peak, curve.most, curve.least, *curve.at.values()):
        limit = limits.get(figure)
        if limit and limit.max is not None:
            yield f"{figure} <=", (scale * limit.max, *([-scale * limit.max] if figure == curve.peak else []))
        if limit and limit.min is not None:
            yield f"{figure} >=", (scale * limit.min,)


def single_panels(columns: Sequence[str]) -> tuple[Panel, ...]:
    """A panel for every column that has a unit."""
    return tuple(Panel((name,)) for name in columns if COLUMN.fullmatch(name) and name != ANGLE)


MOST_TWIST = 0.1
"""Share of the output's travel from which on a load can no longer be taken for a function of the crank angle."""
TWIST_SAMPLES = 3600
"""Samples of one turn: enough for the few printed digits of a largest value."""


def twist_remarks(scene: Scene, sampler: Sampler) -> tuple[str, ...]:
    """Remarks on states whose coordinate exceeds a tenth of the output's travel under a load with corners."""
    model, names = sampler.model, []
    pieces, u = sampler.grid(TWIST_SAMPLES)
    for state in model.states:
        for load in (item for item in model.loads if isinstance(item, Load) and item.corners):
            on = sampler.cycle.on((load.name, 1.0))[pieces]
            if load.name not in state.carries or not on.any():
                continue
            at = model.instant(systems.numpy(), sampler.given, sampler.node(pieces[on], u[on]))
            largest = float(np.abs(read_at(state, at).coordinate()).max())
            travel = float(np.ptp(at.pose.q))
            if largest > MOST_TWIST * travel:
                names.append(
                    f"while {load.name} acts the twist reaches {scene.show(largest, 'angle', 3)}, "
                    f"{100 * largest / travel:.3g} % of the rocker's travel there ({scene.show(travel, 'angle', 3)}): "
                    f"{load.name} as a function of the crank angle is then not valid. Make the shaft stiffer, or give "
                    f"a measured pulse"
                )
    return tuple(names)
