"""What each effect is worth, for people: a table in the terminal or of pandas, a sentence on what may be left out."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from loomopt.base.units import factor
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.picture.table import TextTable, call
from loomopt.scenes.provenance import provenance
from loomopt.solving.answer.solution import Words
from loomopt.studies.effects.study import Found
from loomopt.studies.effects.worth import LIMITS, Worth

if TYPE_CHECKING:
    import pandas as pd


def parts(found: Found, timed: bool = True) -> list[str | TextTable]:
    """Return the parts of a study in a terminal: a line per effect, what may be left out, and what was not measured.

    timed: whether it is told how long each solve took.
    """
    reference = found.reference
    told = ", ".join(f"{name} {_shown(found, name)}" for name in reference.scales)
    first = f"{found.scene.name}, {found.target}, with {listed(reference.effects) or 'no effect'} on: "
    lines = [first + (told if reference.status == "optimal" else f"{reference.status}, {reference.why}")]
    sizes = ", ".join(f"{name} {Words(found.scene).shown(name, size)}" for name, size in reference.scales.items())
    lines += [f"Shares are of natural sizes: {sizes}"] if sizes else []
    return [*lines, *([_grid(found, timed)] if found.rows else []), *verdict(found), *_notes(found)]


def _shown(found: Found, name: str) -> str:
    value, scale = found.reference.figures[name], found.reference.scales[name]
    if value is None:
        return "undefined"
    return Words(found.scene).shown(name, 0.0 if abs(value) <= SHOWN_AS_ZERO * scale else value)


def _grid(found: Found, timed: bool) -> TextTable:
    words, scales = Words(found.scene), found.reference.scales
    heads, times = ["without"], ["build\ns", "solve\ns"] if timed else []
    names = ["without"]
    for name in scales:
        unit = words.unit(name)
        names += [f"{name} shift", f"{name} shift %", f"{name} regret %"]
        heads += [f"{name}\nshift" + ("" if unit == "1" else f"\n{unit}"), "\n\n%", "\nregret\n%"]
    heads += ["limits\nexceeded\n%", "graph\nnodes", *times, "may go", ""]
    base = Worth("nothing", {}, {}, None, True, found.reference.status, **found.reference.cost)
    first = _line(found, base, timed)
    lines = ((*first[:-2], "", first[-1]), *(_line(found, row, timed) for row in found.rows))
    names += heads[len(names) :]
    last = len(heads) - 1  # what came of the solve, where that is not an optimum
    asked = (0, last - 1, last) if any(line[-1] for line in lines) else (0, last - 1)
    right = tuple(range(1, last - 1))
    return TextTable("", tuple(heads), lines, right, first=asked, names=tuple(names), more="--json")


def _line(found: Found, row: Worth, timed: bool) -> tuple[str, ...]:
    words, cells = Words(found.scene), list[str]()
    for name, scale in found.reference.scales.items():
        shift, regret, size = row.shift.get(name), row.regret.get(name), factor(words.unit(name))
        cells += [_number(None if shift is None else shift * scale, scale, size), _share(shift), _share(regret)]
    cells += [_share(row.excess), _count(row.nodes)]
    cells += [_seconds(row.build_s), _seconds(row.solve_s)] if timed else []
    return row.effect, *cells, "yes" if row.may_go else "no", _status(row.status)


def _number(value: float | None, scale: float, size: float) -> str:
    return "" if value is None else "0" if abs(value) <= SHOWN_AS_ZERO * scale else f"{value / size:.6g}"


def _share(value: float | None) -> str:
    return "" if value is None else "0" if abs(value) <= SHOWN_AS_ZERO else f"{100 * value:.3g}"


def _count(value: int | None) -> str:
    return "" if value is None else str(value)


def _seconds(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _status(status: str) -> str:
    return "" if status == "optimal" else status


def listed(names: Sequence[str]) -> str:
    """Return names as a sentence has them."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def verdict(found: Found) -> list[str]:
    """Return in a sentence what may be left out, and how that was verified; in others what is to be kept in mind."""
    share, solve = f"{100 * found.tolerance:g} %", call(found.command or "")
    if not found.finished:
        return ["Not finished: what may be left out is not known."]
    if not found.reference.scales:
        return ["Without a design for the reference nothing can be measured."]
    said = f"{listed(found.left_out)} may be left out" if found.left_out else "no effect may be left out"
    lines = [f"At {share}, {said}{': ' if solve else ''}{solve}"]
    if found.together and found.largest_omission:
        lines.append(
            f"Left out together, and what is found so judged with all on: {_largest_change(found.together.largest)}."
        )
        if len(found.left_out) > 1 and abs(found.largest_omission.value) > SHOWN_AS_ZERO:
            by, of, value = found.largest_omission.by, found.largest_omission.of, found.largest_omission.value
            lines[-1] += f" Most comes from {found.largest_omission.effect}: {_moved(by, of, value)}."
    lines += omitted(found)
    alone = [row.effect for row in found.rows if row.may_go and row.effect not in found.left_out]
    if alone:
        lines.append(f"By itself {listed(alone)} may go, but not together with what else is left out.")
    same = [row.effect for row in found.rows if _only_figures(row, found.tolerance)]
    if same:
        lines.append(f"Without {listed(same)} as good a design is found, but its figures are wrong by more than that.")
    if found.judged:
        lines.append(f"Evaluate the design with {listed(found.judged)}, which solve does not take.")
    return lines


def omitted(found: Found) -> list[str]:
    """Return which figures are gone or others without what is left out, and which of them the target reads."""
    rows = [row for row in found.rows if row.effect in found.left_out]
    told, names = list[str](), dict[str, None]()
    for row in (*rows, *([found.together] if found.together and len(rows) > 1 else [])):
        single = row in rows
        parts = [f"{listed(row.lost)} {'is' if len(row.lost) == 1 else 'are'} gone"] if row.lost else []
        parts += (
            [f"{listed(row.moved)} {'changes' if len(row.moved) == 1 else 'change'}"] if row.moved and single else []
        )
        told += [f"{f'without {row.effect}' if single else 'without them all'} {' and '.join(parts)}"] if parts else []
        names |= dict.fromkeys((*row.lost, *row.moved))
    if not told:
        return []
    read = [name for name in names if name in found.reference.reads]
    which = f"reads {listed(read)} of them" if read else "reads none of these figures"
    return [f"Of the other figures: {'; '.join(told)}. Target {found.target} {which}."]


def _largest_change(largest: tuple[str, str, float]) -> str:
    """Return the largest change in words."""
    return f"at most {_moved(*largest)}" if abs(largest[2]) > SHOWN_AS_ZERO else "nothing changes"


def _moved(by: str, of: str, value: float) -> str:
    """Return a change in words: by "shift" or "regret", of a figure or of the limits."""
    share = f"{100 * value:.3g} %"
    if of == LIMITS:
        return f"a limit is exceeded by {share}"
    return f"{of} {'shifts by' if by == 'shift' else 'is worse by'} {share}"


def _only_figures(row: Worth, tolerance: float) -> bool:
    """Say whether a design found without an effect is good, and only its figures are wrong."""
    told = (*row.regret.values(), row.excess)
    known = [value for value in row.shift.values() if value is not None]
    good = bool(known) and all(value is not None and value <= tolerance for value in told)
    return good and max(map(abs, known)) > tolerance


def _notes(found: Found) -> list[str]:
    """Return why rows are not what one would think, and what was not measured."""
    lines = [f"{row.effect}: {row.why}" for row in found.rows if row.why]
    lines += [f"{name} is not measured: {why}" for name, why in found.out.items()]
    return lines + [f"{name}: {why}" for name, why in found.unknown.items()]


def frame(found: Found, si: bool = False) -> "pd.DataFrame":
    """Return one line per effect; si: in SI, so that studies of machines in different units can be compared."""
    import pandas as pd

    from loomopt.interface.table_frame import TableFrame

    words, rows = Words(found.scene), found.rows
    cells: dict[str, object] = {}
    for name, scale in found.reference.scales.items():
        unit = words.si(name) if si else words.unit(name)
        for what, shares in (
            ("shift", [r.shift.get(name) for r in rows]),
            ("regret", [r.regret.get(name) for r in rows]),
        ):
            cells[f"{name} {what} [{unit}]"] = [math.nan if v is None else v * scale / factor(unit) for v in shares]
            cells[f"{name} {what} [%]"] = [math.nan if v is None else 100 * v for v in shares]
    cells["limits exceeded [%]"] = [math.nan if row.excess is None else 100 * row.excess for row in rows]
    cells["may go"] = [row.may_go for row in rows]
    cells |= {"takes away": [", ".join(r.lost) for r in rows], "changes": [", ".join(r.moved) for r in rows]}
    cells["nodes"] = pd.array([row.nodes for row in rows], dtype="Int64")
    for column, values in (("build [s]", [r.build_s for r in rows]), ("solve [s]", [r.solve_s for r in rows])):
        cells[column] = [math.nan if value is None else value for value in values]
    cells |= {"status": [row.status for row in rows], "why": [row.why for row in rows]}
    table = TableFrame(cells, index=pd.Index([row.effect for row in rows], name="without"))
    asked = {"reference": ", ".join(found.reference.effects), "tolerance": found.tolerance}
    table.attrs.update(provenance(found.scene, study="effects", target=found.target, **asked))
    return table
