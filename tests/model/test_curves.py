"""Columns of curves: per second beside per radian where the speed is known, motor power, every peak a row."""

import numpy as np
import pytest

import loomopt as lo
from loomopt.interface import tables
from loomopt.jobs import registry

OUTPUT = {"beatup": ("psi", "rad"), "rapier": ("S", "m"), "shedding": ("X", "m")}
TORQUE = {"beatup": "Md", "rapier": "Md", "shedding": "cam_torque"}
PEAKS = {
    "beatup": {"peak_torque": "Md [N*m]", "peak_power": "motor_power [W]"},
    "rapier": {"peak_acceleration": "S_2 [m/rad^2]", "tape_force": "Q [N]", "peak_power": "motor_power [W]"},
    "shedding": {"peak_torque": "cam_torque [N*m]", "peak_power": "motor_power [W]", "contact_max": "N [N]"},
}


def scene_of(job):
    return lo.load(job).with_effect("head_inertia") if job == "rapier" else lo.load(job)


def without_speed(job, *effects):
    document = {table: dict(values) for table, values in lo.load(job).document.items()}
    del document["operation"]["speed"], document["targets"]
    document["effects"] = {name: values for name, values in document.get("effects", {}).items() if name in effects}
    return lo.scene(document)


def at(scene, column, angle):
    """Return a column of today's curves at a crank angle, rad."""
    curves = registry.of(scene).curves(scene, {}, 1, [angle])
    return float(curves[column][np.argmin(np.abs(curves["phi [rad]"] - angle))])


@pytest.mark.parametrize("job", OUTPUT)
def test_what_moves_per_second_is_the_derivative_by_time(job):
    scene, (name, unit) = scene_of(job), OUTPUT[job]
    omega = scene.operation["speed"]
    curves = registry.of(scene).curves(scene, {}, 72, (0.5, 3.0, 6.0))
    for order, power in ((1, ""), (2, "^2"), (3, "^3")):
        item = next((c for c in curves if c.startswith(f"{name}_{order} [")), None)
        column = f"{name}_{'t' * order} [{unit}/s{power}]"
        assert (column in curves) == (item is not None)
        if item:
            assert np.array_equal(curves[column], curves[item] * omega**order)
    step = 1e-5
    ahead, here, back = (at(scene, f"{name} [{unit}]", 1.0 + sign * step * omega) for sign in (1, 0, -1))
    assert (ahead - back) / (2 * step) == pytest.approx(at(scene, f"{name}_t [{unit}/s]", 1.0), rel=1e-5)
    assert (ahead - 2 * here + back) / step**2 == pytest.approx(at(scene, f"{name}_tt [{unit}/s^2]", 1.0), rel=1e-3)


@pytest.mark.parametrize("job", OUTPUT)
def test_motor_power_is_crank_torque_times_speed(job):
    scene = scene_of(job)
    curves = tables.curves(scene, {})
    torque = curves[f"{TORQUE[job]} [N*m]"]
    assert np.array_equal(curves["motor_power [W]"], torque * scene.operation["speed"])


@pytest.mark.parametrize("job", OUTPUT)
def test_a_curve_is_as_large_as_its_figure_says(job):
    scene = scene_of(job)
    result, figures = tables.curves(scene, {}), lo.evaluate(scene).figures
    for figure, column in PEAKS[job].items():
        assert np.abs(result[column]).max() == pytest.approx(figures[figure], rel=1e-12)


def test_the_power_follows_a_speed_that_the_design_chooses():
    scene, design = lo.load("shedding"), {"speed": 12.0}
    curves = tables.curves(scene, design)
    assert np.array_equal(curves["motor_power [W]"], curves["cam_torque [N*m]"] * 12.0)
    assert np.array_equal(curves["X_t [m/s]"], curves["X_1 [m/rad]"] * 12.0)
    figures = lo.evaluate(scene, design).figures
    assert figures["peak_power"] == pytest.approx(12.0 * figures["peak_torque"], rel=1e-12)


@pytest.mark.parametrize(("job", "effects"), [("rapier", ()), ("beatup", ("resistance",)), ("shedding", ("weight",))])
def test_without_a_speed_nothing_is_per_second_and_there_is_no_power(job, effects):
    scene = without_speed(job, *effects)
    columns = list(map(str, tables.curves(scene, {})))
    assert not [column for column in columns if "/s" in column or "[W]" in column]
    assert lo.evaluate(scene).figures["peak_power"] is None
    assert not registry.of(scene).model(scene).has_quantity("peak_power")


def test_where_forces_are_known_in_the_dwells_only_no_torque_is_claimed():
    scene = lo.load("shedding-static")
    assert scene.operation["speed"] > 0.0
    assert [lo.evaluate(scene).figures[name] for name in ("peak_torque", "peak_power")] == [None, None]
    with pytest.raises(lo.BadInput, match="peak_power"):
        lo.evaluate(scene.set("limits.peak_power.max", "1 kW"))
