"""The sley four-bar from its time ratio and swing, in closed form [Hong17]."""

from loomopt.maths.systems import Maths, Number


def sley(maths: Maths, theta: Number, swing: Number, l3: Number, l71: Number) -> tuple[Number, Number]:
    """Return crank l1 and rod l2 (m) of a sley l3 on a frame l71 (m) with given θ = β − β_r and swing (rad).

    A0 sees both dead centres of B1 under θ, so it lies on the circle of that inscribed angle; written with sin θ and
    cos θ, so that nothing is lost as θ → 0 (time ratio 1). Assumes a crank-rocker; the root fails where there is none.
    """
    half, along = l3 * maths.sin(swing / 2), l3 * maths.cos(swing / 2)
    sine, cosine = maths.sin(theta), maths.cos(theta)
    above = (l71**2 + along**2 - half**2) * sine + 2 * along * half * cosine
    x = above / (2 * (along * sine + half * cosine))
    y = maths.sqrt(l71**2 - x**2)
    far = maths.sqrt((x - along) ** 2 + (y + half) ** 2)
    near = maths.sqrt((x - along) ** 2 + (y - half) ** 2)
    # Not (far − near)/2: nothing is lost for a small swing.
    return 2 * y * half / (far + near), (far + near) / 2
