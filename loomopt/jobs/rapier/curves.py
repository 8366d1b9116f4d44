"""Rapier curves over the cycle: columns of SI numbers with their units in the names."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from loomopt import balance, maths
from loomopt.cycle import TURN, Floats
from loomopt.jobs.rapier.design import sampler
from loomopt.jobs.rapier.reading import read
from loomopt.program.sampling import Sampler

STEPS = 720


def curves(
    scene: Any, design: Mapping[str, float], steps: int = STEPS, also: Sequence[float] = ()
) -> dict[str, Floats]:
    """Return S with three derivatives, φ3, φ6, φ63, each load's term, tape force and crank torque over one turn, SI.

    Rows are `steps` equal ones, the angles `also`, rad, the hand-over, and both sides of every corner (the same
    angle twice).
    """
    sampled = sampler(scene, design)
    pieces, u = _rows(sampled, steps, also)
    phi = sampled.cycle.angles(pieces, u)
    order = np.lexsort((1 - u, np.round(np.mod(phi, TURN), 12)))
    pieces, u = pieces[order], u[order]
    phi = sampled.cycle.angles(pieces, u)
    model: Any = sampled.model
    pose = model.pose(maths.numpy(), sampled.given, phi)
    front = model.pose(maths.FLOAT, sampled.given, 0.0).joints
    gap = math.atan2(front.dyad.link2.y, front.dyad.link2.x) - front.phi3
    phi63 = pose.joints.phi63(pose.front)
    columns = {
        "phi [rad]": np.mod(phi, TURN),
        "S [m]": pose.q,
        "S_1 [m/rad]": pose.q1,
        "S_2 [m/rad^2]": pose.q2,
        "S_3 [m/rad^3]": pose.q3,
        "phi3 [rad]": pose.joints.phi3,
        "phi6 [rad]": pose.joints.phi3 + gap + phi63,
        "phi63 [rad]": phi63,
        "mu [rad]": math.pi / 2 - pose.joints.obliquity,
    }
    if not model.loads:
        return columns
    switches = list(sampled.cycle.switches[pieces].T)[: len(model.loads)]
    for load, term in balance.terms(maths.numpy(), model.loads, pose, sampled.given, switches):
        columns[f"{load.name} [N]"] = np.broadcast_to(term, phi.shape).astype(float)
    columns["Q [N]"] = sampled.at("tape_force", pieces, u)
    columns["Md [N*m]"] = sampled.at("peak_torque", pieces, u)
    return columns


def marks(scene: Any, design: Mapping[str, float]) -> dict[str, float]:
    """Return the crank angles a reader looks for, rad: the sley's dead centres, the hand-over, and the dwell."""
    sampled = sampler(scene, design)
    reading, centres = read(sampled), sampled.given.values["centres"]
    found = {
        "front dead centre": 0.0,
        "rear dead centre": (math.pi + centres.beta_r - centres.beta) % TURN,
        "hand-over": reading.phi_stroke,
    }
    if "s_dwell" in scene.operation:
        found |= {"dwell begins": TURN - reading.dwell_before, "dwell ends": reading.dwell_after}
    return found


def _rows(sampled: Sampler, steps: int, also: Sequence[float]) -> tuple[np.ndarray, Floats]:
    """Return nodes (pieces, u) at every half degree and the hand-over; corners of loads from both sides."""
    starts = sampled.cycle.starts
    centres = sampled.given.values["centres"]
    marked = [read(sampled).phi_stroke, (math.pi + centres.beta_r - centres.beta) % TURN]
    phi = np.unique(np.append(np.linspace(0.0, TURN, steps, endpoint=False), [*marked, *np.mod(also, TURN)]))
    turned = starts[0] + np.mod(phi - starts[0], TURN)
    piece = np.clip(np.searchsorted(starts, turned, side="right") - 1, 0, sampled.cycle.pieces - 1)
    inside = (turned - starts[piece]) / np.diff(starts)[piece]
    ends = np.flatnonzero(_jumps(sampled))
    pieces = np.concatenate([piece, ends, (ends + 1) % sampled.cycle.pieces])
    u = np.concatenate([inside, np.ones(len(ends)), np.zeros(len(ends))])
    return pieces, u


def _jumps(sampled: Sampler) -> np.ndarray:
    """Say after which pieces a load changes its formula."""
    model: Any = sampled.model
    switches = sampled.cycle.switches[:, : len(model.loads)]
    return np.asarray(np.any(switches != np.roll(switches, -1, axis=0), axis=1))
