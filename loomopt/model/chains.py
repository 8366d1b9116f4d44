"""Values of a model that follow one after the other, which an NLP may have for variables, and where their rows bind."""

from collections.abc import Collection
from typing import NamedTuple

from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number
from loomopt.model.kinematics import Chain
from loomopt.model.model import JobModel
from loomopt.physics.balance import Given
from loomopt.physics.schema import Values


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
    """Return the chains that hang on variables by their arcs' names; several cases have none in common."""
    arcs = () if model.cases else model.kinematics.arcs
    return {arc.name: arc.chain for arc in arcs if arc.chain and arc.chain.roots.intersection(variables)}
