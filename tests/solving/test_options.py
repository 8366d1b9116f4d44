"""What a solve may be asked for, to the last number that is allowed."""

import pytest
from support import toy

from loomopt.base.errors import BadInput
from loomopt.physics.tolerances import COARSEST, TIGHTEST
from loomopt.solving.options import MOST_STARTS, check_numbers, target_name

SCENE = toy.scene_of(toy.ToyJob(toy.program("x", {"f": lambda v: v["x"]})))


@pytest.mark.parametrize(("accuracy", "starts"), [(TIGHTEST, 1), (COARSEST, MOST_STARTS)])
def test_the_ends_of_what_is_allowed_are_allowed(accuracy, starts):
    check_numbers(accuracy, starts)


@pytest.mark.parametrize(
    ("accuracy", "starts", "key"),
    [
        (TIGHTEST * 0.999, 1, "accuracy"),
        (COARSEST * 1.001, 1, "accuracy"),
        (float("nan"), 1, "accuracy"),
        (1e-8, 0, "starts"),
        (1e-8, MOST_STARTS + 1, "starts"),
    ],
)
def test_what_lies_beyond_is_bad_input_under_its_own_name(accuracy, starts, key):
    with pytest.raises(BadInput) as caught:
        check_numbers(accuracy, starts)
    assert caught.value.key == key
    assert str(caught.value).startswith(f"{key}: ")


def test_the_default_target_is_the_jobs():
    assert target_name(SCENE, None) == target_name(SCENE, "least") == "least"
    with pytest.raises(BadInput, match="has no target most"):
        target_name(SCENE, "most")


def test_as_many_as_ten_thousand_starts_are_allowed():
    check_numbers(1e-8, 10_000)
    with pytest.raises(BadInput, match="number of starts"):
        check_numbers(1e-8, 10_001)
