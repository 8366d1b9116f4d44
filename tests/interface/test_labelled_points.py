"""Rows of a study by what its table prints of them: number, place, several columns."""

import pytest

import loomopt as lo
from loomopt.base.errors import BadInput


@pytest.fixture(scope="module")
def travels():
    return lo.sweep("shedding-static", {"mechanism.travel": "60:70:5 mm"})


@pytest.fixture(scope="module")
def front():
    return lo.pareto("shedding-static", ["K1", "X0"], points=3)


@pytest.mark.parametrize(
    "label",
    [
        *(1, "1", "point 1", "1*", "65 mm", "6.5 cm", "65", "mechanism.travel = 65 mm"),
        *({"mechanism.travel": "65 mm"}, {"mechanism.travel": 0.065}),
    ],
)
def test_a_row_of_a_sweep_by_its_label(travels, label):
    assert travels.answer(label).scene.mechanism["travel"] == pytest.approx(0.065)


@pytest.mark.slow
def test_every_row_of_a_front_by_every_number_that_is_printed(front):
    table = front.table()
    for row, (point, cells) in zip(front.rows, table.iterrows(), strict=True):
        x0, k1 = (f"{cells[name]:.6g}" for name in ("X0 [mm]", "K1 [N/m]"))
        for label in (str(point), f"X0 = {x0} mm", f"X0 {x0} mm, K1 {k1} N/m", {"K1": f"{k1} N/m"}):
            answer = front.answer(label)
            assert answer.figures["K1"] == pytest.approx(row.figures["K1"], rel=1e-9)


@pytest.mark.parametrize(
    ("label", "report"),
    [
        (7, "does not have this point"),
        ("61 mm", "does not have this point"),
        ("65 kg", "kg"),
        ("width = 3 mm", "no column width"),
        ("", "not the label"),
        (1.5, "not a whole number"),
        (None, "not a whole number"),
        (True, "not a whole number"),
    ],
)
def test_what_names_no_row_is_refused_with_what_is_allowed(travels, label, report):
    with pytest.raises(BadInput, match=report) as caught:
        travels.answer(label)
    assert "point" in str(caught.value)


def test_a_label_of_several_rows_names_them():
    study = lo.sweep("shedding-static", {"mechanism.travel": ["60 mm", "65 mm"], "mechanism.X0": ["70 mm", "75 mm"]})
    with pytest.raises(BadInput, match="names the points 0, 1"):
        study.answer("60 mm")
    assert study.answer("mechanism.travel = 60 mm, mechanism.X0 = 75 mm").scene.mechanism["X0"] == pytest.approx(0.075)
