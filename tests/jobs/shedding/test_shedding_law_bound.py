"""The bound on s'' of the target `law`, prices of its limits, and laws as data: by file and in a scene.

Beside them the linear programmes of `tests/reference/shedding.py`.
"""

import itertools
import json
import math
from dataclasses import replace

import pytest
from support.shedding_cases import CYCLOID, TRAVELS, freed, plain, product, programmed

import loomopt as lo
from loomopt.interface.cli.app import run
from loomopt.scenes.packaged import problems

UNEVEN = (100, 70, 130, 60)


def small(**changes):
    """Return the printed travel's scene with a law of 8 intervals."""
    return lo.load("shedding-printed-travel").update({"targets.law.intervals": 8, **changes})


# The bound of s'' -------------------------------------------------------------------------------------------------


@pytest.mark.few(1)
@pytest.mark.parametrize("travel", TRAVELS)
def test_the_spring_falls_as_the_bound_is_loosened_which_each_law_uses_to_the_full(travel):
    case, factors = TRAVELS[travel], (0.9, 1, 1.5, 2)
    results = [freed(case, 8, bound=factor * CYCLOID).figures for factor in factors]
    for factor, figures in zip(factors, results, strict=True):
        assert figures["law_acceleration"] == pytest.approx(factor * CYCLOID, rel=1e-9)
        assert figures["K1"] == pytest.approx(programmed(case, 8, bound=factor * CYCLOID), rel=1e-9)
    springs = [figures["K1"] for figures in results]
    assert springs == sorted(springs, reverse=True)
    assert springs[-1] < 0.8 * springs[1]


@pytest.mark.few(1)
@pytest.mark.parametrize("travel", TRAVELS)
def test_without_a_bound_there_is_no_least_spring(travel):
    """More intervals always use more: the peak grows without end, the spring falls to one that no law reaches.

    That is the spring of a blow and free flight against it, in closed form: 35567.2269 and 14132.9529 N/m.
    """
    case = TRAVELS[travel]
    infimum = plain.unbounded_law(case)
    assert infimum == pytest.approx({"65.6 mm": 35567.226902713526, "14.5 mm": 14132.952938368744}[travel], rel=1e-12)
    results = [freed(case, n, bound=8 * CYCLOID).figures for n in (8, 16)]
    peaks = [figures["law_acceleration"] / CYCLOID for figures in results]
    assert 2 < peaks[0] < 3 < 4.5 < peaks[1] < 8
    above = [figures["K1"] / infimum - 1 for figures in results]
    above += [programmed(case, n, bound=64 * CYCLOID) / infimum - 1 for n in (32, 64)]
    assert above[1] == pytest.approx(programmed(case, 16, bound=64 * CYCLOID) / infimum - 1, rel=1e-8)
    assert all(0 < fine < 0.6 * coarse for coarse, fine in itertools.pairwise(above))


def test_a_bound_no_law_keeps_exits_with_what_it_must_be():
    """8 intervals that start and end at s'' = 0 rise to 1 with no less than 16/3: a linear programme of four lines."""
    answer = lo.solve(small(**{"targets.law.acceleration": 5.0}), "law")
    assert answer.status == "infeasible"
    (relaxation,) = answer.relaxation
    assert (relaxation.limit, relaxation.side) == ("law_acceleration", "max")
    assert relaxation.needed == pytest.approx(16 / 3, rel=1e-7)
    assert "law_acceleration <= 5 -> 5.33334" in answer.message
    helped = lo.solve(small(**{"targets.law.acceleration": relaxation.needed * 1.001}), "law")
    assert helped.status == "optimal"


def test_a_limit_on_the_figure_overrides_the_targets_own_bound():
    both = small(**{"targets.law.acceleration": 7.0, "limits.law_acceleration.max": "8"})
    alone = small(**{"targets.law.acceleration": 8.0})
    results = [lo.solve(scene, "law") for scene in (both, alone)]
    assert results[0].design == results[1].design
    assert results[0].figures["law_acceleration"] == pytest.approx(8, rel=1e-9)


PRICED = {
    "law_acceleration": ("targets.law.acceleration", CYCLOID, "", 1),
    "X0": ("bounds.X0.max", 0.080, " m", 1),
    "travel": ("mechanism.travel", 0.0145, " m", -1),
    "speed": ("operation.speed", 20 * math.pi, " rad/s", -1),
    "N_min": ("operation.N_min", 0.0, " N", -1),
}


@pytest.mark.few(2)
@pytest.mark.parametrize("name", PRICED)
def test_prices_are_those_of_solving_again(name):
    """Central differences, of N_min one-sided to second order."""
    key, now, unit, loosen = PRICED[name]
    scene = small()
    price = next(price for price in lo.solve(scene, "law").binding if price.limit == name)
    step = 1e-4 * now or 0.1

    def K1(steps):
        value = now + steps * step
        return lo.solve(scene.set(key, f"{value!r}{unit}" if unit else value), "law").figures["K1"]

    slope = (-3 * K1(0) + 4 * K1(1) - K1(2)) / 2 if now == 0 else (K1(1) - K1(-1)) / 2
    assert price.worth["K1"] == pytest.approx(-loosen * slope / step, rel=1e-5)


# Laws as data ----------------------------------------------------------------------------------------------------


@pytest.fixture
def cli(capsys):
    """Return a call of the command line: exit status, stdout, stderr."""

    def call(*arguments):
        status = run([str(argument) for argument in arguments])
        return status, *capsys.readouterr()

    return call


def answered(cli, *arguments):
    status, out, err = cli(*arguments, "--json")
    assert status == 0
    assert err == "" or "adds the changes of its call: targets.law.intervals = 8." in err
    return json.loads(out, parse_constant=pytest.fail)


LAW = ("shedding-printed-travel", "--set", "targets.law.intervals=8")


def test_a_found_law_goes_round_by_file_and_as_the_scenes_own(cli, tmp_path):
    result = answered(cli, "solve", *LAW, "--target", "law")
    assert isinstance(result["design"]["law"], list)
    assert len(result["design"]["law"]) == 9
    assert result["units"]["law"] == "1"
    file = tmp_path / "answer.json"
    for content in (result, result["design"]):
        file.write_text(json.dumps(content), encoding="utf-8")
        again = answered(cli, "evaluate", *LAW, "--design", file)
        assert (again["design"], again["figures"]) == (result["design"], result["figures"])
    text, scene = problems()["shedding-printed-travel"].read_text(encoding="utf-8"), tmp_path / "own.toml"
    values = f'law = "spline"\nlaw_coefficients = {result["design"]["law"]}\n#'
    assert text.count('law = "cycloidal"') == 1
    scene.write_text(text.replace('law = "cycloidal"', values), encoding="utf-8")
    solved = answered(cli, "solve", scene)
    assert solved["figures"]["K1"] == pytest.approx(result["figures"]["K1"], rel=1e-9)
    file.write_text(json.dumps({"K1": result["design"]["K1"], "X0": result["design"]["X0"]}), encoding="utf-8")
    evaluated = answered(cli, "evaluate", scene, "--design", file)["figures"]
    size = result["figures"]["contact_max"]
    assert evaluated.keys() == result["figures"].keys()
    for name, value in ((name, value) for name, value in result["figures"].items() if value is not None):
        assert evaluated[name] == pytest.approx(value, rel=1e-9, abs=1e-12 * size), name


@pytest.mark.parametrize(
    "setting",
    [
        *(f"intervals={value}" for value in ("3", "0", "-8", "257", "8.5", "many", "8 mm", "[8]")),
        *(f"acceleration={value}" for value in ("0", "-6", "nan", "inf", "much", "6 rad")),
        "symmetric=maybe",
        "interval=8",
    ],
)
def test_bad_values_of_the_target_exit_with_2_and_one_message(cli, setting):
    status, out, err = cli("solve", "shedding", "--target", "law", "--set", f"targets.law.{setting}", "--json")
    assert (status, out) == (2, "")
    assert err.startswith("loomopt: ")
    assert "targets.law" in err
    assert "Traceback" not in err


def test_a_symmetric_law_has_an_even_number_of_intervals(cli):
    arguments = ("solve", *LAW[:1], "--target", "law", "--json", "--set", "targets.law.intervals=7")
    assert cli(*arguments)[0] == 0
    status, out, err = cli(*arguments, "--set", "targets.law.symmetric=true")
    assert (status, out) == (2, "")
    assert "even" in err


@pytest.mark.few(1)
@pytest.mark.parametrize("travel", TRAVELS)
def test_with_the_angles_freed_rise_and_return_take_all_they_may(travel):
    """Dwells at their least, 50 deg each, rise and return alike: the linear programme of 130/50/130/50."""
    case = replace(TRAVELS[travel], angles=(130, 50, 130, 50))
    answer = lo.solve(product(TRAVELS[travel]).free("rise").set("targets.law.intervals", 8), "law")
    assert (answer.status, answer.certificate.whole_cycle) == ("optimal", "bounded")
    angles = [math.degrees(answer.design[name]) for name in ("rise", "far_dwell", "return", "near_dwell")]
    assert angles == pytest.approx([130, 50, 130, 50], rel=1e-9)
    assert answer.figures["K1"] == pytest.approx(programmed(case, 8), rel=1e-9)
    assert list(answer.design)[-1] == "law"


def test_the_shorter_of_rise_and_return_governs():
    """Mirrored, an undamped law needs the same spring whichever of the two is the shorter."""
    results = [freed(replace(plain.PAPER, angles=angles), 8).figures["K1"] for angles in (UNEVEN, (130, 60, 100, 70))]
    alike = freed(replace(plain.PAPER, angles=(100, 80, 100, 80)), 8).figures["K1"]
    assert results == pytest.approx([alike, alike], rel=1e-9)
