"""The units in which a person sees a scene: of [display], else as the scene writes them, else composed of those."""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from loomopt.base.errors import Faults
from loomopt.base.quantities import misfit, quantities_of, unit_of
from loomopt.base.units import DISPLAY_UNIT, SI_UNIT, QuantityError, ascii_unit, fits, parse_unit
from loomopt.physics.effects.kinds import Effect
from loomopt.physics.schema import Table
from loomopt.scenes.cursor import Cursor
from loomopt.scenes.document import looked_up
from loomopt.scenes.tables import Bound, LimitRange, SceneSchema

KINDS = {"speed" if kind == "angular speed" else kind.replace(" ", "_"): kind for kind in SI_UNIT if kind != "number"}
"""Key of [display] → kind of quantity."""
_LONGEST = 60
_BASES = {"m": "length", "kg": "mass", "N": "force"}
"""Letter of an SI unit → the kind whose unit stands for it in a composed one."""
_INCHES = {"length": "in", "mass": "lb", "force": "lbf"}
_OF_INCHES = {"in", "inch", "ft", "lb", "lbf"}
_PRESSURES = {"lbf": "psi"}
"""Unit of force → the unit of pressure that goes with it by habit."""


def read(cursor: Cursor) -> dict[str, str]:
    """Table [display]: kind of quantity → its unit."""
    units: dict[str, str] = {}
    with cursor.faults:
        given = cursor.entries()
        for key, place in given.items():
            with cursor.faults:
                if key not in KINDS:
                    raise place.unknown("kind of quantity", key, KINDS, given=given)
                units[KINDS[key]] = _unit(place, KINDS[key])
    return units


def _unit(cursor: Cursor, kind: str) -> str:
    """A unit of a kind of quantity, in ASCII. Raises BadInput."""
    unit, allowed = cursor.raw, f'a unit of {kind} such as "{DISPLAY_UNIT[kind]}"'
    if not isinstance(unit, str) or len(unit) > _LONGEST:
        raise cursor.fault("it is not a unit", unit, allowed, "Write the unit alone, as text")
    try:
        fitting = fits(unit.strip(), kind)
    except QuantityError as error:
        raise cursor.fault(error.problem, unit, allowed, error.remedy) from None
    if not fitting:
        raise cursor.fault(misfit(unit.strip(), kind), unit, allowed, "Write another unit")
    return ascii_unit(unit.strip())


def units(
    document: Mapping[str, Any],
    schema: SceneSchema,
    active: Iterable[Effect],
    ranges: tuple[Mapping[str, Bound], Mapping[str, LimitRange]],
) -> dict[str, str]:
    """Unit of every kind of quantity; ranges: [bounds] and [limits], which come after the scene's numbers.

    document: checked; its [display] goes before all.
    """
    first: dict[str, str] = {}
    for kind, unit in _unit_entries(document, schema, active, ranges):
        if kind not in first and fits(unit, kind):
            first[kind] = ascii_unit(unit)
    return _complete_units({**first, **read(Cursor(document.get("display", {}), "display", Faults()))})


def unit_for(si: str, known: Mapping[str, str]) -> str:
    """Display unit for an SI unit; known: unit of every kind of quantity.

    What swings stays in rad/s, whatever unit the shaft's speed has.
    """
    kind = next((kind for kind, unit in SI_UNIT.items() if unit == si and kind != "angular speed"), None)
    return known[kind] if kind else _compose_unit(si, {letter: known[base] for letter, base in _BASES.items()}) or si


def _unit_entries(
    document: Mapping[str, Any],
    schema: SceneSchema,
    active: Iterable[Effect],
    ranges: tuple[Mapping[str, Bound], Mapping[str, LimitRange]],
) -> Iterator[tuple[str, str]]:
    """Yield each quantity's kind with the unit it is written in, in the order in which the first one counts."""
    tables: list[tuple[tuple[str, ...], type[Table]]] = [
        (("mechanism",), schema.mechanism),
        (("operation",), schema.operation),
    ]
    tables += [(("effects", *effect.path), effect.table) for effect in active]
    for path, model in tables:
        for key, quantity in quantities_of(model).items():
            text = looked_up(document, (*path, *key.split(".")))
            if isinstance(text, str):
                yield quantity.kind, unit_of(text)
    bounds, limits = ranges
    yield from ((schema.variables[name], bound.unit) for name, bound in bounds.items() if name in schema.variables)
    yield from ((schema.figures[name].kind, limit.unit) for name, limit in limits.items())


def _complete_units(given: Mapping[str, str]) -> dict[str, str]:
    """A unit for every kind: the given one, else one composed of the scene's, else the usual one.

    The SI's own composed units (N*m, N/m, 1/m) stay wherever lengths, masses and forces are decimal multiples of its
    units.
    """
    inches = any(given.get(kind) in _OF_INCHES for kind in _INCHES)
    bases = {kind: given.get(kind) or (_INCHES[kind] if inches else DISPLAY_UNIT[kind]) for kind in _INCHES}
    letters = {letter: bases[kind] for letter, kind in _BASES.items()}
    units = {**bases, **given}
    torque = SI_UNIT["torque"]
    for kind, si in SI_UNIT.items():
        if kind in units:
            continue
        if kind == "pressure":
            units[kind] = _pressure(bases)
        elif kind == "energy":
            units[kind] = si if _is_decimal(units["torque"]) else units["torque"]
        elif kind != "torque" and si.startswith(torque):
            units[kind] = si.replace(torque, units["torque"], 1)
        else:
            units[kind] = _compose_unit(si, letters) or DISPLAY_UNIT[kind]
    return {kind: units[kind] for kind in SI_UNIT}


def _compose_unit(si: str, letters: Mapping[str, str]) -> str:
    """An SI unit written with a scene's own units; "" where these are the SI's or its decimal multiples."""
    used = [unit for letter, unit in letters.items() if re.search(rf"\b{letter}\b", si)]
    if all(map(_is_decimal, used)) or not all(unit.isalpha() for unit in used):
        return ""
    return re.sub(r"[A-Za-z]+", lambda letter: letters.get(letter[0], letter[0]), si)


def _pressure(bases: Mapping[str, str]) -> str:
    """Unit of pressure that goes with a scene's forces."""
    force = bases["force"]
    composed = "" if _is_decimal(force) else _compose_unit("N/m^2", {"N": force, "m": bases["length"]})
    return _PRESSURES.get(force) or composed or DISPLAY_UNIT["pressure"]


def _is_decimal(unit: str) -> bool:
    """Whether a unit is a power of ten of the SI's."""
    factor = parse_unit(unit).factor
    return bool(re.fullmatch("10*", str(factor.numerator * factor.denominator)))
