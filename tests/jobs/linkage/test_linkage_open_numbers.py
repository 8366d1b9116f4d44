"""Numbers of one's own linkage that an optimum leaves open: settled by least change, and named."""

import copy

import numpy as np
import pytest

import loomopt as lo


def solved(scene, target=None):
    answer = lo.solve(scene, target=target)
    assert answer.certificate.passed
    return answer


@pytest.mark.slow
def test_crank_and_frame_of_a_shaper_are_known_by_their_ratio_alone_and_change_least():
    """The lever is turned by r/d; how large both are, no level and no limit tells."""
    answer = solved("shaper")
    assert answer.certificate.tie_breaks == ("r, d: least change from today",)
    assert answer.design["r"] / answer.design["d"] == pytest.approx(0.3, rel=1e-6)
    assert not answer.certificate.open


@pytest.mark.slow
def test_a_point_that_nothing_rewards_stays_and_is_named():
    scene = lo.load("shaper").update(
        {
            "mechanism.far": "50 mm",
            "parts.P": {"kind": "point", "on": "rod", "along": "far"},
            "bounds.far": {"min": "0 mm", "max": "100 mm"},
        }
    )
    answer = solved(scene)
    assert answer.design["far"] == pytest.approx(0.05, abs=1e-12)
    assert "far: serves no level, least change from today" in answer.certificate.tie_breaks
    assert answer.figures["peak_torque"] == pytest.approx(1336.06756, rel=1e-8)


@pytest.mark.slow
def test_the_end_of_a_rest_that_no_level_seeks_is_not_crept_along():
    """Freed in the target of balance it leaves the least torque of no rest, and goes as far as the rest holds."""
    answer = solved(lo.load("sixbar-sley").free(["end"]), "balance")
    assert answer.figures["peak_torque"] == pytest.approx(156.9927548, rel=1e-8)
    assert "end: serves no level, least change from today" in answer.certificate.tie_breaks
    assert not answer.certificate.open
    limit = next(item for item in answer.limits if item.name == "travel.rest")
    assert limit.value == pytest.approx(limit.max, rel=1e-6)


@pytest.mark.slow
def test_without_its_timing_a_path_is_met_closer_and_where_the_crank_starts_says_nothing(tmp_path):
    scene = lo.load("path-18")
    rows = (scene.paths.folder / "path-18.csv").read_text(encoding="utf-8").splitlines()
    (tmp_path / "path.csv").write_text("\n".join(row.partition(",")[2] for row in rows), encoding="utf-8")
    answer = lo.solve(scene.update({"targets.path.table": str(tmp_path / "path.csv")}), starts=1)
    assert answer.certificate.passed
    v, phi = answer.design, np.linspace(0, 2 * np.pi, 20001)
    A, D = v["Ax"] + 1j * v["Ay"], v["Dx"] + 1j * v["Dy"]
    B = A + v["l2"] * np.exp(1j * phi)
    cosine = (v["l3"] ** 2 + abs(D - B) ** 2 - v["l4"] ** 2) / (2 * v["l3"] * abs(D - B))
    P = B + (v["along"] + 1j * v["across"]) * (D - B) / abs(D - B) * np.exp(1j * np.arccos(cosine))
    places = np.loadtxt(tmp_path / "path.csv", delimiter=",", skiprows=1) @ [1, 1j]
    missed = np.abs(P[:, None] - places).min(axis=0)
    assert np.sqrt(np.mean(missed**2)) == pytest.approx(answer.figures["path_rms"], rel=1e-4)
    assert answer.figures["path_rms"] < 0.0223965, "than with the timing"
    assert any("start" in message for message in answer.certificate.tie_breaks + tuple(answer.certificate.open))


@pytest.mark.slow
def test_a_length_in_a_fixed_ratio_of_another_is_one_variable():
    """Half of a number with twice the bounds: the same optimum, and the number is twice as long."""
    scene, plain = lo.load("knuckle-press"), solved("knuckle-press")
    bound = scene.bounds["lower"]
    doubled = scene.update(
        {
            "mechanism.lower": f"{2 * scene.mechanism['lower']} m",
            "parts.ram.links.strut": "lower / 2",
            "bounds.lower": {"min": f"{2 * bound.min} m", "max": f"{2 * bound.max} m"},
        }
    )
    answer = solved(doubled)
    assert answer.figures["peak_torque"] == pytest.approx(plain.figures["peak_torque"], rel=1e-9)
    assert answer.design["lower"] == pytest.approx(2 * plain.design["lower"], rel=1e-6)


@pytest.mark.slow
def test_one_number_serves_two_lengths_in_a_ratio():
    document = copy.deepcopy(dict(lo.load("knuckle-press").document))
    document["parts"]["ram"]["links"]["strut"] = "1.25 * upper"
    del document["mechanism"]["lower"], document["bounds"]["lower"]
    answer = solved(lo.scene(document))
    assert "lower" not in answer.design
    document["parts"]["ram"]["links"]["strut"] = f"{1.25 * answer.design['upper']} m"
    peak = lo.evaluate(lo.scene(document), dict(answer.design)).figures["peak_torque"]
    assert peak == pytest.approx(answer.figures["peak_torque"], rel=1e-12)
