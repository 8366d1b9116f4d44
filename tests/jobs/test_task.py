"""A job that says its model and its objectives alone: all else of its program is said by the scene."""

from dataclasses import replace

import pytest

from loomopt.base.errors import BadInput
from loomopt.base.records import Frozen, lazy
from loomopt.jobs import registry
from loomopt.jobs.base import Task
from loomopt.model import axes
from loomopt.physics.schema import Axis, Sense

SCENE = registry.load("beatup").update({"bounds.m4e.min": "0.5 kg", "limits.swing.min": "20 deg"})
JOB = registry.of(SCENE)
LEVELS = JOB.program(SCENE, "torque").objectives


class Plain(Task):
    """Nothing of its own but which rows a figure is read from."""

    read_from = Frozen(mu_min=("mu_near", "mu_far"))

    @lazy
    def model(self):
        return JOB.model(self.scene)

    def objectives(self):
        return LEVELS


PROGRAM = Plain(SCENE, "torque").program()


def test_variables_are_all_bounded_numbers_and_the_others_are_parameters():
    bounds = {name: (bound.min, bound.max) for name, bound in SCENE.bounds.items()}
    assert {v.called: (v.lower, v.upper) for v in PROGRAM.variables} == bounds
    assert {v.name for v in PROGRAM.variables}.isdisjoint(PROGRAM.parameters)
    assert {**SCENE.mechanism, **SCENE.operation}.keys() <= {v.name for v in PROGRAM.variables} | set(
        PROGRAM.parameters
    )


def test_limits_are_the_scenes_and_the_margins_of_the_links():
    values = {(limit.name, limit.sign): limit.value for limit in PROGRAM.limits}
    assert values["m4e", -1] == 0.5
    assert values["swing", -1] == SCENE.limits["swing"].min
    margins = [limit for limit in PROGRAM.limits if limit.name.startswith("assembly")]
    assert margins
    assert not any(limit.relaxable for limit in margins)
    assert {limit.scale for limit in margins} == {SCENE.mechanism["l4"]}


def test_today_just_inside_the_bounds_is_the_start():
    (start,) = PROGRAM.starts
    assert all(v.lower < start[v.name] < v.upper for v in PROGRAM.variables if v.lower < v.upper)
    assert start["l2"] == SCENE.mechanism["l2"]


def test_what_is_traded_takes_the_place_of_the_objectives():
    assert PROGRAM.objectives == LEVELS
    assert Plain(SCENE, "torque", ("swing",)).program().objectives == ()


def test_natural_sizes_are_those_of_variables_and_else_of_today():
    task = Plain(SCENE)
    assert task.size("l4") == max(SCENE.mechanism["l4"], SCENE.bounds["l4"].max)
    assert task.size("swing") == task.sampler.single("swing")


def test_a_limit_on_a_figure_that_nothing_gives_is_refused():
    with pytest.raises(BadInput, match="nothing in the scene gives the figure pulse_rms"):
        Plain(SCENE.without_effect("resistance").set("limits.pulse_rms.max", "400 N*m")).program()


class Ordered(Plain):
    """Two levels, of which the first comes before whatever is traded."""

    def objectives(self):
        return (*JOB.program(self.scene, "balance").objectives, *self.least())


@pytest.mark.parametrize(
    ("target", "traded", "fixed"),
    [
        ("balance", ("swing", "m4e"), ("M3_fdc",)),
        ("balance", ("peak_torque", "m4e"), ("M3_fdc",)),
        ("balance", ("M3_fdc", "m4e"), ()),
        ("", ("peak_torque", "m4e"), ()),
    ],
)
def test_a_target_s_earlier_levels_are_held_before_what_is_traded(target, traded, fixed):
    """Of any job: the last one is what the axes take the place of."""
    task = Ordered(SCENE, target, traded)
    assert tuple(level.figure for level in task.program().objectives) == fixed
    assert JOB.task(SCENE, target, traded).higher_levels() == task.higher_levels()


def test_a_level_that_an_effect_adds_is_none_of_the_target_s_own():
    shedding = registry.load("shedding").with_effect("coil")
    task = registry.of(shedding).task(shedding, "stiffness", ("K1", "X0"))
    assert [level.figure for level in task.objectives()] == ["K1", "spring_mass"]
    assert task.higher_levels() == ()


def test_an_axis_that_is_read_from_rows_of_other_names_has_their_size():
    """Whatever its name: mu.x is read from two."""
    values = {**SCENE.schema.own_axes, "mu.x": Axis("mu.x", "angle", ("mu_near", "mu_far"), senses=("most",))}
    scene = replace(SCENE, schema=replace(SCENE.schema, own_axes=values))
    request: dict[str, Sense] = {"mu.x": "most", "l2": "least"}
    task = Plain(scene, "torque", tuple(request))
    known = axes.requested_of(scene.schema.axes, scene.bounds, request, "")
    _, (first, _) = axes.with_axes(task.program(), known, request, scene.full, task.size)
    assert first.objective.scale == pytest.approx(abs(task.sampler.static["mu_near"]), rel=1e-15)
