"""Beat-up curves over the cycle: columns of SI numbers with their units in the names."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from loomopt import balance, maths
from loomopt.cycle import TURN, Floats
from loomopt.jobs.beatup.design import sampler
from loomopt.program.sampling import Sampler

STEPS = 720


def curves(
    scene: Any, design: Mapping[str, float], steps: int = STEPS, also: Sequence[float] = ()
) -> dict[str, Floats]:
    """Return ψ, ψ', ψ'', each effect's term, M3 and Md over one turn for a design, SI.

    Rows are `steps` equal ones, the angles `also`, rad, both dead centres, and both sides of every corner (the same
    angle twice). Columns of what the scene does not call for are absent: no effect, no column.
    """
    sampled = sampler(scene, design)
    pieces, u, phi = _rows(sampled, steps, also)
    model: Any = sampled.model
    pose = model.pose(maths.numpy(), sampled.given, sampled.cycle.angles(pieces, u))
    switches = list(sampled.cycle.switches[pieces].T)
    columns = {"phi [rad]": phi, "psi [rad]": -pose.q, "psi_1 [1]": -pose.q1, "psi_2 [1]": -pose.q2}
    if not model.loads:
        return columns
    names = {"resistance": "M_R"}
    for load, term in balance.terms(maths.numpy(), model.loads, pose, sampled.given, switches):
        columns[f"{names.get(load.name, load.name)} [N*m]"] = np.broadcast_to(term, phi.shape).astype(float)
    if any(load.acts == "output" for load in model.loads):
        arguments = (maths.numpy(), model.loads, pose, sampled.given, switches)
        columns["M3 [N*m]"] = np.broadcast_to(balance.output_force(*arguments), phi.shape).astype(float)
    columns["Md [N*m]"] = sampled.at("peak_torque", pieces, u)
    return columns


def marks(scene: Any, design: Mapping[str, float]) -> dict[str, float]:
    """Return the crank angles a reader looks for, rad: both dead centres, and the pulse's ends where there is one."""
    values = sampler(scene, design).given.values
    found = {
        "front dead centre": values["beta"] % TURN,
        "rear dead centre": (np.pi + values["beta_r"]) % TURN,
    }
    if "resistance" in scene.effects:
        half = scene.effects["resistance"].pulse / 2
        found |= {"pulse begins": values["beta"] - half, "pulse ends": values["beta"] + half}
    return found


def _rows(sampled: Sampler, steps: int, also: Sequence[float]) -> tuple[np.ndarray, Floats, Floats]:
    """Return nodes (pieces, u) and their angles from 0 to 2π, corners from both sides."""
    values, starts = sampled.given.values, sampled.cycle.starts
    centres = [values["beta"], np.pi + values["beta_r"]]
    phi = np.unique(np.concatenate([np.linspace(0.0, TURN, steps + 1), np.mod([*centres, *also], TURN)]))
    if not sampled.cycle.order:
        return np.zeros(len(phi), dtype=np.intp), phi / TURN, phi
    corners = np.mod(starts[:-1], TURN)
    phi = phi[np.min(np.abs(phi[:, None] - corners[None, :]), axis=1) > 1e-9]
    turned = starts[0] + np.mod(phi - starts[0], TURN)
    piece = np.clip(np.searchsorted(starts, turned, side="right") - 1, 0, sampled.cycle.pieces - 1)
    inside = (turned - starts[piece]) / np.diff(starts)[piece]
    count = np.arange(sampled.cycle.pieces)
    pieces = np.concatenate([piece, np.roll(count, 1), count])
    u = np.concatenate([inside, np.ones(len(count)), np.zeros(len(count))])
    angle = np.concatenate([phi, corners, corners])
    order = np.lexsort((1 - u, angle))
    return pieces[order], u[order], angle[order]
