"""A crank at a speed of its own, found again: its own equation of motion, SciPy's integrator, shooting by secants.

Of the beat-up: reed J4 alone on the rocker, resistance M0 over the pulse δ; SI and rad. d(ω²/2)/dφ is ω̇ from

    D (ω_n − ω) = −M_R ψ' + J4 ψ' (ψ'' ω² + ψ' ω̇) + J_f ω̇
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

TURN = 2 * math.pi
L1, L2, L3, L4 = 0.031, 0.065, 0.155, 0.167
J4, M0, PULSE, SPEED = 0.62, 745.0, math.radians(29.8), 600 * TURN / 60
BETA = math.acos(((L2 + L1) ** 2 + L4**2 - L3**2) / (2 * (L2 + L1) * L4))


def rocker(phi):
    """Return ψ' and ψ'' by the loop's own angles: no formula of the package."""
    bx, by = L1 * math.cos(phi) - L4, L1 * math.sin(phi)
    square = bx * bx + by * by
    psi = math.atan2(by, bx) - math.acos((square + L3**2 - L2**2) / (2 * L3 * math.sqrt(square)))
    cx, cy = L3 * math.cos(psi), L3 * math.sin(psi)
    gamma = math.atan2(cy - by, cx - bx)
    first = L1 * math.sin(gamma - phi) / (L3 * math.sin(gamma - psi))
    rod = L1 * math.sin(psi - phi) / (L2 * math.sin(gamma - psi))
    pull = -L1 * math.cos(gamma - phi) - L2 * rod**2 + L3 * first**2 * math.cos(gamma - psi)
    return first, pull / (L3 * math.sin(gamma - psi))


class Machine(NamedTuple):
    """A machine whose crank turns by a motor line: mean speed, rad/s, the pulse's angles, rad, and its own equation.

    changed(motor, no_load, phi, omega): ω̇, rad/s²; motor: D and J_f.
    """

    speed: float
    pulse: tuple
    changed: Callable[[tuple[float, float], float, float, float], float]


class Turn(NamedTuple):
    """ω²/2 and the time over two stretches; the motor's speed without load, rad/s."""

    machine: Machine
    stretches: tuple
    no_load: float

    def speed(self, phi):
        """Return ω at an angle from the pulse's beginning on, rad."""
        first, last = self.stretches
        return math.sqrt(2 * (first if phi <= first.t_max else last)(phi)[0])

    def crank_torque(self, motor, phi):
        """Return what the crank takes by the flywheel's side of it: D (ω_n − ω) − J_f ω̇."""
        slope, flywheel = motor
        omega = self.speed(phi)
        return slope * (self.no_load - omega) - flywheel * self.machine.changed(motor, self.no_load, phi, omega)

    def highest(self, function, count=720):
        """Return the largest value of a function of the angle over the turn, between samples too."""
        angles = self.machine.pulse[0] + np.arange(count + 1) * TURN / count
        best = max(range(1, count), key=lambda k: function(angles[k]))
        result = minimize_scalar(
            lambda phi: -function(phi),
            bounds=(angles[best - 1], angles[best + 1]),
            method="bounded",
            options={"xatol": 1e-9},
        )
        return max(-result.fun, function(angles[0]))

    def figures(self, motor):
        """Return fluctuation, speed without load, rad/s, and the motor's largest torque, N·m."""
        greatest, least = self.highest(self.speed), -self.highest(lambda phi: -self.speed(phi))
        return {
            "fluctuation": (greatest - least) / self.machine.speed,
            "no_load_speed": self.no_load,
            "motor_torque_max": motor[0] * (self.no_load - least),
        }


def changed(motor, no_load, phi, omega):
    """Return ω̇ of the beat-up."""
    (slope, flywheel), (first, second) = motor, rocker(phi)
    inside = abs(phi - BETA) <= PULSE / 2
    pushed = M0 * math.cos(math.pi * (phi - BETA) / PULSE) * first if inside else 0.0
    return (slope * (no_load - omega) + pushed - J4 * first * second * omega**2) / (flywheel + J4 * first**2)


BEATUP = Machine(SPEED, (BETA - PULSE / 2, BETA + PULSE / 2), changed)


def run(machine, motor, half, no_load):
    """Return the turn from ω²/2 at the pulse's beginning, what it misses, and by how much it is late, s."""
    state, parts = [half, 0.0], list[object]()

    def rates(phi, state):
        omega = math.sqrt(2 * state[0])
        return machine.changed(motor, no_load, phi, omega), 1 / omega

    begin, end = machine.pulse
    for low, high in ((begin, end), (end, begin + TURN)):
        done = solve_ivp(rates, (low, high), state, "DOP853", rtol=1e-13, atol=1e-15, dense_output=True, max_step=0.1)
        state, parts = done.y[:, -1].tolist(), [*parts, done.sol]
    return Turn(machine, tuple(parts), no_load), np.array([state[0] - half, state[1] - TURN / machine.speed])


def turn(motor, machine=BEATUP):
    """Return the periodic turn with the mean speed over time."""
    x = np.array([machine.speed**2 / 2, machine.speed])
    for _ in range(8):
        miss = run(machine, motor, *x)[1]
        steps = np.diag(1e-5 * x)
        matrix = np.column_stack([(run(machine, motor, *(x + step))[1] - miss) / step.sum() for step in steps])
        move = np.linalg.solve(matrix, -miss)
        x = x + move
        if np.all(np.abs(move) < 1e-11 * x):
            break
    return run(machine, motor, *x)[0]


def figures(flywheel, motor_torque=35.0, slip=0.08):
    """Return the figures of the machine at a speed of its own."""
    motor = (motor_torque / (slip * SPEED), flywheel)
    second_turn = turn(motor)
    return second_turn.figures(motor) | {
        "speed_fdc": second_turn.speed(BETA),
        "M3_fdc": M0 - J4 * rocker(BETA)[1] * second_turn.speed(BETA) ** 2,
        "peak_torque": second_turn.highest(lambda phi: abs(second_turn.crank_torque(motor, phi))),
    }
