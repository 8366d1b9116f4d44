"""NLPs of the beat-up's targets at one design, and what their rows are by plain NumPy."""

import numpy as np

from loomopt.jobs import registry
from loomopt.solving.nlp.ipopt import Calls
from loomopt.solving.nlp.point import Elastic, Settings, sampler_at
from loomopt.solving.nlp.rows import epigraphs, families
from loomopt.solving.nlp.transcribe import transcribe

EFFECTS = ("counterweight_inertia", "rocker_inertia", "rod_inertia", "gravity", "bearing_friction", "centrifugal")
TARGETS = ("balance", "pulse", "torque", "retrofit")
DESIGN = {"l1": 0.0311, "l2": 0.07, "l3": 0.152, "l4": 0.166, "m4e": 3.0, "r4e": 0.06, "s": 3.0 * 0.06**2}


def program_of(effects=(), target="balance", changes=()):
    scene = registry.load("beatup")
    for name in effects:
        scene = scene.with_effect(name)
    return registry.of(scene).program(scene.update(dict(changes)), target)


def put(program, elastic=False):
    """Return a program's NLP with its arguments at DESIGN, and the sampler there; two nodes a family."""
    x = {variable.name: DESIGN[variable.name] for variable in program.variables}
    sampler = sampler_at(program, x)
    calls = Calls(program, Settings(), Elastic() if elastic else None)
    nodes = [peak[:2] for peak in calls.peaks(sampler)]
    nlp, _ = transcribe(program, sampler, 6, elastic)
    nlp.solver(False, Settings())
    extra = calls.first_extra(nlp, sampler)
    return nlp, calls.arguments(nlp, sampler, x, extra, nodes), sampler, nodes, extra


def expected_rows(program, sampler, nodes, extra):
    """Return the rows in the order of the NLP, by plain NumPy: static limits, magnitudes, nodes of each family."""
    rows = [limit.excess(sampler) for limit in program.design_limits.values()]
    for place, epigraph in enumerate(epigraphs(program)):
        objective = program.objectives[epigraph.objective]
        if objective.is_magnitude:
            value = sampler.single(objective.row) / objective.scale
            rows += [sign * value - extra[place] for sign in (1, -1)]
    for family, chosen in zip(families(program), nodes, strict=True):
        owner = owner_of(program, family)
        bound = extra[family.epigraph] if family.epigraph >= 0 else owner.value / owner.scale
        if family.square:
            size = owner.scale * (owner.value + owner.scale)
            rows += [(e.value**2 - owner.value**2) / size for e in chosen] + [0.0] * (6 - len(chosen))
        else:
            rows += [abs(e.value) / owner.scale - bound for e in chosen] + [0.0] * (6 - len(chosen))
    return np.array(rows)


def owner_of(program, family):
    """Return the objective or limit that a family's rows belong to."""
    if family.epigraph >= 0:
        return program.objectives[epigraphs(program)[family.epigraph].objective]
    return program.limits[family.limit]
