"""Peaks of crank torque and motor power: of every job alike, limited, certified, proven; absent where nothing loads."""

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.model import drive

SCENES = {
    "beatup": lo.load("beatup"),
    "rapier": lo.load("rapier").with_effect("head_inertia"),
    "shedding": lo.load("shedding"),
}


@pytest.mark.parametrize("job", SCENES)
def test_peak_power_is_the_largest_torque_times_the_speed(job):
    scene = SCENES[job]
    figures = lo.evaluate(scene).figures
    assert figures["peak_power"] == pytest.approx(scene.operation["speed"] * figures["peak_torque"], rel=1e-12)
    assert {"peak_torque", "peak_power"} <= {proof.name for proof in lo.prove(scene).proofs}
    assert lo.evaluate(scene).units["peak_power"] == "W"


def test_nothing_is_computed_of_a_drive_without_loads():
    scene = lo.load("rapier")
    model = registry.of(scene).model(scene)
    assert not {"peak_torque", "peak_power", "tape_force"} & set(model.quantities)
    assert drive.quantities((), {"speed"}) == {}
    figures = lo.evaluate(scene).figures
    assert (figures["peak_torque"], figures["peak_power"]) == (None, None)


def test_a_limit_on_the_power_is_kept_priced_and_certified():
    scene = SCENES["beatup"].set("limits.peak_power.max", "5.5 kW")
    answer = lo.solve(scene, starts=1, prove=True)
    assert answer.status == "optimal"
    assert answer.figures["peak_power"] == pytest.approx(5500, rel=1e-8)
    (price,) = [item for item in answer.binding if item.limit == "peak_power"]
    assert price.text == "peak_power <= 5.5 kW"
    assert price.unit == {"M3_fdc": "N*m/W"}
    more = lo.solve(scene.set("limits.peak_power.max", "5.501 kW"), starts=1)
    gain = abs(answer.figures["M3_fdc"]) - abs(more.figures["M3_fdc"])
    assert gain == pytest.approx(price.worth["M3_fdc"], rel=1e-2)


def test_a_shed_slows_down_to_a_motors_power():
    scene = SCENES["shedding"].set("limits.peak_power.max", "0.5 kW")
    answer = lo.solve(scene, target="speed", starts=1)
    assert answer.status == "optimal"
    assert answer.figures["peak_power"] == pytest.approx(500, rel=1e-8)
    assert answer.figures["speed"] < lo.solve(SCENES["shedding"], target="speed", starts=1).figures["speed"]
    assert "linear programmes" not in answer.message


def test_a_limit_on_the_power_needs_a_load_and_the_speed():
    with pytest.raises(lo.BadInput, match="no effect in the scene makes a tape force"):
        lo.evaluate(lo.load("rapier").set("limits.peak_power.max", "5 W"))
    document = {table: dict(values) for table, values in lo.load("rapier").document.items()}
    del document["operation"]["speed"], document["targets"]
    document["effects"], document["limits"]["peak_power"] = {"tape_friction": {"force": "15 N"}}, {"max": "5 W"}
    with pytest.raises(lo.BadInput, match=r"peak_power needs the speed[\s\S]*Give operation.speed"):
        lo.evaluate(lo.scene(document))
