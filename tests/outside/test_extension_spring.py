"""An extension spring that others have worked out (me_toolbox's test, after Shigley ch. 10).

Wire .88, coil 5.41, hook radius 2.69 mm, G 80, E 197.9 GPa, 3.13 N/mm, 22.24 N. Its turns have the factor 1 + 1/(2C²)
of what shear itself gives, 1.3 % here; Shigley's own rate (eq 10-9), which the coil keeps to, leaves it out. Shear
where a hook leaves the coil (516.07 MPa here) is in no figure of the coil.
"""

import dataclasses

import pytest

from loomopt.maths.systems import FLOAT
from loomopt.physics.effects.shedding.coil import Coil

FORCE, RATE = 22.24, 3130.0
DATA = {"wire": 0.88e-3, "diameter": 5.41e-3, "turns": 12.0, "shear_modulus": 80e9, "elasticity": 197.9e9}
DATA |= {"hook_factor": 2 * 2.69 / 5.41, "initial_tension": 5.29}
SPRING = Coil(**{field.name: DATA.get(field.name, 1.0) for field in dataclasses.fields(Coil)})


def test_stresses_are_those_published():
    assert SPRING.hook_curvature == pytest.approx(1.1386699710863277, rel=1e-15)
    assert SPRING.hook_bending(FLOAT, FORCE) == pytest.approx(1060.4531303953718e6, rel=1e-15)
    assert SPRING.shear_stress(FLOAT, FORCE) == pytest.approx(560.0784754890378e6, rel=1e-14)


def test_turns_differ_by_what_shear_itself_gives():
    turns = SPRING.rate * SPRING.turns / RATE
    assert turns == pytest.approx(12.1003, abs=5e-5)
    assert turns / (1 + 1 / (2 * SPRING.index**2)) == pytest.approx(11.942266653793048, rel=1e-14)
