"""States eliminated: what follows from a scene's numbers once the loads that move with a coordinate are answered."""

import functools
from collections.abc import Callable, Mapping, Sequence

from loomopt.maths.systems import Maths, Number, arrays
from loomopt.physics import balance
from loomopt.physics.balance import Acting, Given
from loomopt.physics.cycle import Node
from loomopt.physics.effects.kinds import Carried, Effect, Event, Load, Moved, State
from loomopt.physics.schema import Values
from loomopt.program.instant import Instant, Quantity
from loomopt.program.kinematics import Kinematics


def eliminated(maths: Maths, kinematics: Kinematics, loads: Sequence[Acting], found: Given) -> Given:
    """Return the scene's numbers with what follows from them for each state."""
    for state in (load for load in loads if isinstance(load, State)):
        moving = carried(maths, kinematics, loads, found, state)
        derived = state.derived(maths, found.values, found.own[state.name], moving)
        found = found._replace(values={**found.values, **derived})
    return found


def carried(maths: Maths, kinematics: Kinematics, loads: Sequence[Acting], given: Given, state: State) -> Carried:
    """Return what moves with a state's coordinate."""
    own = [load for load in loads if isinstance(load, Load) and load.name in state.carries]
    inertias = [load.moved(given.values, given.own[load.name]) for load in own if load.moved]
    smooth = [load for load in own if not load.corners]

    def weigh(angles: Sequence[Number], weights: Sequence[Sequence[Number]]) -> list[Number]:
        system = arrays(maths)
        phi = system.spread(angles, [value for name, value in given.values.items() if name in given.known])
        force = 0 * phi
        if smooth:
            pose = kinematics.pose(system, given, Node(phi, {}))
            force = force + balance.total([term for _, term in balance.terms(system, smooth, pose, given, {})])
        return system.weighted(weights, force)

    return Carried(balance.total(inertias), weigh)


def moved(state: State, at: Instant) -> Moved:
    """Return what is read of a state at an instant."""

    def coordinate() -> Number:
        given, pose = at.given, at.pose
        reply = balance.replied(at.maths, state, at.model.loads, pose, given, at.node.switch)
        return state.coordinate(at.maths, pose, given.values, given.own[state.name], reply)

    return Moved(at.pose, coordinate, lambda: at.force)


def read(state: State, formula: Callable[[Moved], Number], sign: int, at: Instant) -> Number:
    """Return what a formula reads of a state, SI."""
    return formula(moved(state, at)) if sign > 0 else -formula(moved(state, at))


def quantities(states: Sequence[State]) -> dict[str, Quantity]:
    """Return what states tell over the cycle; of a least value its opposite, which is no figure."""
    return {
        name: Quantity(
            functools.partial(read, state, peak.read, -1 if peak.least else 1), not peak.least, signed=peak.least
        )
        for state in states
        for name, peak in state.peaks.items()
    }


def columns(states: Sequence[State]) -> Mapping[str, Callable[[Instant], Number]]:
    """Return the columns that states add to the curves, with their units."""
    return {
        name: functools.partial(read, state, formula, 1) for state in states for name, formula in state.columns.items()
    }


def rests(effects: Sequence[Effect], own: Mapping[str, Values]) -> tuple[str, ...]:
    """Return what neither proofs nor studies of accuracy cover, by states and events; own: values by effect."""
    return tuple(each.rests(own[each.name]) for each in effects if isinstance(each, State | Event))
