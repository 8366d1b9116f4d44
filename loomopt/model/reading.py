"""Values of a program's rows at one design or at many, in any number system."""

import abc
import functools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from loomopt.base.records import lazy
from loomopt.maths import recording
from loomopt.maths.jets import Jet
from loomopt.maths.recording import Bind, Function, Program, Recorded, Tape
from loomopt.maths.systems import Maths, Number
from loomopt.model.model import Integral, JobModel, Stills
from loomopt.model.session import current
from loomopt.physics.balance import Given, total
from loomopt.physics.cycle import Cycle, Floats, Node, Pieces, Where
from loomopt.physics.schema import Values
from loomopt.physics.tolerances import SAME_ANGLE

GAUSS_NODES = 32
"""Nodes of a mean on each piece: of an analytic formula the error falls by a constant factor a node. Packaged means are
right to 2e-10 with 8 of them and to rounding with 12 (benchmarks/measure/tolerances.py); the rest is for narrower
peaks."""
NARROW, ROUNDING = 0.2, 1e-15
"""rad; a piece of many that is narrower takes as many nodes as rounding needs: of n nodes the rule errs by half the
piece's width over its distance from what is not analytic, 1 rad or so, to the power 2 n."""

WORTH_IT = 64
"""Evaluations after which a formula is recorded: that takes 1 to 3 ms, and saves some 30 us of each."""


@dataclass(frozen=True)
class Recording:
    """Recorded formulas of quantities.

    known: names of the numbers of a design that they read; switches: names of the values of a node that they read,
    apart from φ; elementwise: whether each node is read by itself, so that nodes of several designs may be read in one
    call.
    """

    program: Program
    known: tuple[str, ...]
    switches: tuple[str, ...]
    elementwise: bool = False
    _bind: dict[tuple[Maths, Maths], Bind] = field(default_factory=dict)

    def bind(self, systems: tuple[Maths, Maths], given: Given) -> "Bound":
        """Quantities of one design as a function of the node."""
        if systems not in self._bind:
            self._bind[systems] = self.program(systems)
        values = given.values
        return Bound(self, self._bind[systems]([values[name] for name in self.known]))


@dataclass(frozen=True)
class Bound:
    """Quantities of a design, or of several, at nodes."""

    recording: Recording
    function: Function

    def __call__(self, node: Node) -> tuple[Number, ...]:
        """Quantities at a node, or at nodes."""
        switch = node.switch
        return self.function(node.phi, *[switch[name] for name in self.recording.switches])

    @property
    def values(self) -> tuple[Number, ...]:
        """Values that the function reads of the design."""
        values: tuple[Number, ...] = self.function.args[0]
        return values

    def of(self, values: Iterable[Number]) -> "Bound":
        """The same quantities with other values."""
        return Bound(self.recording, Function(self.function.func, tuple(values)))


def bind_together(designs: Sequence["Quantities"], names: tuple[str, ...], switches: tuple[str, ...]) -> Bound | None:
    """Quantities of several designs of one model, their values (designs, 1) where they differ; None if unrecorded."""
    bounds = [design.bound(names, switches) for design in designs]
    first = bounds[0]
    if first is None or not first.recording.elementwise:
        return None
    values = [bound.values for bound in bounds if bound and bound.function.func is first.function.func]
    if len(values) < len(designs):
        return None
    try:
        return first.of(map(_column, zip(*values, strict=True)))
    except (TypeError, ValueError):
        # What a formula reads of a design may be more than a number.
        return None


def at_places(bound: Bound, places: Pieces) -> Bound:
    """The same quantities, each node of its own design, by the designs' places (nodes,)."""
    return bound.of(_at_places(value, places) for value in bound.values)


def _column(values: Sequence[Number]) -> Number:
    """Values of several designs as (designs, 1), or that of all; tuples entry by entry. Raises for other objects."""
    if isinstance(values[0], tuple):
        return tuple(map(_column, zip(*values, strict=True)))
    column = np.array(values, dtype=np.float64)
    if column.ndim != 1:
        raise ValueError("a value of a design is an array")
    # A zero of the other sign is another value.
    digits = column.view(np.int64)
    return values[0] if (digits == digits[0]).all() else column[:, None]


def _at_places(value: Number, places: Pieces) -> Number:
    if isinstance(value, tuple):
        return tuple(_at_places(entry, places) for entry in value)
    return value[places, 0] if np.ndim(value) else value


@dataclass
class _History:
    """How often quantities of a model were evaluated, and their recording, if they have one."""

    evaluations: int = 0
    recording: Recording | None = None
    refused: bool = False


class Quantities:
    """Whole-cycle quantities of one design at nodes, SI.

    systems: of the design's numbers, as `given` has them, and of the nodes'; record_at_once: whether a formula
    is recorded before its first evaluation, not after many.
    """

    def __init__(
        self, model: JobModel, systems: tuple[Maths, Maths], given: Given, record_at_once: bool = False
    ) -> None:
        self.model, self.systems, self.given, self.record_at_once = model, systems, given, record_at_once
        self._bound: dict[tuple[tuple[str, ...], tuple[str, ...]], Bound] = {}

    def __call__(self, names: tuple[str, ...], node: Node) -> tuple[Number, ...]:
        """Quantities by their names at a node, or at nodes, in one pass."""
        run = self.bound(names, tuple(node.switch))
        if run is None:
            read = self.model.together(self.systems[1], self.given, node)
            return tuple([read(name) for name in names])
        return run(node)

    def bound(self, names: tuple[str, ...], switches: tuple[str, ...]) -> Bound | None:
        """Recorded quantities of this design, None where there is no recording, or not yet."""
        run = self._bound.get((names, switches))
        if run is None:
            history = current().cached_for(self.model, (names, switches, self.given.known), _History)
            run = self._run(names, switches, history)
        return run

    def _run(self, names: tuple[str, ...], switches: tuple[str, ...], history: _History) -> Bound | None:
        """Recorded quantities of this design, None where there is no recording, or not yet."""
        history.evaluations += 1
        worth_it = self.record_at_once or history.evaluations > WORTH_IT
        if history.recording is None and worth_it and not history.refused:
            try:
                history.recording = recorded_quantities(self.model, names, switches, self.given.known)
            except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
                # A formula that decides by a value, as a plug-in's may, is run as it is.
                history.refused = True
        if history.recording is None:
            return None
        self._bound[names, switches] = run = history.recording.bind(self.systems, self.given)
        return run


def recorded_quantities(
    model: JobModel, names: tuple[str, ...], switches: tuple[str, ...], known: frozenset[str]
) -> Recording:
    """Recorded quantities; switches: names of the nodes' data; known: names of the scene's numbers.

    Raises what a formula raises that cannot be recorded.
    """
    tape = Tape()
    first, there = (recording.recorded(tape, system) for system in range(2))
    phi, switch = tape.input(), {name: tape.input() for name in switches}
    raw = model.given(first, {name: tape.input() for name in sorted(known)})
    values = {of: tape.known(value) if isinstance(value, Recorded) else value for of, value in raw.values.items()}
    inputs = {value.place: of for of, value in values.items() if isinstance(value, Recorded)}
    since = len(tape.operations)
    given = Given(values, raw.tables, linkage=raw.linkage)
    read = model.together(there, given, Node(phi, switch))
    outputs = tuple([read(name) for name in names])
    needed = tape.needed(outputs, since)
    used = {place: of for place, of in inputs.items() if place in needed}
    called = {name: operand for name, operand in switch.items() if operand.place in needed}
    program = tape.program(outputs, (phi, *called.values()), [Recorded(tape, place) for place in used], since)
    elementwise = not any(tape.operations[place].template.startswith(ACROSS_NODES) for place in needed)
    return Recording(program, tuple(used.values()), tuple(called), elementwise)


ACROSS_NODES = "spread_", "weighted_"
"""Operations that make an array of numbers, or sum over one."""

DATUM = "datum"
"""The switch that hands a quantity the number that an integral has at each of its own angles."""


@functools.cache
def gauss(count: int = GAUSS_NODES) -> tuple[Floats, Floats]:
    """Nodes and weights of the Gauss-Legendre rule on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return (nodes + 1) / 2, weights / 2


def _enough(width: float) -> int:
    """Nodes that a piece so wide, rad, needs."""
    return math.ceil(math.log(ROUNDING) / (2 * math.log(width / 2))) if 0.0 < width < NARROW else GAUSS_NODES


def fixed_nodes(cycle: Cycle, integral: Integral) -> Node:
    """Nodes of a mean at its own angles, each with its number as the switch "datum".

    A cycle of another design, whose corners lie elsewhere, names the formulas that hold in its own pieces.
    """
    angles = np.asarray(integral.angles)
    return Node(angles, {**cycle.switch(cycle.located(angles)[0]), DATUM: np.asarray(integral.data)})


def quadrature(cycle: Cycle, integral: Integral) -> tuple[Pieces, Floats, Floats]:
    """Nodes (pieces, u) and weights in u of a mean over pieces of the cycle."""
    # Between two corners at one angle there is nothing, and which of them is first is rounding.
    active = np.flatnonzero(cycle.on(integral.where) & (np.diff(cycle.starts) > SAME_ANGLE))
    if integral.where and isinstance(integral.where[1], tuple) and integral.parts == 1:
        rules = [gauss(_enough(width)) for width in np.diff(cycle.starts)[active].tolist()]
        pieces = np.concatenate([np.full(len(u), piece) for piece, (u, _) in zip(active, rules, strict=True)])
        return pieces, np.concatenate([u for u, _ in rules]), np.concatenate([weights for _, weights in rules])
    nodes, weights = gauss()
    if integral.parts > 1:
        nodes = np.add.outer(np.arange(integral.parts), nodes).ravel() / integral.parts
        weights = np.tile(weights, integral.parts) / integral.parts
    return np.repeat(active, len(nodes)), np.tile(nodes, len(active)), np.tile(weights, len(active))


class Rows(abc.ABC):
    """Rows of one design in one number system; subclasses define means over the cycle.

    given: the scene's numbers in that system; stills: switches just before each event at which a row is read.
    """

    def __init__(self, model: JobModel, maths: Maths, given: Given, stills: Stills) -> None:
        self.model, self.maths, self.given, self.stills = model, maths, given, stills
        self._single: dict[str, Number] = {}
        self._quantities = Quantities(model, (maths, maths), given)

    @abc.abstractmethod
    def mean(self, integral: Integral) -> Number:
        """Mean over the cycle, SI."""

    def quantity(self, name: str, phi: Number, switch: Values) -> Number:
        """Whole-cycle quantity at a crank angle, rad, SI."""
        return self._quantities((name,), Node(phi, switch))[0]

    def single(self, name: str) -> Number:
        """Figure or row of the design, a mean over the cycle or its root, or a number of the scene, SI."""
        if name not in self._single:
            self._single[name] = self._value(name)
        return self._single[name]

    def _value(self, name: str) -> Number:
        for integral in self.model.integrals:
            if name == integral.name:
                return self.mean(integral)
            if name == integral.root:
                return self.maths.sqrt(self.single(integral.name))
        known = self.model.static(self.maths, self.given, self.stills, (name,))
        return known[name] if name in known else self.given.values[name]

    def highest(self, name: str, where: Where | None = None) -> Number:
        """Largest |quantity| (of a signed one, value) over the cycle or the pieces `where`, SI.

        Only a reading of the sampled cycle has it.
        """
        raise NotImplementedError(f"{name} is read at nodes here")


class Reading(Rows):
    """Rows and whole-cycle quantities of one design in one number system; cycle: its pieces, computed in floats."""

    def __init__(self, model: JobModel, maths: Maths, given: Given, cycle: Cycle, stills: Stills) -> None:
        super().__init__(model, maths, given, stills)
        self.cycle = cycle

    @lazy
    def starts(self) -> list[Number]:
        """Crank angles, rad, where the pieces begin, the last one turn after the first."""
        return self.cycle.begins(self.model.corners(self.maths, self.given), self.maths.pi)

    def at(self, name: str, piece: int, u: Number) -> Number:
        """Whole-cycle quantity at a node, SI."""
        begin, end = self.starts[piece], self.starts[piece + 1]
        return self.quantity(name, begin + u * (end - begin), self.cycle.switch(piece))

    def mean(self, integral: Integral) -> Number:
        """Mean by its rule, node by node, SI."""
        if integral.angles:
            number = self.maths.number
            pieces = self.cycle.located(np.asarray(integral.angles))[0].tolist()
            fixed = zip(integral.angles, integral.data, map(self.cycle.switch, pieces), strict=True)
            values = [self.quantity(integral.quantity, number(a), {**s, DATUM: number(d)}) for a, d, s in fixed]
            return total(values) / len(values)
        weighted, widths = [], []
        for piece, u, weight in zip(*quadrature(self.cycle, integral), strict=True):
            width = float(weight) * (self.starts[piece + 1] - self.starts[piece])
            weighted.append(width * self.at(integral.quantity, int(piece), float(u)))
            widths.append(width)
        return total(weighted) / total(widths)


class BatchReading(Reading):
    """Designs read at once: numbers are (designs,), whole-cycle quantities (nodes, designs).

    values: the scene's numbers, any of them (designs,); cycle, stills: of one design, which order their corners.
    """

    def __init__(
        self, model: JobModel, maths: Maths, values: Mapping[str, Number], cycle: Cycle, stills: Stills
    ) -> None:
        super().__init__(model, maths, model.given(maths, values), cycle, stills)
        self.values = values
        self.count = max(np.size(plain(value)) for value in values.values())
        self._looked: tuple[Pieces, dict[str, Number]] = np.zeros(0, dtype=np.intp), {}

    def node(self, pieces: Pieces, u: Floats) -> Node:
        """Nodes (pieces, u), each (nodes,), of all designs; their angles (nodes, 1) where no corner moves."""
        begin, end = self._begun(pieces), self._begun(pieces + 1)
        switch = {name: column[:, None] for name, column in self.cycle.switch(pieces).items()}
        return Node(begin + u[:, None] * (end - begin), switch)

    def design_node(self, pieces: Pieces, u: Floats) -> Node:
        """Node (pieces, u) of each design, its own; pieces: (designs,), u: (…, designs)."""
        every = np.arange(self.count)
        starts = np.broadcast_to(self._starts, (len(self._starts), self.count))
        begin, end = starts[pieces, every], starts[pieces + 1, every]
        return Node(begin + u * (end - begin), self.cycle.switch(pieces))

    def of(self, places: Pieces) -> "BatchReading":
        """Designs by their places; a place may occur several times."""
        values = {name: value[places] if np.ndim(value) else value for name, value in self.values.items()}
        return BatchReading(self.model, self.maths, values, self.cycle, self.stills)

    def _begun(self, pieces: Pieces) -> Number:
        """Starts of the pieces, rad, (pieces, designs), or (pieces, 1) where all designs share them."""
        return self._starts[pieces]

    @lazy
    def _starts(self) -> Number:
        if not any(np.ndim(plain(start)) or isinstance(start, Jet) for start in self.starts):
            return np.array(self.starts, dtype=np.float64)[:, None]
        return _stacked([wide(start, self.count) for start in self.starts])

    def quantities(self, names: Sequence[str], node: Node) -> dict[str, Number]:
        """Whole-cycle quantities (nodes, designs) at nodes, their poses computed once for all."""
        read = self.model.together(self.maths, self.given, node)
        shape = np.broadcast_shapes(np.shape(plain(node.phi)), (self.count,))
        return {name: _shaped(read(name), shape) for name in names}

    def look(self, names: Sequence[str], pieces: Pieces, u: Floats) -> None:
        """Look at quantities at nodes (pieces, u) of the whole cycle, their poses computed once for all."""
        self._looked = pieces, self.quantities(names, self.node(pieces, u))

    def looked(self, name: str) -> Number:
        """Quantity at the given nodes, (nodes, designs)."""
        return self._looked[1][name]

    def highest(self, name: str, where: Where | None = None) -> Number:
        """Largest |quantity| (of a signed one, value) of each design at the given nodes, (designs,)."""
        pieces, values, signed = self._looked[0], self.looked(name), name in self.model.signed
        on = np.flatnonzero(self.model.counted(self.cycle, name, where)[pieces])
        known = plain(values)[on]
        heights = known if signed else np.abs(known)
        top = on[np.argmax(np.where(np.isfinite(heights), heights, np.inf), axis=0)]
        highest = values[top, np.arange(known.shape[1])]
        return highest if signed else np.where(plain(highest) < 0.0, -1.0, 1.0) * highest

    def mean(self, integral: Integral) -> Number:
        """Mean by its rule, all nodes of all designs at once, (designs,), SI."""
        name = integral.quantity
        if integral.angles:
            fixed = fixed_nodes(self.cycle, integral)
            node = Node(fixed.phi[:, None], {name: column[:, None] for name, column in fixed.switch.items()})
            return _total(self.quantities((name,), node)[name]) / len(integral.angles)
        pieces, u, weights = quadrature(self.cycle, integral)
        widths = weights[:, None] * (self._begun(pieces + 1) - self._begun(pieces))
        return _total(widths * self.quantities((name,), self.node(pieces, u))[name]) / _total(widths)


MOST_DESIGNS = 16
"""Most designs of a batch: larger batches take as long per design and need more memory."""


def group_equal(kinds: Sequence[object]) -> list[list[int]]:
    """Places of equal kinds, at most `MOST_DESIGNS` in one group."""
    groups: dict[object, list[int]] = {}
    for k, key in enumerate(kinds):
        groups.setdefault(key, []).append(k)
    return [
        places[begin : begin + MOST_DESIGNS]
        for places in groups.values()
        for begin in range(0, len(places), MOST_DESIGNS)
    ]


def plain(value: Number) -> Number:
    """Value of the number without its derivatives."""
    return value.v if isinstance(value, Jet) else value


def wide(value: Number, count: int) -> Number:
    """Number as an array over designs, (designs,)."""
    return _shaped(value, (count,))


def _shaped(value: Number, shape: tuple[int, ...]) -> Number:
    """Number, or a jet, in full shape."""
    if not isinstance(value, Jet):
        return np.broadcast_to(np.asarray(value, dtype=np.float64), shape)
    width = value.g.shape[-1]
    return Jet(np.broadcast_to(value.v, shape), np.broadcast_to(value.g, (*shape, width)))


def _stacked(numbers: Sequence[Number]) -> Number:
    """Numbers (designs,) as one, (numbers, designs)."""
    if not any(isinstance(number, Jet) for number in numbers):
        return np.array(numbers)
    width = next(number.g.shape[-1] for number in numbers if isinstance(number, Jet))
    slopes = [number.g if isinstance(number, Jet) else np.zeros((len(number), width)) for number in numbers]
    return Jet(np.array([plain(number) for number in numbers]), np.array(slopes))


def _total(values: Number) -> Number:
    """Sum over the nodes, (designs,)."""
    return Jet(values.v.sum(axis=0), values.g.sum(axis=0)) if isinstance(values, Jet) else values.sum(axis=0)
