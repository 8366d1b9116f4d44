"""An uneven band and an ISO 286 fit through the commands that read tolerances: back-off, yield, families."""

import json
import math

import pytest

import loomopt as lo
from loomopt.interface.cli.app import run

UNEVEN = ("--set", 'tolerances.l1={plus="0", minus="0.05 mm"}', "--set", 'tolerances.l4={fit="H7"}')
BANDS = {"l1": (-0.05e-3, 0.0), "l4": (0.0, 0.040e-3)}
"""m; H7 of 120 to 180 mm by ISO 286-2."""
SIGMAS = 3
"""Standard deviations in half a band."""
FAMILY = ("--set", 'targets.family.members=[{M0="650 N*m"}, {M0="745 N*m"}]', "--target", "family")


def solved(capsys, *options):
    """Return the answer of the beat-up with options."""
    assert run(["solve", "beatup", *options, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def shift_and_sigma(design, name):
    """Return how far a figure's mean over the machines lies from the nominal, and its deviation, both by its slopes."""

    def figure(key, step):
        return lo.evaluate("beatup", {**design, key: design[key] + step}).figures[name]

    sigmas = {key: (high - low) / 2 / SIGMAS for key, (low, high) in BANDS.items()}
    moved = {key: (figure(key, sigma) - figure(key, -sigma)) / 2 for key, sigma in sigmas.items()}
    return sum(moved[key] / sigmas[key] * sum(BANDS[key]) / 2 for key in BANDS), math.hypot(*moved.values())


def test_robust_keeps_the_mean_machine_clear_by_its_sigmas(capsys):
    solution = solved(capsys, *UNEVEN, "--robust", "2")
    limit = next(limit for limit in solution["limits"] if limit["name"] == "theta")
    shift, sigma = shift_and_sigma(solution["design"], "theta")
    assert abs(shift) > 0.1 * sigma
    assert limit["backed_off"] == pytest.approx(shift + 2 * sigma, abs=1e-4 * sigma)
    assert limit["value"] + limit["backed_off"] == pytest.approx(limit["max"], abs=1e-6 * sigma)
    assert solution["yield"]["theta"]["value"] == pytest.approx((1 + math.erf(math.sqrt(2))) / 2, abs=2e-3)


@pytest.mark.slow
def test_yield_is_what_sampled_machines_of_the_design_have(capsys, tmp_path):
    solution = solved(capsys, *UNEVEN, "--yield", "0.95")
    assert solution["yield"]["all"]["value"] == pytest.approx(0.95, abs=1e-3)
    file = tmp_path / "design.json"
    file.write_text(json.dumps(solution["design"]), encoding="utf-8")
    assert run(["tolerance", "beatup", "--design", str(file), *UNEVEN, "--samples", "8192", "--json"]) == 0
    sampled = json.loads(capsys.readouterr().out)["yield"]["all"]
    assert sampled["value"] == pytest.approx(0.95, abs=4 * math.hypot(sampled["se"], solution["yield"]["all"]["se"]))


@pytest.mark.slow
def test_a_family_is_solved_at_its_nominal_sizes_and_its_members_are_backed_off_one_by_one(capsys):
    solution = solved(capsys, *FAMILY, *UNEVEN)
    assert solution["design"] == solved(capsys, *FAMILY)["design"]
    assert run(["solve", "beatup", *FAMILY, *UNEVEN, "--robust", "2"]) == 2
    output = capsys.readouterr()
    assert not output.out
    assert "Choose the target of one member, with its numbers set" in output.err
    member = solved(capsys, "--set", "operation.M0=650 N*m", *UNEVEN, "--robust", "2")
    assert member["scene"]["document"]["tolerances"]["l1"] == {"plus": "0", "minus": "0.05 mm"}
    assert member["scene"]["document"]["tolerances"]["l4"] == {"fit": "H7"}
    assert member["yield"]["all"]["value"] > 0.9
