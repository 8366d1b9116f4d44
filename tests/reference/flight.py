"""A heald frame off its cam by two other methods: SciPy's integrator with events, and roots of closed forms in mpmath.

Cycloidal law; nothing of loomopt is in here. X down positive, SI, angles in rad.
"""

import math
from dataclasses import dataclass

import mpmath

MP = mpmath.MPContext()
MP.dps = 30


@dataclass(frozen=True)
class Frame:
    """Numbers of the scene; segments: rise, far dwell, return, near dwell, deg."""

    K1: float
    speed: float
    M: float = 37.68361265059934
    X0: float = 0.08
    travel: float = 0.0656
    G: float = 369.55
    T1: float = 124.545
    T2: float = 83.03
    C: float = 0.0
    F: float = 0.0
    segments: tuple = (120, 60, 120, 60)

    def cam(self, theta, m=math):
        """Return X_cam, its speed and acceleration."""
        rise, far, back = (m.pi * angle / 180 for angle in self.segments[:3])
        theta = theta % (2 * m.pi)
        if theta < rise:
            u, rate = theta / rise, self.speed / rise
        elif theta < rise + far:
            return self.travel, 0.0, 0.0
        elif theta < rise + far + back:
            u, rate = (rise + far + back - theta) / back, -self.speed / back
        else:
            return 0.0, 0.0, 0.0
        turn = 2 * m.pi * u
        s = u - m.sin(turn) / (2 * m.pi), (1 - m.cos(turn)) * rate, 2 * m.pi * m.sin(turn) * rate**2
        return tuple(self.travel * item for item in s)

    def spring_force(self, x):
        """Return what holds the frame back at rest, friction apart: K1 (X + X0) − G − T."""
        share = 1 - 2 * x / self.travel
        pull = self.T1 * share if share > 0 else self.T2 * share
        return self.K1 * (x + self.X0) - self.G - pull

    def force(self, theta, m=math):
        """Return N while the frame moves with its cam."""
        x, v, a = self.cam(theta, m)
        return self.M * a + self.C * v + self.spring_force(x) + self.F * (1 if v >= 0 else -1)

    def lift_off(self, near):
        """Return where N falls through zero near an angle, in 30 digits."""
        return MP.findroot(lambda t: self.force(t, MP), (near - 1e-4, near + 1e-4))


def flown(frame, theta, v, x=None):
    """Return where the frame lands, its relative speed there and the largest gap, by SciPy's integrator with events.

    theta: where it leaves the cam, at speed v; it is stopped and started anew where it turns and at half the travel.
    """
    from scipy.integrate import solve_ivp

    w, x = frame.speed, frame.cam(theta)[0] if x is None else x
    state, t, end, largest = [x, v], 0.0, 40 / frame.speed, 0.0
    sign = math.copysign(1.0, v)

    def gap(t, y):
        return y[0] - frame.cam(theta + w * t)[0]

    def middle(t, y):
        return y[0] - frame.travel / 2

    def turned(t, y):
        return y[1]

    def parting(t, y):
        return y[1] - frame.cam(theta + w * t)[1]

    for event in (gap, middle, turned):
        setattr(event, "terminal", True)  # noqa: B010
    setattr(gap, "direction", -1)  # noqa: B010
    while t < end:

        def slope(t, y, sign=sign):
            return [y[1], -(frame.spring_force(y[0]) + frame.C * y[1] + sign * frame.F) / frame.M]

        known = {"rtol": 1e-13, "atol": 1e-17, "method": "DOP853", "max_step": 0.02 / w}
        result = solve_ivp(slope, (t, end), state, events=(gap, middle, turned, parting), **known)
        tops = zip(result.t_events[3], result.y_events[3], strict=True)
        t, state = result.t[-1], list(result.y[:, -1])
        largest = max([largest, gap(t, state), *(gap(at, y) for at, y in tops)])
        if len(result.t_events[0]):
            return theta + w * t, state[1] - frame.cam(theta + w * t)[1], largest
        if len(result.t_events[2]) and result.t_events[2][-1] == t:
            sign, state[1] = -sign, -sign * 1e-18
        t += 1e-13
        state[0] += state[1] * 1e-13
    raise AssertionError("it does not land")


def landed(frame, lift, landing):
    """Return where it lands near `landing` after leaving at `lift`, and its relative speed: an undamped frame, mpmath.

    Every part between half open sheds is one sine about its own middle; each crossing is a root of that.
    """
    w, t = MP.mpf(frame.speed), MP.mpf(0)
    x, v, _ = frame.cam(lift, MP)
    half = MP.mpf(frame.travel) / 2
    while True:
        pull = frame.T1 if x < half or (x == half and v < 0) else frame.T2
        k = frame.K1 + 2 * MP.mpf(pull) / frame.travel
        centre = -(frame.K1 * MP.mpf(frame.X0) - frame.G - pull) / k
        n, a = MP.sqrt(k / frame.M), x - centre
        b = v / n

        def at(s, a=a, b=b, n=n, centre=centre):
            return centre + a * MP.cos(n * s) + b * MP.sin(n * s), n * (b * MP.cos(n * s) - a * MP.sin(n * s))

        crossing = _first(lambda s: at(s)[0] - half, n)
        until = (MP.mpf(landing) - lift) / w - t
        if crossing is None or crossing > until:
            s = MP.findroot(lambda s: at(s)[0] - frame.cam(lift + w * (t + s), MP)[0], until)  # noqa: B023
            theta = lift + w * (t + s)
            return theta, at(s)[1] - frame.cam(theta, MP)[1]
        x, v, t = half, at(crossing)[1], t + crossing


def _first(value, n):
    """Return the first root after 0 within a turn of the sine, None without one."""
    steps = [2 * MP.pi / n * k / 400 for k in range(1, 401)]
    signs = [value(step) > 0 for step in steps]
    place = next((k for k in range(399) if signs[k] != signs[k + 1]), None)
    return None if place is None else MP.findroot(value, (steps[place], steps[place + 1]), solver="anderson")
