"""Several designs sampled in one pass: the same bits as each alone."""

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.model import reading
from loomopt.model.reading import WORTH_IT, bind_together
from loomopt.model.sampling import Sampler, scan_together, search_together
from loomopt.model.session import Session, working

SPREAD = 13
"""More designs than one pass reads together."""


def designs(problem, effects=()):
    """Samplers of a packaged machine and of machines with another number, and names of their quantities."""
    scene = lo.load(problem)
    for effect in effects:
        scene = scene.with_effect(effect)
    job = registry.of(scene)
    model, values = job.model(scene), job.numbers(scene)
    changed = next(name for name in values if name.endswith(("l3", "l6", "K1", "length")))
    factors = [1 + 1e-3 * k for k in range(SPREAD)]

    def samplers():
        return [Sampler(model, {**values, changed: factor * values[changed]}) for factor in factors]

    names = tuple(name for name in job.peaks(model).values() if model.has_quantity(name))
    # Formulas are recorded after many evaluations.
    for _ in range(2 + WORTH_IT // SPREAD):
        for sampler in samplers():
            sampler.quantities(names, sampler.node(*sampler.grid()))
    return samplers, names


CASES = [("beatup", ()), ("beatup", ("gravity", "counterweight_inertia")), ("rapier", ()), ("shedding", ())]


@pytest.mark.few(2)
@pytest.mark.parametrize(("problem", "effects"), CASES)
def test_extremes_and_scans_of_many_are_those_of_each(problem, effects):
    samplers, names = designs(problem, effects)
    alone, together = samplers(), samplers()
    search_together(together, names)
    scan_together(together, names, 3000)
    for one, another in zip(alone, together, strict=True):
        one.search(names)
        for name in names:
            assert one.extremes(name) == another.extremes(name), name
            assert one.singular == another.singular
            assert one.scanned(name, 3000) == another.scanned(name, 3000), name


def test_many_are_read_in_one_call_where_formulas_are_recorded():
    samplers, names = designs("beatup")
    switches = samplers()[0].cycle.names
    bound = bind_together([sampler.quantities for sampler in samplers()], names, switches)
    assert bound is not None
    assert {value.shape for value in bound.values if getattr(value, "ndim", 0)} == {(SPREAD, 1)}


def test_the_count_of_positions_is_that_of_each():
    samplers, names = designs("beatup")
    counts = []
    for search in (lambda many: [one.search(names) for one in many], lambda many: search_together(many, names)):
        many = samplers()
        before = many[0].session.positions
        search(many)
        counts.append(many[0].session.positions - before)
    assert counts[0] == counts[1] > 0


def test_what_is_known_is_not_read_again():
    samplers, names = designs("beatup")
    many = samplers()
    search_together(many, names)
    scan_together(many, names, 3000)
    before = many[0].session.positions
    search_together(many, names)
    scan_together(many, names, 3000)
    assert many[0].session.positions == before


def test_a_formula_that_sums_over_its_nodes_is_not_read_together(monkeypatch):
    """Nodes of two designs in one call would be mixed."""
    monkeypatch.setattr(reading, "ACROSS_NODES", ("cos_",))
    with working(Session()):
        samplers, names = designs("beatup")
        quantities = [sampler.quantities for sampler in samplers()]
        assert quantities[0].bound(names, samplers()[0].cycle.names) is not None
        assert bind_together(quantities, names, samplers()[0].cycle.names) is None
