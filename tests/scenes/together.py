"""Effects that go together: of two that clash, what changes the motion itself yields."""

from loomopt.physics.effects.kinds import Check, Load, faults


def combined(effects):
    """Return the effects that can all be on at once, in the order given."""
    found = [effect for effect in effects if isinstance(effect, Load | Check)]
    for effect in (each for each in effects if not isinstance(each, Load | Check)):
        if goes([*found, effect]):
            found.append(effect)
    return [effect for effect in effects if effect in found]


def goes(effects):
    """Say whether effects can be on together, each with its first example."""
    return not list(faults({effect: effect.table(**effect.examples[0]) for effect in effects}))
