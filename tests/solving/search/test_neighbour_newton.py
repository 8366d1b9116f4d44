"""Between two neighbours' optima: the same rows as alone, the same bits in any company, nothing where in doubt."""

import numpy as np
import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.model.sampling import Sampler
from loomopt.solving import engine, neighbour_answer
from loomopt.solving.search import neighbour_newton

ENDS, CLOSE = (750.0, 780.0), 1e-12
"""N*m: the same limits bind all the way."""


def ended(resistance, target="balance"):
    scene = lo.load("beatup").set("operation.M0", f"{resistance!r} N*m")
    answer = engine.solve(scene, target)
    program = registry.of(scene).program(scene, target)
    return answer, neighbour_answer.optimum(scene, program, answer)


def neighbour_task(resistance, ends, optima, target="balance"):
    scene = lo.load("beatup").set("operation.M0", f"{resistance!r} N*m")
    share = (resistance - ends[0]) / (ends[1] - ends[0])
    return neighbour_answer.begun(scene, target, 1e-8, [*(item.as_dict() for item in optima), share])


@pytest.fixture(scope="module")
def optima():
    return [ended(resistance)[1] for resistance in ENDS]


def digits(result):
    return [(dict(item.best.x), item.best.certificate) for item in result]


@pytest.mark.slow
def test_what_comes_of_it_is_what_a_solve_alone_comes_to(optima):
    resistances = 755.0, 771.0
    made = neighbour_newton.solve_neighbours([neighbour_task(resistance, ENDS, optima) for resistance in resistances])
    for result, resistance in zip(made, resistances, strict=True):
        alone, _ = ended(resistance)
        best = result.best
        assert best.certificate.passed
        design = result.job.design(result.program, best.x)
        for name, value in alone.design.items():
            assert design[name] == pytest.approx(value, rel=CLOSE, abs=CLOSE), name
        prices = {price.limit.name: price.worth for price in best.certificate.binding}
        for price in alone.binding:
            assert prices[price.limit] == pytest.approx(sum(price.worth.values()), rel=1e-9)


@pytest.mark.slow
def test_it_is_the_same_bits_in_batches_of_any_size(optima):
    several = [neighbour_task(float(m), ENDS, optima) for m in np.linspace(*ENDS, 12)[1:-1]]
    whole = neighbour_newton.solve_neighbours(several * 20)
    assert len(whole) == 200
    for size in (1, 8):
        parts = [
            neighbour_newton.solve_neighbours(several[begin : begin + size]) for begin in range(0, len(several), size)
        ]
        assert digits(whole[:10]) == digits([item for part in parts for item in part]) == digits(whole[-10:])


def test_extremes_that_figures_read_are_found_with_the_certificates_and_not_again(optima, monkeypatch):
    sampled, read = [], Sampler.on_grid

    def counted(sampler, name):
        sampled.append(name)
        return read(sampler, name)

    scene, task = lo.load("beatup").set("operation.M0", "755.0 N*m"), neighbour_task(755.0, ENDS, optima)
    assert set(task.peaks) == {"peak_torque", "peak_power", "obliquity"}
    (search,) = neighbour_newton.solve_neighbours([task])
    monkeypatch.setattr(Sampler, "on_grid", counted)
    here = neighbour_answer.evaluated(scene, search)
    assert sampled == []
    peaks = {"peak_torque", "peak_power", "mu_min"}
    alone = lo.evaluate(scene, here.design).figures
    assert {name: here.figures[name] for name in peaks} == pytest.approx({n: alone[n] for n in peaks}, rel=CLOSE)


def test_what_a_target_reads_in_a_model_of_its_own_tells_no_figures():
    scene = lo.load("rapier")
    job = registry.of(scene)
    assert neighbour_answer.figure_peaks(scene, job, job.program(scene, "stroke-dwell")) == ()


@pytest.mark.slow
def test_beyond_a_change_of_what_binds_the_other_neighbours_rows_are_tried():
    """At 700 N*m other limits begin to stop it: on either side it is what stops the neighbour there."""
    ends = 695.0, 705.0
    optima = [ended(resistance)[1] for resistance in ends]
    kinds = [{row.kind for row in of.frame} for of in optima]
    assert kinds[0] != kinds[1]
    for resistance, kind in ((697.0, kinds[0]), (704.0, kinds[1])):
        (result,) = neighbour_newton.solve_neighbours([neighbour_task(resistance, ends, optima)])
        assert result.passed
        assert {row.kind for row in result.best.certificate.frame} == kind


def test_a_way_that_ends_at_no_optimum_is_left(optima):
    """Rows of another stretch: their Newton's method ends where a limit breaks, or no price is right."""
    assert neighbour_newton.solve_neighbours(
        [neighbour_task(880.0, ENDS, optima), neighbour_task(620.0, ENDS, optima)]
    ) == [None, None]


def test_an_optimum_is_read_as_it_was_written(optima):
    import json

    for item in optima:
        assert neighbour_newton.read_optimum(json.loads(json.dumps(item.as_dict()))) == item
