"""Effects that go together: of two that clash, what changes the motion itself yields."""

from loomopt.physics.effects.kinds import Check, Load, faults


def combined(effects):
    """Return the effects that can all be on at once, in the order given."""
    results = [effect for effect in effects if isinstance(effect, Load | Check)]
    for effect in (item for item in effects if not isinstance(item, Load | Check)):
        if goes([*results, effect]):
            results.append(effect)
    return [effect for effect in effects if effect in results]


def goes(effects):
    """Say whether effects can be on together, each with its first example."""
    return not list(faults({effect: effect.table(**effect.examples[0]) for effect in effects}))
