"""Former names of figures: `force.EVENT` of an output that turns is `moment.EVENT` wherever it stands."""

import json
import warnings

import pytest
from support.linkage_scenes import FOUR_BAR, changed, four_bar

from loomopt.base.errors import BadInput, FormerNameWarning
from loomopt.interface.cli.app import run
from loomopt.jobs import registry
from loomopt.studies.front import front
from loomopt.studies.sweep import plan_sweep

PLACES = [
    {"limits": {"NAME": {"max": "1 kN*m"}}},
    {"accept": {"NAME": "1 N*m"}, "limits": {"swing": {"min": "22.9 deg", "max": "23.4 deg"}}},
    {"targets": {"balance": {"least": ["NAME", "peak_torque"]}}},
    {"targets": {"balance": {"least": ["peak_torque"], "most": ["NAME"]}}},
    {"targets": {"balance": {"least": ["peak_torque"], "expected": {"NAME": "0 N*m"}}}},
]
NESTED = [
    {"limits": {"force": {"front": {"max": "1 kN*m"}, "rear": {"min": "1 N*m"}}}},
    {"accept": {"force": {"front": "1 N*m"}}},
]


def named(tables, name):
    """Return tables with a name in each place for it."""
    return json.loads(json.dumps(tables).replace("NAME", name))


def raw(tables):
    """Return the raw tables of the four-bar with others in place of its own targets."""
    values = {"targets": {"balance": {"least": ["peak_torque"]}, "torque": None}}
    return changed(changed(FOUR_BAR, values), tables)


def document(tables):
    """Return the tables of a scene as it has read them."""
    return registry.scene(raw(tables)).document


@pytest.mark.parametrize("place", PLACES[:3] + PLACES[4:], ids=str)
def test_a_scene_that_uses_the_former_name_is_the_scene_that_uses_the_name(place):
    with pytest.warns(FormerNameWarning, match=r"force\.front is now moment\.front") as report:
        former = registry.scene(raw(named(place, "force.front")))
    assert len(report) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error", FormerNameWarning)
        now = registry.scene(raw(named(place, "moment.front")))
        assert registry.scene(former.document) == now, "nor is it remarked upon again"
    assert (former.document, former.hash, former.limits) == (now.document, now.hash, now.limits)


def test_most_of_a_former_name_is_refused_by_the_name():
    place = changed(PLACES[3], {})
    with pytest.warns(FormerNameWarning), pytest.raises(BadInput, match=r"moment\.front cannot be maximised"):
        registry.scene(raw(named(place, "force.front")))


@pytest.mark.parametrize("place", NESTED, ids=str)
def test_a_key_that_is_parted_at_its_dot_is_read_too(place):
    with pytest.warns(FormerNameWarning):
        result = document(place)
    (table,) = place
    assert "force" not in result[table]
    assert {f"moment.{event}" for event in place[table]["force"]} <= result[table].keys()


@pytest.mark.parametrize("now", [{"moment.front": {"max": "2 kN*m"}}, {"moment": {"front": {"max": "2 kN*m"}}}])
def test_both_names_at_once_are_refused(now):
    with pytest.raises(BadInput, match="both are given") as caught:
        registry.scene(raw({"limits": {"force.front": {"max": "1 kN*m"}, **now}}))
    assert caught.value.key == "limits.force.front"


def test_what_a_call_sets_under_the_former_name_is_set_under_the_name():
    scene = four_bar(limits={"moment.front": {"min": "-1 N*m"}})
    with pytest.warns(FormerNameWarning):
        renamed_scene = scene.update({"limits.force.front.max": "1 kN*m", "limits.force.rear.max": "2 kN*m"})
    assert renamed_scene == scene.update({"limits.moment.front.max": "1 kN*m", "limits.moment.rear.max": "2 kN*m"})
    assert (renamed_scene.limits["moment.front"].min, renamed_scene.limits["moment.front"].max) == (-1.0, 1000.0)
    assert set(renamed_scene.call.set) == {"limits.moment.front.max", "limits.moment.rear.max"}
    with pytest.warns(FormerNameWarning):
        assert "moment.rear" not in renamed_scene.without_limit("force.rear", ["max"]).limits


def test_axes_and_ranges_of_a_front_and_keys_of_a_sweep_take_the_former_name():
    scene = four_bar()
    with pytest.warns(FormerNameWarning):
        ranges = front.si(scene, {"force.front": "0:5 N*m"})
    assert ranges == {"force.front": (0.0, 5.0)}
    with pytest.warns(FormerNameWarning):
        trade = front.trade(scene, ("force.front", "mass"), "torque", minimise="force.front", ranges=ranges)
    assert trade.key == front.trade(scene, ("moment.front", "mass"), "torque", ranges={"moment.front": (0.0, 5.0)}).key
    with pytest.warns(FormerNameWarning):
        sweep = plan_sweep(scene, {"limits.force.front.max": ["1 N*m", "2 N*m"]}, "torque")
    assert [axis.key for axis in sweep.axes] == ["limits.moment.front.max"]


@pytest.mark.filterwarnings("error")
def test_the_command_line_remarks_once_upon_a_former_name(tmp_path, capsys):
    file = tmp_path / "old.toml"
    now = registry.problems()["sixbar-sley"].read_text(encoding="utf-8")
    assert now.count("moment.front") == 4
    file.write_text(now.replace("moment.front", "force.front"), encoding="utf-8")
    for _ in range(2):
        assert run(["evaluate", str(file), "--set", "limits.force.front.max=9 kN*m", "--json"]) == 0
        output = capsys.readouterr()
        assert output.err.count("Remark: force.front is now moment.front; the old name goes in the next version.") == 1
        data = json.loads(output.out)
        assert data["units"]["moment.front"] == "N*m"
        assert "moment.front" in [limit["name"] for limit in data["limits"]]


def test_an_output_that_slides_keeps_its_force():
    scene = registry.load("knuckle-press")
    assert not scene.schema.former_names
    assert scene.schema.figures["force.bottom"].kind == "force"
