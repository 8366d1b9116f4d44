"""Where a cycle has the corners at which whole-cycle rows hold from the first on."""

from collections.abc import Sequence

import numpy as np

from loomopt.model.chains import Station, station_switches
from loomopt.model.program import Program
from loomopt.model.sampling import Extreme, Sampler
from loomopt.nlp.families import Family
from loomopt.physics.cycle import Cycle, Floats
from loomopt.physics.schema import Values


def held(switches: Sequence[Values], family: Family) -> list[int]:
    """Return the places of the stations, of these switches, where a family has a row."""
    return [k for k, switch in enumerate(switches) if family.counts(switch)]


def owners(program: Program, families: Sequence[Family], rows: int) -> list[int]:
    """Return the place of the family that each of so many whole-cycle rows is of: rows of stations, then slots."""
    switches = station_switches(program.model, [variable.name for variable in program.variables])
    first = [k for k, family in enumerate(families) for _ in held(switches, family)]
    return first + [k for k in range(len(families)) for _ in range((rows - len(first)) // len(families))]


class Stood:
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
