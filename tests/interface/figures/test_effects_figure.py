"""The bars of an effects study: what they show, and that nothing meets."""

from dataclasses import replace

import pytest
from support import inch, overlaps, uncoiled

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.study.effects import EffectsStudy

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def shedding():
    return lo.effects(uncoiled.scene("shedding"))


def ends(axes, container):
    """Return where bars end, %."""
    return [bar.get_x() + bar.get_width() for bar in axes.containers[container]]


def test_bars_end_at_the_shares_beside_the_tolerance(shedding):
    figure = shedding.plot()
    first, limits = figure.axes
    names = [label.get_text() for label in first.get_yticklabels()]
    marked = [name.removesuffix(" (may go)") for name in names if name.endswith("(may go)")]
    assert marked == list(shedding.left_out)
    assert [name.split()[0] for name in names] == [row.effect for row in shedding.rows]
    assert first.get_xscale() == "symlog"
    assert [line.get_xdata()[0] for line in first.lines] == [0.0, 1.0, -1.0], "zero and the tolerance, %"
    for row, end in zip(shedding.rows, ends(limits, 0), strict=True):
        assert end == pytest.approx(max(100 * row.excess, 0.0), rel=1e-9, abs=1e-9)
    warp = next(k for k, row in enumerate(shedding.rows) if row.effect == "warp_tension")
    assert ends(first, 1)[warp] == pytest.approx(100 * shedding.rows[warp].regret["K1"], rel=1e-9)
    assert set(ends(first, 0)) == {0.0}, "no shift"
    texts = [text.get_text() for text in limits.texts]
    assert f"{100 * shedding.rows[0].excess:+.3g} %" in texts


def test_what_gets_less_has_a_bar_to_the_other_side(shedding):
    axes = shedding.plot().axes[0]
    regrets = [row.regret["K1"] for row in shedding.rows]
    assert min(regrets) < -0.1
    for value, bar in zip(regrets, axes.containers[1], strict=True):
        assert bar.get_width() == pytest.approx(100 * value, rel=1e-9, abs=1e-9)
    low, high = axes.get_xlim()
    assert low < 100 * min(regrets)
    assert high > 100 * max(regrets)


@pytest.mark.slow
def test_nothing_meets(shedding):
    assert overlaps.overlapping_at_every_size(shedding.plot()) == []
    long = EffectsStudy(
        replace(shedding.result, rows=tuple(replace(row, effect=row.effect * 3) for row in shedding.rows[:2]))
    )
    assert overlaps.overlapping(long.plot()) == []


@pytest.mark.slow
def test_an_inch_machine_at_350_rpm():
    study = lo.effects(uncoiled.scene(inch.scene("shedding-static", operation__speed="350 rpm")))
    assert overlaps.overlapping(study.plot()) == []
    assert "lbf/in" in study._repr_html_()
    assert "N/m" not in study._repr_html_()


def test_what_is_unknown_is_no_bar(shedding):
    gone = replace(shedding.rows[0], shift={"K1": None}, regret={"K1": None}, excess=None, may_go=False)
    figure = EffectsStudy(replace(shedding.result, rows=(gone, *shedding.rows[1:]))).plot()
    assert [text.get_text() for text in figure.axes[0].texts].count("none") == 2
    with pytest.raises(BadInput, match="nothing to draw"):
        EffectsStudy(replace(shedding.result, rows=())).plot()


@pytest.mark.slow
def test_it_is_written_the_same_each_time(shedding, tmp_path):
    paths = [tmp_path / name for name in ("a.svg", "b.svg")]
    for path in paths:
        shedding.plot(path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    with pytest.raises(BadInput):
        shedding.plot(tmp_path / "a.gif")
