"""What to remark where the output that loads with corners meet is not where the mechanism would have it."""

import numpy as np

from loomopt.maths import systems
from loomopt.model.model import read_at
from loomopt.model.sampling import Sampler
from loomopt.physics.effects.kinds import Load
from loomopt.scene.scene import Scene

MOST = 0.1
"""Share of the output's travel from which on a load can no longer be taken for a function of the crank angle."""
SAMPLES = 3600
"""Of one turn: a largest value is right to a few digits, as it is told."""


def twisted(scene: Scene, sampler: Sampler) -> tuple[str, ...]:
    """Say where a state's coordinate exceeds a tenth of the output's travel while a load with corners acts on it."""
    model, found = sampler.model, []
    pieces, u = sampler.grid(SAMPLES)
    for state in model.states:
        for load in (each for each in model.loads if isinstance(each, Load) and each.corners):
            on = sampler.cycle.on((load.name, 1.0))[pieces]
            if load.name not in state.carries or not on.any():
                continue
            at = model.instant(systems.numpy(), sampler.given, sampler.node(pieces[on], u[on]))
            largest = float(np.abs(read_at(state, at).coordinate()).max())
            travel = float(np.ptp(at.pose.q))
            if largest > MOST * travel:
                found.append(
                    f"while {load.name} acts the twist reaches {scene.show(largest, 'angle', 3)}, "
                    f"{100 * largest / travel:.3g} % of the rocker's travel there ({scene.show(travel, 'angle', 3)}): "
                    f"{load.name} as a function of the crank angle no longer stands. What helps: a stiffer shaft, or a "
                    f"measured pulse"
                )
    return tuple(found)
