"""Recorded formulas: numbers that record their operations, and the plain function that repeats them.

Equal expressions are computed once; what does not depend on the function's arguments, once for all its calls; what does
not even depend on a design, once for a number system. The operations are the formula's own, in that system: the same to
the last bit [Griewank and Walther, Evaluating Derivatives, 2nd ed., chapter 2: the evaluation trace].
"""

import functools
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, NoReturn

from loomopt.maths.systems import Maths

Number = Any
"""A recorded number, or a constant of any number system in a formula."""
Function = functools.partial[tuple[Number, ...]]
"""function(*called): outputs; its one argument is what it reads of what is known before it is called."""
Bind = Callable[[Sequence[Number]], Function]
"""bind(known): the function, with these values of what is known before it is called."""
Program = Callable[[Sequence[Maths]], Bind]
"""program(systems): how the function is bound in these number systems; the last is that of its arguments."""
DEEPEST = 16
"""Operations nested in one expression: far below the 200 brackets at which CPython's parser gives up."""
INPUT, LITERAL = "input", "literal"
ARITHMETIC = frozenset({"{0} + {1}", "{0} - {1}", "{0} * {1}", "{0} / {1}"})
HARMLESS = re.compile(r"input|literal|pi_\d+|\(.*\)|[-+]\{0\}|\{0\} [-+*] \{1\}")
"""Operations that raise in no number system. Others are run even if no result needs them, because they may raise."""


class RecordedOperation(NamedTuple):
    """Operation: Python code with operands {0}, {1} ..., the places of these, and the value of a literal."""

    template: str
    of: tuple[int, ...] = ()
    value: Number = None


class Recorded:
    """Number on a tape: its place, without a value."""

    __slots__ = ("place", "tape")
    __array_ufunc__ = None
    """So that NumPy leaves scalar * recorded to the recorded number."""
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, tape: "Tape", place: int) -> None:
        self.tape, self.place = tape, place

    def __add__(self, other: Number) -> "Recorded":
        """Sum."""
        return self.tape.record("{0} + {1}", self, other)

    def __radd__(self, other: Number) -> "Recorded":
        """Sum, the other number first."""
        return self.tape.record("{0} + {1}", other, self)

    def __sub__(self, other: Number) -> "Recorded":
        """Difference."""
        return self.tape.record("{0} - {1}", self, other)

    def __rsub__(self, other: Number) -> "Recorded":
        """Difference, the other number first."""
        return self.tape.record("{0} - {1}", other, self)

    def __mul__(self, other: Number) -> "Recorded":
        """Product."""
        return self.tape.record("{0} * {1}", self, other)

    def __rmul__(self, other: Number) -> "Recorded":
        """Product, the other number first."""
        return self.tape.record("{0} * {1}", other, self)

    def __truediv__(self, other: Number) -> "Recorded":
        """Quotient."""
        return self.tape.record("{0} / {1}", self, other)

    def __rtruediv__(self, other: Number) -> "Recorded":
        """Quotient, the other number on top."""
        return self.tape.record("{0} / {1}", other, self)

    def __pow__(self, power: Number) -> "Recorded":
        """Power."""
        return self.tape.record("{0} ** {1}", self, power)

    def __rpow__(self, base: Number) -> "Recorded":
        """Power of another number."""
        return self.tape.record("{0} ** {1}", base, self)

    def __neg__(self) -> "Recorded":
        """Opposite."""
        return self.tape.record("-{0}", self)

    def __pos__(self) -> "Recorded":
        """Number itself."""
        return self.tape.record("+{0}", self)

    def __bool__(self) -> bool:
        """Raise TypeError: a condition cannot be decided by a number that is not known yet."""
        raise TypeError("a recorded number has no value yet")

    def _undecided(self, other: object) -> NoReturn:
        raise TypeError("a recorded number has no value yet")

    __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = _undecided


class Tape:
    """Operations in the order in which they were recorded, equal ones once."""

    def __init__(self) -> None:
        self.operations: list[RecordedOperation] = []
        self._places: dict[object, int] = {}

    def input(self) -> Recorded:
        """Number that is given when the function is bound, or called."""
        return self._at(len(self.operations), RecordedOperation(INPUT))

    def known(self, number: Recorded) -> Recorded:
        """Input in place of a number that is known when the function is bound; an input is returned as it is."""
        return number if self.operations[number.place].template == INPUT else self.input()

    def call(self, system: int, function: str, *operands: Number) -> Recorded:
        """Result of a function of a number system; system: its place among those of `Program`."""
        listed = ", ".join(f"{{{k}}}" for k in range(len(operands)))
        return self.record(f"{function}_{system}({listed})", *operands)

    def choose(self, system: int, place: Number, values: Sequence[Number]) -> Recorded:
        """Value at a place, by a number system's `choose`."""
        return self.call(system, "choose", place, self.listed(values))

    def listed(self, values: Iterable[Number]) -> Recorded:
        """Numbers as a tuple of them."""
        operands = tuple(values)
        listed = "".join(f"{{{k}}}, " for k in range(len(operands)))
        return self.record(f"({listed})", *operands)

    def record(self, template: str, *operands: Number) -> Recorded:
        """Result of an operation on recorded numbers and literals."""
        operation = RecordedOperation(template, tuple(map(self.place, operands)))
        return self._at(operation, operation)

    def place(self, number: Number) -> int:
        """Place of a number. Raises ValueError for one of another tape."""
        if isinstance(number, Recorded):
            if number.tape is not self:
                raise ValueError("a number of another tape")
            return number.place
        # 1, 1.0 and True are equal but not the same, and so are 0.0 and -0.0.
        text = repr(number) if isinstance(number, int | float) else id(number)
        return self._at((type(number), text), RecordedOperation(LITERAL, (), number)).place

    def _at(self, key: object, operation: RecordedOperation) -> Recorded:
        place = self._places.setdefault(key, len(self.operations))
        if place == len(self.operations):
            self.operations.append(operation)
        return Recorded(self, place)

    def needed(self, outputs: Iterable[Number], since: int = 0) -> set[int]:
        """Places that outputs need, and what may fail from the place `since` on."""
        places = {self.place(output) for output in outputs}
        places |= {k for k in range(since, len(self.operations)) if not HARMLESS.fullmatch(self.operations[k].template)}
        for place in range(len(self.operations) - 1, -1, -1):
            if place in places:
                places.update(self.operations[place].of)
        return places

    def program(
        self, outputs: tuple[Number, ...], called: Sequence[Recorded], known: Sequence[Recorded], since: int = 0
    ) -> Program:
        """Program(systems) → bind(known) → function(*called) → outputs.

        called, known: inputs, of each call and of all calls; since: place from which on what may fail is always done.
        """
        levels = {operand.place: CALLED for operand in called} | {operand.place: KNOWN for operand in known}
        names = {operand.place: f"x{k}" for k, operand in enumerate(called)}
        names |= {operand.place: f"a{k}" for k, operand in enumerate(known)}
        needed = sorted(self.needed(outputs, since))
        written = _Written(self.operations, needed, list(map(self.place, outputs)), levels)
        code = compile(written.text(names), "<recorded formula>", "exec")
        space: dict[str, Number] = {"__name__": __name__, "partial": functools.partial, **written.literals}
        exec(code, space)
        compiled: Program = space["program"]
        return compiled


ALWAYS, KNOWN, CALLED = range(3)
"""Since when a result is known: in a number system, of a design, in a call."""


class _Written:
    """Outputs of a tape as Python.

    What is read once is written where it is read. What is read several times, or later than it is known, has a name:
    in a call a local variable, taken again as soon as it is free.
    """

    def __init__(
        self,
        operations: Sequence[RecordedOperation],
        needed: Sequence[int],
        outputs: Sequence[int],
        inputs: Mapping[int, int],
    ) -> None:
        self.operations, self.needed, self.outputs = operations, needed, outputs
        self.literals: dict[str, Number] = {}
        self.end = len(operations)
        self.level = {**inputs, self.end: CALLED}
        self.readers: dict[int, list[int]] = {place: [] for place in needed}
        for place in needed:
            operands = operations[place].of
            self.level.setdefault(place, max((self.level[operand] for operand in operands), default=ALWAYS))
            for operand in operands:
                self.readers[operand].append(place)
        for place in outputs:
            self.readers[place].append(self.end)
        self.named = self._named()
        self.last = self._last_read()

    def _named(self) -> set[int]:
        """Values that need a name: read several times, never, or later than computed, or nested too deeply."""
        names, depth = set(), dict.fromkeys(self.needed, 0)
        for place in self.needed:
            template, operands, _ = self.operations[place]
            if template in (INPUT, LITERAL):
                continue
            depth[place] = 1 + max((depth[operand] for operand in operands if operand not in names), default=0)
            readers = self.readers[place]
            later = any(self.level[reader] > self.level[place] for reader in readers)
            if len(readers) != 1 or later or depth[place] == DEEPEST:
                names.add(place)
        return names

    def _last_read(self) -> dict[int, int]:
        """For each result the one that reads it last."""
        last: dict[int, int] = {}
        for place in reversed(self.needed):
            reached = [reader if reader in self.named else last.get(reader, self.end) for reader in self.readers[place]]
            last[place] = max(reached, default=place)
        return last

    def text(self, inputs: Mapping[int, str]) -> str:
        """Source of `program`; inputs: their names."""
        names, wide = dict(inputs), dict[int, str]()
        lines: tuple[list[str], ...] = ([], [], [])
        free, freed = list[str](), dict[int, list[str]]()
        for place in self.needed:
            template, operands, value = self.operations[place]
            level = self.level[place]
            if template == INPUT:
                continue
            if template == LITERAL:
                names[place] = self._literal(place, value)
                continue
            if level == CALLED and template in ARITHMETIC:
                for operand in (number for number in operands if self.level[number] < CALLED and number not in wide):
                    wide[operand] = f"w{operand}"
                    lines[self.level[operand]].append(f"w{operand} = constant({names[operand]})")
                written = template.format(*(wide.get(operand, names[operand]) for operand in operands))
            else:
                written = template.format(*(names[operand] for operand in operands))
            if place not in self.named:
                names[place] = f"({written})"
                continue
            names[place] = f"r{place}"
            if level == CALLED:
                free += freed.pop(place, [])
                names[place] = free.pop() if free else names[place]
                freed.setdefault(self.last[place], []).append(names[place])
            lines[level].append(f"{names[place]} = {written}")
        return self._nested(lines, inputs, "".join(f"{names[place]}, " for place in self.outputs))

    def _nested(self, lines: Sequence[Sequence[str]], inputs: Mapping[int, str], result: str) -> str:
        """Source of `program` from the lines of each level."""
        templates = {self.operations[place].template for place in self.needed}
        used = sorted({match[0] for template in templates if (match := re.match(r"[a-z0-9]+_\d+", template))})
        taken = [f"{name} = systems[{name.split('_')[1]}].{name.split('_')[0]}" for name in used]
        known, called = (
            [name for place, name in inputs.items() if self.level[place] == level] for level in (KNOWN, CALLED)
        )
        bound = [*known, *(line.split(" = ", 1)[0] for line in lines[KNOWN])]
        read = {*re.findall(r"\w+", " ".join((*lines[CALLED], result)))}
        handed = "".join(f"{name}, " for name in bound if name in read)
        return "\n".join(
            [
                "def program(systems):",
                *(f" {line}" for line in (*taken, "constant = systems[-1].constant", *lines[ALWAYS])),
                " def bind(known):",
                *(f"  {line}" for line in ([f"{', '.join(known)}, = known"] if known else []) + [*lines[KNOWN]]),
                f"  return partial(function, ({handed}))",
                f" def function({', '.join(('bound', *called))}):",
                *([f"  {handed}= bound"] if handed else []),
                *(f"  {line}" for line in lines[CALLED]),
                f"  return ({result})",
                " return bind",
            ]
        )

    def _literal(self, place: int, value: Number) -> str:
        """Text of a literal: a name where it has no exact text."""
        if type(value) in (int, float) and math.isfinite(value):
            return repr(value) if math.copysign(1.0, value) > 0 else f"({value!r})"
        self.literals[f"k{place}"] = value
        return f"k{place}"


def recorded(tape: Tape, system: int = 0) -> Maths:
    """Numbers that record their operations on a tape; system: their number system, by its place in `Program`."""

    def function(name: str) -> Callable[..., Number]:
        return functools.partial(tape.call, system, name)

    def spread(numbers: Sequence[Number], pattern: Iterable[Number]) -> Number:
        return tape.call(system, "spread", tape.listed(numbers), tape.listed(pattern))

    def weighted(weights: Sequence[Sequence[Number]], values: Number) -> list[Number]:
        result = tape.call(system, "weighted", tape.listed([tape.listed(row) for row in weights]), values)
        return [tape.record("{0}[{1}]", result, k) for k in range(len(weights))]

    sin, cos, sqrt, atan2, number, exp = map(function, ("sin", "cos", "sqrt", "atan2", "number", "exp"))
    pi, choose, floor = tape.record(f"pi_{system}"), functools.partial(tape.choose, system), function("floor")
    return Maths("recorded", sin, cos, sqrt, atan2, pi, number, choose, exp, spread, weighted, floor=floor)
