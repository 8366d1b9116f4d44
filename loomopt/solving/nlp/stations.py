"""Where a cycle has the corners at which whole-cycle rows hold from the first on."""

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number
from loomopt.model.kinematics import Chain
from loomopt.model.model import JobModel
from loomopt.model.program import Program
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Cycle, Floats, Where
from loomopt.physics.schema import Values


class Epigraph(NamedTuple):
    """A variable above all rows of one group of an objective; objective: its place in the program."""

    objective: int
    rows: tuple[str, ...]


class RowFamily(NamedTuple):
    """The whole-cycle rows of one quantity: below an epigraph variable, or below a limit, each by its place.

    where: the pieces they are asked for, every one without it; known: those where the quantity is known at all.
    """

    row: str
    epigraph: int = -1
    limit: int = -1
    where: Where | None = None
    known: tuple[Where, ...] = ()

    def counts(self, switch: Values) -> bool:
        """Say whether it has rows on the pieces of a switch."""
        asked = self.where is None or switch.get(self.where[0]) == self.where[1]
        return asked and (not self.known or any(switch.get(name) == value for name, value in self.known))


def epigraphs(program: Program, elastic: bool = False) -> tuple[Epigraph, ...]:
    """Return the epigraph variables of a program's objectives, in order; an elastic one has no objectives."""
    levels = [] if elastic else list(enumerate(program.objectives))
    return tuple(Epigraph(k, level.rows) for k, level in levels if not level.is_smooth)


def families(program: Program, elastic: bool = False) -> list[RowFamily]:
    """Return the whole-cycle rows a program needs: first those of objectives, then those of limits."""
    above = enumerate(epigraphs(program, elastic))
    peaks = [(k, row) for k, epigraph in above for row in program.objectives[epigraph.objective].quantities]
    limits, known = program.cycle_limits.items(), program.model.known_of
    return [
        *(RowFamily(row, epigraph=k, known=known(row)) for k, row in peaks),
        *(RowFamily(limit.row, limit=k, where=limit.where, known=known(limit.row)) for k, limit in limits),
    ]


class Station(NamedTuple):
    """A corner of the cycle by its place among those declared, and the switches of the motion's arcs there, by name."""

    corner: int
    switch: Values


def recurrent(model: JobModel, variables: Collection[str]) -> tuple[str, ...]:
    """Return the derived values that follow one after the other where these are the variables, in order."""
    return tuple(name for chain in _chains(model, variables).values() for name in chain.names)


def roots(model: JobModel, variables: Collection[str]) -> frozenset[str]:
    """Return the variables that these values follow from."""
    return frozenset(name for chain in _chains(model, variables).values() for name in chain.roots if name in variables)


def followed(model: JobModel, variables: Collection[str], system: Maths, values: Values) -> dict[str, Number]:
    """Return what each of these values is worth by those before it; values: with all of them."""
    chains = _chains(model, variables).values()
    return {name: value for chain in chains for name, value in chain.follow(system, values).items()}


def stations(model: JobModel, given: Given, variables: Collection[str]) -> tuple[Station, ...]:
    """Return the corners at which whole-cycle rows are likely to bind where these are the variables; given: floats."""
    first, found, chains = 0, [], _chains(model, variables)
    for arc in model.kinematics.arcs if chains else ():
        if arc.name in chains:
            found += [Station(first + k, switch) for k, switch in enumerate(chains[arc.name].stations)]
        first += len(arc.corners(systems.FLOAT, given))
    return tuple(found)


def station_switches(model: JobModel, variables: Collection[str]) -> list[Values]:
    """Return the switches of these corners alone."""
    return [switch for chain in _chains(model, variables).values() for switch in chain.stations]


def _chains(model: JobModel, variables: Collection[str]) -> dict[str, Chain]:
    """Return the chains that hang on variables by their arcs' names."""
    chains = {arc.name: arc.chain for arc in model.kinematics.arcs if arc.chain}
    return {name: chain for name, chain in chains.items() if chain.roots.intersection(variables)}


def held(switches: Sequence[Values], family: RowFamily) -> list[int]:
    """Return the places of the stations, of these switches, where a family has a row."""
    return [k for k, switch in enumerate(switches) if family.counts(switch)]


class HeldStations:
    """Stations in a cycle, each on the piece whose switches of the motion's arcs are its own."""

    def __init__(self, stations: Sequence[Station], cycle: Cycle) -> None:
        self.cycle = cycle
        self.place = {station.corner: k for k, station in enumerate(stations)}
        closed = {name for station in stations for name in station.switch}
        self.opened = [k for k, name in enumerate(cycle.names) if name not in closed]
        starts = {corner: piece for piece, (corner, _) in enumerate(cycle.order)}
        self.pieces = np.zeros(len(stations), dtype=np.intp)
        self.u = np.zeros(len(stations))
        for k, station in enumerate(stations):
            piece = starts[station.corner]
            own = cycle.switch(piece)
            if any(own[name] != value for name, value in station.switch.items()):
                piece, self.u[k] = (piece - 1) % cycle.pieces, 1.0
            self.pieces[k] = piece

    def switches(self, names: Sequence[str]) -> Floats:
        """Return the switches that stations leave open, (stations, names); 0 for one the cycle does not have."""
        found = np.zeros((len(self.pieces), len(names)))
        for k, name in enumerate(names):
            if name in self.cycle.names:
                found[:, k] = self.cycle.switches[self.pieces, self.cycle.names.index(name)]
        return found

    def signs(self, sampler: Sampler, row: str) -> Floats:
        """Return what a quantity is multiplied by at each station to give what is compared with a bound."""
        if row in sampler.model.signed or not self.place:
            return np.ones(len(self.pieces))
        return np.where(sampler.at(row, self.pieces, self.u) < 0.0, -1.0, 1.0)

    def station(self, extreme: Extreme) -> int | None:
        """Return the place of the station that an extreme stands at, on its side of what loads do there; else None."""
        if not self.place or extreme.u not in (0.0, 1.0):
            return None
        corner = self.cycle.order[(extreme.piece + int(extreme.u)) % self.cycle.pieces][0]
        found = self.place.get(corner)
        if found is None:
            return None
        here, there = (self.cycle.switches[piece] for piece in (extreme.piece, self.pieces[found]))
        return found if np.array_equal(here[self.opened], there[self.opened]) else None
