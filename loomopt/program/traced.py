"""Whole-cycle quantities of a model as recorded formulas: written down once, then run without the model's own Python.

What the scene's numbers give at once is taken from `Given`; what else does not depend on the node is computed when a
formula is bound to a design. A formula is recorded once it was evaluated often enough to be worth it: before, after,
and where it cannot be recorded, the numbers are the same to the last bit.

Time of the recorded formula over that of the formula itself, one run, the mean of all quantities (beat-up, rapier,
shedding): floats 0.24, 0.14, 0.25; balls 0.43, 0.37, 0.34; 20 nodes of NumPy 0.48, 0.32, 0.41, 720 of them 0.77, 0.68,
0.56, 8192 0.71, 0.52, 0.36; jets 0.67, 0.78, 0.68; 40 digits 0.72, 0.70, 0.60. So all of these run recordings. Formulas
themselves are run on a sampler's own grid, where the quantities that are asked for share one pose; for rows of the
design alone, which share their dead centres (in jets a recording takes nine times as long); and by the NLPs.
"""

import weakref
from collections.abc import Callable
from dataclasses import dataclass, field

from loomopt.maths import recording
from loomopt.maths.recording import Bind, Program, Recorded, Tape
from loomopt.maths.systems import Maths, Number
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Node
from loomopt.program.model import JobModel

WORTH_IT = 64
"""Evaluations after which a formula is recorded: that takes 1 to 3 ms, and saves some 30 us of each."""


AtNode = Callable[[Node], tuple[Number, ...]]


@dataclass(frozen=True)
class Recording:
    """Quantities written down.

    known: what they read of a design, by case (0: the first) and name; switches: what they read of a node beside φ.
    """

    program: Program
    known: tuple[tuple[int, str], ...]
    switches: tuple[str, ...]
    _bind: dict[tuple[Maths, Maths], Bind] = field(default_factory=dict)

    def bind(self, systems: tuple[Maths, Maths], given: Given) -> AtNode:
        """Return the quantities of one design as a function of the node."""
        if systems not in self._bind:
            self._bind[systems] = self.program(systems)
        cases, names = (given, *given.cases), self.switches
        function = self._bind[systems]([cases[case].values[name] for case, name in self.known])

        def at(node: Node) -> tuple[Number, ...]:
            switch = node.switch
            return function(node.phi, *[switch[name] for name in names])

        return at


@dataclass
class _History:
    """How often quantities of a model were evaluated, and their recording, if they have one."""

    evaluations: int = 0
    recording: Recording | None = None
    refused: bool = False


_HISTORIES: weakref.WeakKeyDictionary[JobModel, dict[object, _History]] = weakref.WeakKeyDictionary()


class Quantities:
    """Whole-cycle quantities of one design at nodes, SI.

    systems: of the design's numbers, as `given` has them, and of the nodes'.
    """

    def __init__(self, model: JobModel, systems: tuple[Maths, Maths], given: Given) -> None:
        self.model, self.systems, self.given = model, systems, given
        self._bound: dict[tuple[tuple[str, ...], tuple[str, ...]], AtNode] = {}

    def __call__(self, names: tuple[str, ...], node: Node) -> tuple[Number, ...]:
        """Return quantities by their names at a node, or at nodes, in one pass."""
        switches = tuple(node.switch)
        run = self._bound.get((names, switches))
        if run is None:
            histories = _HISTORIES.setdefault(self.model, {})
            run = self._run(names, switches, histories.setdefault((names, switches, self.given.known), _History()))
        if run is None:
            read = self.model.together(self.systems[1], self.given, node)
            return tuple([read(name) for name in names])
        return run(node)

    def _run(self, names: tuple[str, ...], switches: tuple[str, ...], history: _History) -> AtNode | None:
        """Return the recorded quantities of this design, None where there is no recording, or not yet."""
        history.evaluations += 1
        if history.recording is None and history.evaluations > WORTH_IT and not history.refused:
            try:
                history.recording = recorded(self.model, names, switches, self.given.known)
            except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
                # A formula that decides by a value, as a plug-in's may, is run as it is.
                history.refused = True
        if history.recording is None:
            return None
        self._bound[names, switches] = run = history.recording.bind(self.systems, self.given)
        return run


def recorded(model: JobModel, names: tuple[str, ...], switches: tuple[str, ...], known: frozenset[str]) -> Recording:
    """Return quantities written down; switches: names of what nodes tell; known: of the scene's numbers.

    Raises what a formula raises that cannot be recorded.
    """
    tape = Tape()
    first, there = (recording.recorded(tape, system) for system in range(2))
    phi, switch = tape.input(), {name: tape.input() for name in switches}
    raw = model.given(first, {name: tape.input() for name in sorted(known)})
    inputs: dict[int, tuple[int, str]] = {}
    cases = []
    for k, case in enumerate((raw, *raw.cases)):
        values = {of: tape.known(value) if isinstance(value, Recorded) else value for of, value in case.values.items()}
        inputs |= {value.place: (k, of) for of, value in values.items() if isinstance(value, Recorded)}
        cases.append(Given(values, case.own))
    since = len(tape.operations)
    given = Given(cases[0].values, cases[0].own, tuple(cases[1:]))
    read = model.together(there, given, Node(phi, switch))
    outputs = tuple([read(name) for name in names])
    needed = tape.needed(outputs, since)
    used = {place: spot for place, spot in inputs.items() if place in needed}
    called = {name: each for name, each in switch.items() if each.place in needed}
    program = tape.program(outputs, (phi, *called.values()), [Recorded(tape, place) for place in used], since)
    return Recording(program, tuple(used.values()), tuple(called))
