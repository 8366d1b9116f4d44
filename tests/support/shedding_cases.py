"""The plain reference of the heald frame beside the product: one scene for both, answers kept for the whole run."""

import functools
from dataclasses import replace

import numpy as np

import loomopt as lo
from reference import shedding as plain

FULL = lo.load("shedding").with_effect("damping").with_effect("dry_friction")
ANGLES = ("rise", "far_dwell", "return", "near_dwell")
CYCLOID = 2 * np.pi
"""The peak s'' of the cycloidal law, by which a free law is bounded unless a scene says otherwise."""
TRAVELS = {"65.6 mm": plain.PAPER, "14.5 mm": plain.PRINTED}


def product(case):
    """Return the product's scene of a plain one: of its effects only those that are not 0."""
    optional = {"effects.damping.C": (case.C, "N*s/m"), "effects.dry_friction.F": (case.F, "N")}
    changes = {key: f"{value!r} {unit}" for key, (value, unit) in optional.items() if value}
    changes |= {f"mechanism.{name}": f"{angle!r} deg" for name, angle in zip(ANGLES, case.angles, strict=True)}
    return lo.load("shedding").update(
        {
            "mechanism.travel": f"{case.travel!r} m",
            "mechanism.law": case.law,
            "effects.weight.G": f"{case.G!r} N",
            "effects.inertia.M": f"{case.M!r} kg",
            "operation.N_min": f"{case.N_min!r} N",
            "operation.speed": f"{case.rpm!r} rpm",
            "effects.warp_tension": {"T1": f"{case.T1!r} N", "T2": f"{case.T2!r} N", "shape": case.shape},
            **changes,
        }
    )


def framed(reference):
    """Return the product's scene of a plain one, its spring free up to its preload and any stiffness."""
    spline = not isinstance(reference.law, str)
    scene = FULL.update(
        {
            "mechanism.travel": f"{reference.travel!r} m",
            "mechanism.X0": f"{reference.X0!r} m",
            "bounds.X0": {"min": "0 m", "max": f"{reference.X0!r} m"},
            "bounds.K1": {"min": "0 N/m", "max": "1e12 N/m"},
            "mechanism.law": "spline" if spline else reference.law,
            **({"mechanism.law_coefficients": list(reference.law)} if spline else {}),
            "operation.speed": f"{reference.rpm!r} rpm",
            "operation.N_min": f"{reference.N_min!r} N",
            "effects.inertia.M": f"{reference.M!r} kg",
            "effects.weight.G": f"{reference.G!r} N",
            "effects.warp_tension": {"T1": f"{reference.T1} N", "T2": f"{reference.T2} N", "shape": reference.shape},
            "effects.damping.C": f"{reference.C} N*s/m",
            "effects.dry_friction.F": f"{reference.F} N",
            **{f"mechanism.{name}": f"{value} deg" for name, value in zip(ANGLES, reference.angles, strict=True)},
        }
    )
    scene = scene if reference.C else scene.without_effect("damping")
    return scene if reference.F else scene.without_effect("dry_friction")


def freed(case, n, symmetric=False, bound=CYCLOID):
    """Return the product's least spring of a plain scene with a free law of n intervals."""
    return _freed(case, n, symmetric, float(bound))


@functools.cache
def _freed(case, n, symmetric, bound):
    values = {"intervals": n, "symmetric": symmetric, "acceleration": bound}
    return lo.solve(product(case).update({f"targets.law.{key}": value for key, value in values.items()}), "law")


def programmed(case, n, symmetric=False, bound=CYCLOID):
    """Return the same stiffness, N/m, by the plain reference's linear programmes."""
    return _programmed(case, n, symmetric, float(bound))


@functools.cache
def _programmed(case, n, symmetric, bound):
    return float(plain.least_law(case, n, bound, symmetric)[0])


def flat(design):
    """Return a design with every number of its law under a name of its own."""
    knots = {f"law_{k}": value for k, value in enumerate(design["law"])}
    return {name: value for name, value in design.items() if name != "law"} | knots


def lowest(case, law, K1, points=2001):
    """Return the least and the largest cam force, N, of s'' at even knots with a spring K1, by a dense scan."""
    at = replace(case, law=tuple(law))
    results = [plain.force(np, at, s, np.linspace(float(s[3]), float(s[4]), points), K1) for s in plain.stretches(at)]
    return min(item.min() for item in results), max(item.max() for item in results)
