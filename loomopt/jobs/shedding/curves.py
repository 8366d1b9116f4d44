"""Shedding curves over the cycle: columns of SI numbers with their units in the names."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from loomopt import balance, maths
from loomopt.cycle import TURN, Floats
from loomopt.jobs.shedding.design import figures, sampler
from loomopt.jobs.shedding.pose import DWELLS
from loomopt.program.sampling import Sampler

STEPS = 720


def curves(
    scene: Any, design: Mapping[str, float], steps: int = STEPS, also: Sequence[float] = ()
) -> dict[str, Floats]:
    """Return X with three derivatives, each load's term, cam force and torque, pressure angle and curvature, SI.

    Rows are `steps` equal ones, the angles `also`, rad, both ends of every segment and corner (the same angle
    twice), and where the cam force is least. What friction is in a dwell is not determined: the value by which
    contact is judged is shown. Where the warp's pull is not known, neither is the cam force: NaN.
    """
    sampled = sampler(scene, design)
    physics: Any = sampled.model
    pieces, u, theta = _rows(sampled, steps, also)
    switches = list(sampled.cycle.switches[pieces].T)
    pose = physics.pose(maths.numpy(), sampled.given, theta, switches)
    shape = theta.shape
    columns = {
        "phi [rad]": theta,
        "X [m]": pose.q,
        "X_1 [m/rad]": pose.q1,
        "X_2 [m/rad^2]": pose.q2,
        "X_3 [m/rad^3]": pose.q3,
        "s_2 [1]": sampled.at("law_acceleration", pieces, u),
    }
    force = -sampled.at("lift", pieces, u)
    unknown = physics.is_level & ~np.isin(switches[0], DWELLS)
    for load, term in balance.terms(maths.numpy(), physics.loads, pose, sampled.given, switches[3:]):
        whole = np.broadcast_to(np.asarray(term, dtype=float), shape).astype(float)
        columns[f"{load.name} [N]"] = np.where(unknown, np.nan, whole) if load.name == "warp_tension" else whole
    columns["N [N]"] = np.where(unknown, np.nan, force)
    columns["cam_torque [N*m]"] = columns["N [N]"] * pose.q1
    if physics.has_follower:
        contact = pose.contact(physics.follower(sampled.given.values))
        columns["pressure_angle [rad]"] = contact.pressure_angle
        columns["curvature [1/m]"] = contact.curvature
        columns["profile_curvature [1/m]"] = contact.profile_curvature
    return {name: np.broadcast_to(np.asarray(column, dtype=float), shape) for name, column in columns.items()}


def marks(scene: Any, design: Mapping[str, float]) -> dict[str, float]:
    """Return the cam angles a reader looks for, rad: the dwells, and where the cam force is least."""
    sampled = sampler(scene, design)
    values = sampled.given.values
    found: dict[str, float] = {}
    if float(values["far_dwell"]) > 0.0:
        found |= {"far dwell begins": float(values["begin.far"]), "far dwell ends": float(values["begin.return"])}
    if float(values["near_dwell"]) > 0.0:
        found |= {"near dwell begins": float(values["begin.near"]), "near dwell ends": 0.0}
    angle = figures(scene, design)["contact_angle"]
    return found | {"least cam force": angle if angle is not None else math.nan}


def _rows(sampled: Sampler, steps: int, also: Sequence[float]) -> tuple[np.ndarray, Floats, Floats]:
    """Return nodes (pieces, u) and their cam angles: every half degree, all extremes of N, both sides of corners."""
    starts = sampled.cycle.starts
    lowest = [sampled.angle(extreme) for extreme in sampled.extremes("lift")]
    theta = np.unique(np.append(np.linspace(0.0, TURN, steps, endpoint=False), np.mod([*lowest, *also], TURN)))
    piece = np.clip(np.searchsorted(starts, theta, side="right") - 1, 0, sampled.cycle.pieces - 1)
    inside = (theta - starts[piece]) / np.diff(starts)[piece]
    corner = np.min(np.abs(theta[:, None] - starts[None, :]), axis=1) < 1e-12
    count = np.arange(sampled.cycle.pieces)
    pieces = np.concatenate([piece[~corner], count, count])
    u = np.concatenate([inside[~corner], np.zeros(len(count)), np.ones(len(count))])
    angles = sampled.cycle.angles(pieces, u)
    order = np.lexsort((1 - u, np.round(angles, 12)))
    return pieces[order], u[order], angles[order]
