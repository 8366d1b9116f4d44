"""A family's model reads each member as the member's own does, whatever is shared, and shares all that it can."""

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.model.sampling import sampled

KEY = "targets.family"
CASES = {
    "own mass": ("beatup", [{"M0": "600 N*m"}, {"M0": "745 N*m", "speed": "610 rpm"}], ["m4e"]),
    "own rod, whose corners move": ("beatup", [{"M0": "600 N*m"}, {"M0": "745 N*m"}], ["l2"]),
    "own pulse": ("beatup", [{"pulse": "29.8 deg"}, {"pulse": "25 deg"}], []),
    "own shaft": ("rapier", [{"stroke": "850 mm"}, {"stroke": "820 mm"}], ["C0x"]),
    "own spring": ("shedding", [{"speed": "500 rpm"}, {"speed": "650 rpm"}, {"T1": "150 N"}], ["K1"]),
    "sum of peaks": ("beatup", [{"M0": "700 N*m"}, {"M0": "745 N*m"}], ["m4e"]),
}


def made(case):
    """Return the job of a family and its program, with a start whose own variables differ between members."""
    name, members, values = CASES[case]
    more = {f"{KEY}.of": "torque", f"{KEY}.combine": "sum"} if case == "sum of peaks" else {}
    scene = lo.load(name).update({f"{KEY}.members": members, f"{KEY}.own": values} | more)
    job = registry.of_target(scene, "family")
    program = job.program(scene, "family")
    x = dict(program.starts[0])
    for k, v in enumerate(program.variables):
        if hasattr(v.name, "of") and v.upper - v.lower < 1e9:
            x[v.name] = min(x[v.name] + 1e-3 * k * (v.upper - v.lower), v.upper)
    return job, program, program.completed(x)


@pytest.mark.parametrize("case", CASES)
def test_every_limit_is_what_it_is_in_its_member(case):
    job, program, x = made(case)
    whole = sampled(program.model, {**program.parameters, **x})
    record: dict[tuple[str, int, float], list[float]] = {}
    for limit in program.limits:
        record.setdefault((limit.name, limit.sign, limit.value), []).append(limit.residual(whole.rows))
    for part in job.parts:
        sampler = part.sampler(x)
        for limit in part.program.limits:
            name = part.limits.get(limit.name, limit.name)
            result = record[name, limit.sign, limit.value]
            alone = limit.residual(sampler.rows)
            assert min(abs(item - alone) for item in result) <= 1e-12 * max(1.0, abs(alone)), name


@pytest.mark.parametrize("case", CASES)
def test_what_is_sought_is_the_worst_or_the_sum_of_what_members_seek(case):
    job, program, x = made(case)
    whole = sampled(program.model, {**program.parameters, **x})
    levels = list(program.objectives)
    for place, level in enumerate(job.parts[0].program.objectives):
        items = [part.program.objectives[place].merit(part.sampler(x)) for part in job.parts]
        expected = (
            [max(items), sum(items)] if level.is_magnitude else [sum(items) if case == "sum of peaks" else max(items)]
        )
        for value in expected:
            assert levels.pop(0).merit(whole) == pytest.approx(value, rel=1e-10, abs=1e-12)
    assert not levels


@pytest.mark.parametrize("case", CASES)
def test_rows_in_jets_are_rows_in_floats(case):
    _, program, x = made(case)
    whole = sampled(program.model, {**program.parameters, **x})
    jets = whole.read(systems.jets())
    for limit in program.single_limits.values():
        assert float(limit.residual(jets)) == pytest.approx(float(limit.residual(whole.rows)), rel=1e-12, abs=1e-12)


def test_what_no_number_of_a_members_own_moves_stands_once():
    _, program, _ = made("own mass")
    names = [limit.name for limit in program.limits]
    assert names.count("swing") == 2  # its two sides
    assert not any(name.startswith("swing[") for name in names)
    assert program.model.switches == ("resistance",)
    _, program, _ = made("own rod, whose corners move")
    assert program.model.switches == ("resistance[1]", "resistance[2]")
    assert "swing[1]" in [limit.name for limit in program.limits]
    _, program, _ = made("own spring")
    assert [v.name for v in program.variables if not hasattr(v.name, "of")] == ["X0", "travel"]
