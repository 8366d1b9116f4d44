"""The numbers of a scene by dotted key, and the files that it names."""

import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.scenes.numbers import files, quantity


@pytest.mark.parametrize(
    ("key", "kind"),
    [
        ("operation.M0", "torque"),
        ("operation.speed", "angular speed"),
        ("mechanism.l1", "length"),
        ("effects.inertia.J4", "inertia"),
        ("effects.gravity.tilt", "angle"),
        ("bounds.l2.max", "length"),
        ("bounds.m4e.min", "mass"),
        ("limits.swing.min", "angle"),
        ("limits.mu_min.min", "angle"),
        ("targets.torque.M3_tolerance", "torque"),
        ("targets.retrofit.weights.l1", "number"),
    ],
)
def test_every_number_has_its_kind(key, kind):
    scene = lo.load("beatup").with_effect("gravity")
    scene = scene.set("targets.retrofit.weights.l1", 2)
    assert quantity(scene, key).kind == kind


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("problem.title", "it is not a number"),
        ("operation.M00", "operation.M0"),
        ("effects.gravity.tilt", "unknown number"),
        ("limits.mu_min.max", "limits.mu_min.min"),
        ("targets.balance.expected.M3_fdc", "number"),
    ],
)
def test_what_is_no_number_is_refused(key, words):
    with pytest.raises(BadInput, match=words):
        quantity(lo.load("beatup"), key)


def test_files_are_told_by_their_contents(tmp_path):
    (tmp_path / "my law.csv").write_text("a")
    scene = lo.load("rapier").set("targets.match.table", str(tmp_path / "my law.csv"))
    first = files(scene)
    assert list(first) == ["targets.match.table"]
    (tmp_path / "my law.csv").write_text("b")
    assert files(scene) != first
    assert files(lo.load("beatup")) == {}
