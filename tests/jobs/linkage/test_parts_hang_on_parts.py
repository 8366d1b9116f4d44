"""Every kind of part that drives, every kind that hangs on it, and every kind on that: each command works."""

import math

import numpy as np
import pytest
from support import hanging_parts

import loomopt as lo
from loomopt.interface.cli.app import run

COMMANDS = (
    ("show", "--equations", "--figure", "s.svg", "--animate", "s.html"),
    ("evaluate", "--json"),
    ("simulate", "--forces", "--out", "c.csv"),
    ("budget", "--json"),
    ("export", "--out", "x.dxf", "--out", "x.csv"),
    ("prove", "--json"),
    ("solve", "--starts", "1", "--json"),
    ("report", "--out", "r.html"),
)
"""What is called of each, and its options."""


@pytest.mark.few(0, slow=21)
@pytest.mark.parametrize("second", ["", *hanging_parts.CLOSURES])
@pytest.mark.parametrize("first", hanging_parts.CLOSURES)
@pytest.mark.parametrize("drive", hanging_parts.DRIVES)
def test_every_part_works_on_every_other(drive, first, second, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "hanging.toml"
    path.write_text(hanging_parts.text(hanging_parts.scene(drive, first, second)), encoding="utf-8")
    statuses = {words[0]: run([words[0], "hanging.toml", *words[1:]]) for words in COMMANDS}
    # What is not proven within the boxes allowed says so with 1, a design that is not certified with 4.
    assert statuses.pop("prove") in (0, 1)
    assert statuses.pop("solve") in (0, 3, 4)
    assert set(statuses.values()) == {0}, capsys.readouterr().err


def risen(phi):
    """Return the angle of the cam `cam` of `hanging_parts`, rad: cycloidal, 20 deg high."""
    turned = np.degrees(phi) % 360
    up, down = (turned - 60) / 100, (320 - turned) / 100
    u = np.clip(np.where(turned < 200, up, down), 0, 1)
    return math.radians(20) * (u - np.sin(2 * np.pi * u) / (2 * np.pi))


def test_a_dyad_on_a_cam_stands_where_its_two_circles_meet():
    document = hanging_parts.scene("cam", "dyad")
    curves = lo.simulate(lo.scene(document))
    angle = risen(curves["phi [rad]"].to_numpy())
    V, D = 0.1 * np.exp(1j * angle), 0.25
    span = abs(V - D)
    # The lever about D: its angle from the line to V by the law of cosines, the pin to the left of V to D.
    inner = np.arccos((span**2 + 0.15**2 - 0.22**2) / (2 * span * 0.15))
    lever = np.angle((V - D) * np.exp(-1j * inner))
    np.testing.assert_allclose(curves["q [rad]"], lever, rtol=0, atol=1e-13)


@pytest.mark.parametrize("timed", [True, False])
def test_a_point_of_a_cams_follower_follows_a_path(timed, tmp_path):
    document = hanging_parts.scene("cam", "dyad")
    document["targets"] = {"path": {"point": "V", "table": "path.csv"}}
    phi = np.radians([70.0, 100.0, 140.0, 250.0, 300.0])
    at = 0.101 * np.exp(1j * risen(phi))  # 1 mm outside where it is
    rows = [
        f"{math.degrees(a)!r},{z.real * 1e3!r},{z.imag * 1e3!r}" for a, z in zip(phi.tolist(), at.tolist(), strict=True)
    ]
    head = "phi [deg],x [mm],y [mm]"
    lines = [head, *rows] if timed else [line.partition(",")[2] for line in (head, *rows)]
    (tmp_path / "path.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (tmp_path / "hanging.toml").write_text(hanging_parts.text(document), encoding="utf-8")
    scene = lo.load(tmp_path / "hanging.toml")
    assert lo.evaluate(scene).figures["path_rms"] == pytest.approx(1e-3, rel=1e-12)
    longer = lo.load(tmp_path / "hanging.toml").set("mechanism.r1", "216 mm")
    assert lo.solve(longer, starts=1).figures["path_rms"] == pytest.approx(1e-3, rel=1e-9)
