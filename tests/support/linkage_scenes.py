"""Scenes of linkages for tests: problems/beatup.toml as a chain of parts, and what turns a scene about."""

import copy
import tomllib

from loomopt.jobs import registry

FOUR_BAR = tomllib.loads(
    """
problem = { name = "four-bar", job = "linkage", title = "problems/beatup.toml as a chain" }
operation.speed = "600 rpm"
mechanism = { l1 = "31 mm", l2 = "65 mm", l3 = "155 mm", l4 = "167 mm" }

[parts]
A = { kind = "pivot" }
D = { kind = "pivot", x = "l4" }
crank = { kind = "crank", at = "A", pin = "B", length = "l1" }
beat = { kind = "dyad", joins = ["B", "D"], pin = "C", side = "left", links = { rod = "l2", rocker = "l3" } }

[output]
angle = "rocker"
sense = "clockwise"

[events]
front = { extreme = "max", near = "66 deg" }
rear = { extreme = "min", near = "244 deg" }

[effects]
inertia = { J = "0.62 kg*m^2" }
resistance = { torque = "745 N*m", pulse = "29.8 deg", at = "front" }
counterweight = { mass = "0 kg", radius = "80 mm" }

[bounds]
l1 = { min = "30 mm", max = "35 mm" }
l2 = { min = "60 mm", max = "85 mm" }
l3 = { min = "140 mm", max = "170 mm" }
l4 = { min = "150 mm", max = "167 mm" }
mass = { min = "0 kg", max = "12.4 kg" }

[limits]
swing = { min = "22.9 deg", max = "23.4 deg" }
sweep = { min = "177.8 deg", max = "182.2 deg" }
mu.beat = { min = "56.5 deg" }

[targets]
balance.least = ["moment.front", "peak_torque"]
torque.least = ["peak_torque"]
"""
)


def changed(document, changes):
    """Return tables with others merged into them; None takes a key out."""
    result = copy.deepcopy(dict(document))
    for name, value in changes.items():
        if value is None:
            result.pop(name, None)
        elif isinstance(value, dict) and isinstance(result.get(name), dict):
            result[name] = changed(result[name], value)
        else:
            result[name] = value
    return result


def four_bar(**changes):
    """Return the four-bar with tables merged into its own."""
    return registry.scene(changed(FOUR_BAR, changes))
