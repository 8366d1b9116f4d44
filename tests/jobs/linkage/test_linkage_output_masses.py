"""Masses that move with the output of a linkage: they load joints, shake the frame and are weighed in their places.

Against plain NumPy: positions by the law of cosines, accelerations by Fourier series, and the equilibrium of all five
links of the six-bar at once, in one matrix at each crank angle.
"""

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.model.drive import TORQUE
from reference.planar_linkages import GRAVITY, PHI, SAMPLES, Press, Series, SixBar, angle, meeting

SIX, PRESS = lo.load("sixbar-sley"), lo.load("knuckle-press")
LINKS = {"crank": "AB", "rod": "BC", "rocker": "DCE", "link": "EF", "sley": "GF"}
"""Joints of each link, the first being where its line begins."""
WHOLE = {
    "effects.inertia.offset": "20 deg",
    "effects.counterweight.mass": "9 kg",
    "effects.counterweight.angle": "150 deg",
}


def plain(scene, weighed):
    """Forces in the joints, N, shaking force, N, and moment, N m, and crank torque, N m, of today's six-bar."""
    v = scene.mechanism
    D, G = v["l4"], v["Gx"] + 1j * v["Gy"]
    at = {"A": 0 * PHI, "D": D + 0 * PHI, "G": G + 0 * PHI, "B": v["l1"] * np.exp(1j * PHI)}
    at["C"] = meeting(at["B"], D, v["l2"], v["l3"], 1)
    at["E"] = D + v["e"] * (at["C"] - D) / v["l3"] * np.exp(1j * v["epsilon"])
    at["F"] = meeting(at["E"], G, v["l5"], v["l6"], 1)
    values, other = scene.effects["inertia"], scene.effects["counterweight"]
    reed, turn = values.centre * np.exp(1j * (values.offset or 0.0)), np.pi if other.angle is None else other.angle
    bodies = [  # link, mass, place along its line and across it, inertia about that place
        ("rod", 1.5, 0.0627, 0.002),
        ("rocker", 4.0, 0.06, 0.01),
        ("link", 2.5, 0.107, 0.0096),
        ("sley", values.m, reed, values.J - values.m * values.centre**2),
        ("sley", other.mass, other.radius * np.exp(1j * turn), 0.0),
    ]
    omega, names = SixBar.OMEGA, list(LINKS)
    right, shaken, turned = np.zeros((SAMPLES, 15)), 0, 0
    for link, mass, place, inertia in bodies:
        first, second = (at[joint] for joint in LINKS[link][:2])
        heading = (second - first) / abs(second - first)
        centre = first + place * heading
        push = -mass * Series(centre).over(2) * omega**2
        couple = -inertia * Series(angle(heading)).over(2) * omega**2
        shaken, turned = shaken + push, turned + (np.conj(centre) * push).imag + couple
        load = push + (mass * GRAVITY * np.exp(-1j * np.pi / 3) if weighed else 0)
        row = 3 * names.index(link)
        right[:, row] -= load.real
        right[:, row + 1] -= load.imag
        right[:, row + 2] -= (np.conj(centre) * load).imag + couple
    front = SixBar({**v, "mass": 0.0}).front
    since = (PHI - front + np.pi) % (2 * np.pi) - np.pi
    cloth = np.where(abs(since) <= SixBar.PULSE / 2, SixBar.CLOTH * np.cos(np.pi * since / SixBar.PULSE), 0.0)
    right[:, 14] += cloth
    matrix, joints = np.zeros((SAMPLES, 15, 15)), "ABCDEFG"
    for k, link in enumerate(names):
        for joint in LINKS[link]:
            # Of the part nearer the frame or the crank on the next one.
            sign = -1.0 if (joint, link) in (("B", "crank"), ("C", "rod"), ("E", "rocker"), ("F", "link")) else 1.0
            column = 2 * joints.index(joint)
            matrix[:, 3 * k, column] = matrix[:, 3 * k + 1, column + 1] = sign
            matrix[:, 3 * k + 2, column] = -sign * at[joint].imag
            matrix[:, 3 * k + 2, column + 1] = sign * at[joint].real
    matrix[:, 2, 14] = 1.0
    result = np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
    forces = {f"force_{joint}": abs(result[:, 2 * k] + 1j * result[:, 2 * k + 1]) for k, joint in enumerate(joints)}
    return forces | {"shaking_force": abs(shaken), "shaking_moment": turned, "Md": result[:, 14]}


@pytest.mark.parametrize("weighed", [True, False], ids=["weighed", "weightless"])
@pytest.mark.parametrize("keys", [{}, WHOLE], ids=["packaged", "offset and counterweight"])
def test_every_joint_holds_the_masses_of_the_output(keys, weighed):
    scene = SIX.update(keys).with_effect("joint_forces")
    scene = scene if weighed else scene.without_effect("gravity")
    job = registry.of(scene)
    result, expected = job.sampler(scene, job.today(scene)), plain(scene, weighed)
    for name, values in expected.items():
        read = result.at_angles(TORQUE if name == "Md" else name, PHI)
        size = abs(values) if name != "Md" and name != "shaking_moment" else values
        assert np.max(abs(read - size)) <= 1e-9 * np.max(abs(values)), name


def test_the_reed_of_the_packaged_sley_shakes_the_frame():
    figures = lo.evaluate(SIX.with_effect("joint_forces").without_effect("gravity")).figures
    expected = {"shaking_force": 3512.48, "force_G": 3265.99, "shaking_moment": 917.69}
    for name, value in expected.items():
        assert figures[name] == pytest.approx(value, abs=0.005), name


def test_the_ram_is_weighed():
    figures, press = lo.evaluate(PRESS).figures, Press(dict(PRESS.mechanism))
    assert figures["peak_torque"] == pytest.approx(max(abs(press.forming)), rel=1e-9)
    assert figures["peak_torque"] == pytest.approx(8418.65, abs=0.005)
    assert figures["rms_torque"] == pytest.approx(1406.64, abs=0.005)


def yoke(output, **more):
    """Scene of a crank whose slider goes up and down on the frame with 20 kg."""
    slider = {"kind": "slider", "from": "B", "through": "A", "direction": "90 deg", "pin": "P", "side": "ahead"}
    return lo.scene(
        {
            "problem": {"name": "yoke", "job": "linkage", "title": "crank and slider"},
            "operation": {"speed": "120 rpm"},
            "mechanism": {"r": "100 mm", "l": "400 mm"},
            "parts": {
                "A": {"kind": "pivot"},
                "crank": {"kind": "crank", "at": "A", "pin": "B", "length": "r"},
                "ram": {**slider, "links": {"rod": "l"}},
            },
            "output": output,
            "effects": {"inertia": {"mass": "20 kg"}, "gravity": {"down": "-60 deg"}, **more},
        }
    )


@pytest.mark.parametrize("output", [{"slide": "ram"}, {"y": "P"}], ids=str)
def test_what_slides_is_weighed_along_its_way(output):
    scene = yoke(output)
    job = registry.of(scene)
    sampler = job.sampler(scene, job.today(scene))
    place = Series(0.1 * np.sin(PHI) + np.sqrt(0.16 - (0.1 * np.cos(PHI)) ** 2))
    expected = 20 * ((4 * np.pi) ** 2 * place.over(2) + GRAVITY * np.sin(np.pi / 3)) * place.over(1)
    assert sampler.at_angles(TORQUE, PHI) == pytest.approx(expected, abs=1e-10 * max(abs(expected)))


def test_what_leaves_a_mass_out_says_so():
    scene = SIX.with_effect("joint_forces")
    assert not any("mass" in text for text in remarks(scene))
    bare = scene.set("effects.inertia.m", None)
    (text,) = (text for text in remarks(bare) if "mass" in text)
    assert text.startswith("left out of gravity and forces in the joints and on the frame: the mass of the output")
    assert "effects.inertia.m and centre" in text
    (text,) = (text for text in remarks(bare.without_effect("joint_forces")) if "mass" in text)
    assert text.startswith("left out of gravity: ")
    assert not remarks(bare.without_effect("joint_forces", "gravity"))
    # What moves twice as far as the ram: nothing tells where it is.
    geared = yoke({"slide": "ram", "scale": "2"})
    (text,) = remarks(geared)
    assert "the mass of effects.inertia" in text
    assert "effects.mass" in text


def remarks(scene):
    return registry.of(scene).views.remarks(scene, {})


@pytest.mark.parametrize(
    ("keys", "report"),
    [({"effects.inertia.centre": None}, "centre is missing"), ({"effects.inertia.J": "0.1 kg*m^2"}, "J is less than")],
    ids=["no centre", "little J"],
)
def test_a_mass_without_a_place_is_refused(keys, report):
    with pytest.raises(BadInput, match=report):
        SIX.update(keys)


def test_a_mass_on_an_axis_that_moves_is_refused():
    tables = {name: SIX.document[name] for name in ("problem", "operation", "mechanism", "parts", "windows", "events")}
    tables |= {"output": {"angle": "link"}, "effects": {"inertia": SIX.document["effects"]["inertia"]}}
    tables["mechanism"] = {name: table for name, table in tables["mechanism"].items() if name != "end"}
    with pytest.raises(BadInput, match=r"fixed axis.*effects.mass.link"):
        lo.scene({**tables, "windows": {}, "events": {}})
