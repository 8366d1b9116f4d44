"""This checkout against another: the same answers to every packaged scene and target, and to variations of them.

A case is the same when its status, its binding limits and the keys of its JSON are, and when its objectives agree to
1e-12 of their scale (`Objective.scale`); of a case without an optimum, when the same limits clash and the least
relaxation is the same to 1e-9; of a refusal, when its words are. Every exception is printed; the exit code says
whether there are any.

    git worktree add ../before TAG
    python benchmarks/measure/same_answers.py ../before [--only SCENE] [--json]
"""

import sys
from collections.abc import Iterator, Mapping
from typing import Any

from benchmarks import harness
from benchmarks.measure import checkouts

SAME = 1e-12
RELAXED = 1e-9
SCENES = {
    "beatup": ("balance", "pulse", "torque", "retrofit"),
    "beatup-heavy": ("balance", "pulse", "torque", "retrofit"),
    "beatup-light": ("balance", "pulse", "torque", "retrofit"),
    "rapier": ("stroke-dwell", "dwell", "smooth", "match"),
    "shedding": ("stiffness", "law", "force", "speed"),
    "shedding-printed-travel": ("stiffness", "law", "force", "speed"),
    "shedding-static": ("stiffness", "force", "speed"),
    "cam-sley": ("balance", "pressure", "smallest"),
    "knuckle-press": ("torque",),
    "path-18": ("path",),
    "shaper": ("torque",),
    "sixbar-sley": ("balance", "pulse", "retrofit", "torque", "rms", "smooth", "dwell"),
}
REED = ("counterweight_inertia", "rocker_inertia", "rod_inertia", "gravity", "bearing_friction", "centrifugal")
TAPE = ("head_inertia", "tape_friction")
FRAME = ("damping", "dry_friction")
LAWS = ("harmonic", "modified_sine", "modified_trapezoid", "polynomial_345", "polynomial_4567", "polynomial_56789")
COIL: dict[str, Any] = {f"bounds__{name}__free": True for name in ("wire", "diameter", "turns", "initial_tension")}
Case = dict[str, Any]


def case(name: str, target: str, *effects: str, free: str = "", options: Any = None, **changes: Any) -> Case:
    """One case; a change's key is written with __ for the dot."""
    keys = {key.replace("__", "."): value for key, value in changes.items()}
    return {"scene": name, "target": target, "effects": effects, "free": free, "set": keys, "options": options or {}}


def beatups() -> Iterator[Case]:
    """Yield variations of the beat-up: cloth, speed, effects, bounds, limits, and what cannot be had."""
    for M0 in (590, 700, 745.5, 830, 900):
        yield case("beatup", "balance", operation__M0=f"{M0} N*m")
    for target in ("balance", "torque"):
        yield case("beatup", target, operation__speed="450 rpm")
        yield case("beatup", target, *REED)
        yield case("beatup", target, *REED, effects__rod_inertia__model="exact")
    for effect in REED:
        yield case("beatup", "balance", effect)
    yield case("beatup", "pulse", *REED)
    yield case("beatup", "retrofit", *REED)
    yield case("beatup", "balance", effects__resistance__pulse="1 deg")
    yield case("beatup", "balance", bounds__m4e="3 kg")
    yield case("beatup", "balance", bounds__m4e__max="0 kg")
    yield case("beatup", "balance", bounds__l1="31 mm", bounds__l4__max="160 mm")
    yield case("beatup", "balance", bounds__l2__max="82 mm", limits__mu_min__min="57 deg")
    yield case("beatup", "balance", limits__swing={"min": "23.08 deg", "max": "23.08 deg"})
    yield case("beatup", "torque", limits__J4__max="0.65 kg*m^2")
    yield case("beatup", "torque", limits__peak_torque__max="100 N*m", targets__torque__M3_tolerance="0 N*m")
    yield case("beatup", "balance", limits__pulse_rms__max="400 N*m")
    for name, weight in (("l1", 50.0), ("l2", 1e6), ("l4", 1e6)):
        heavy: dict[str, Any] = {f"targets__retrofit__weights__{name}": weight}
        yield case("beatup", "retrofit", **heavy)
    yield case("beatup", "balance", limits__peak_torque__max="40 N*m")
    yield case("beatup", "pulse", limits__pulse_rms__max="100 N*m")
    yield case("beatup", "torque", bounds__l4__max="152 mm")
    yield case("beatup", "balance", limits__tape_force__max="1 N")
    yield from (case("beatup", "balance", options={"accuracy": accuracy}) for accuracy in (1e-3, 1e-11))
    yield case("beatup", "balance", options={"starts": 4, "seed": 3})


def rapiers() -> Iterator[Case]:
    """Yield variations of the rapier drive."""
    for stroke, dwell in ((700, 40), (900, 20)):
        at = {"operation__stroke": f"{stroke} mm", "operation__dwell_after": f"{dwell} deg"}
        yield case("rapier", "stroke-dwell", **at)
    yield case("rapier", "stroke-dwell", free="sley")
    yield from (case("rapier", "stroke-dwell", effect) for effect in TAPE)
    yield case("rapier", "stroke-dwell", *TAPE, limits__tape_force__max="470 N")
    yield case("rapier", "stroke-dwell", *TAPE, limits__peak_torque__max="260 N*m")
    yield case("rapier", "dwell", limits__peak_acceleration__max="0.9 m/rad^2")
    yield case("rapier", "stroke-dwell", limits__peak_jerk__max="1.6 m/rad^3")
    yield case("rapier", "stroke-dwell", operation__dwell_after="80 deg", operation__dwell_before="80 deg")
    yield case("rapier", "stroke-dwell", limits__peak_acceleration__max="0.6 m/rad^2")
    yield case("rapier", "stroke-dwell", bounds__l6="180 mm", limits__mu_min__min="35 deg")


def sheddings() -> Iterator[Case]:
    """Yield variations of the heald frame."""
    for law in LAWS:
        yield case("shedding", "stiffness", *FRAME, mechanism__law=law)
        yield case("shedding", "force", mechanism__law=law)
    for shape in ("linear", "step"):
        yield case("shedding", "stiffness", effects__warp_tension__shape=shape, operation__N_min="50 N")
        yield case("shedding", "law", "dry_friction", effects__warp_tension__shape=shape, targets__law__intervals=8)
    for symmetric in (False, True):
        values: dict[str, Any] = {"targets__law__symmetric": symmetric, "targets__law__intervals": 8}
        yield case("shedding", "law", *FRAME, **values)
        yield case("shedding-printed-travel", "law", **values, operation__speed="500 rpm")
    yield case("shedding", "stiffness", free="rise")
    yield case("shedding", "stiffness", "damping", free="rise")
    yield case("shedding", "stiffness", bounds__X0__max="60 mm")
    yield case("shedding", "stiffness", limits__contact_max__max="25 kN", operation__N_min="10 N")
    yield case("shedding", "force", bounds__K1__max="110 kN/m")
    yield case("shedding", "stiffness", bounds__K1__max="100 kN/m")
    yield case("shedding", "force", limits__contact_max__max="10 kN")
    yield case("shedding", "stiffness", limits__pressure_angle_max__max="20 deg")
    yield case("shedding", "speed", operation__N_min="100 N")
    slow: dict[str, Any] = {"operation__speed": "177 rpm"}
    yield case("shedding", "stiffness", "coil", **slow, **COIL)
    yield case("shedding", "stiffness", "coil", **slow)


def cases() -> list[Case]:
    """Every packaged scene and target, then the variations."""
    packaged = [case(name, target) for name, targets in SCENES.items() for target in targets]
    return [*packaged, *beatups(), *rapiers(), *sheddings()]


def name_of(request: Case) -> str:
    """Return what a case is called in the list of exceptions."""
    changes = [f"{key} = {value}" for key, value in request["set"].items()]
    parts = [*request["effects"], *([f"free {request['free']}"] if request["free"] else []), *changes]
    parts += [f"{key} {value}" for key, value in request["options"].items()]
    return " ".join([request["scene"], request["target"], *([f"({', '.join(parts)})"] if parts else [])])


# In a worker ------------------------------------------------------------------------------------------------------


def answered(request: Case) -> Case:
    """Return what is compared of a case's answer."""
    import loomopt as lo

    try:
        scene = lo.load(request["scene"])
        for effect in request["effects"]:
            scene = scene.with_effect(effect)
        scene = scene.update(request["set"])
        scene = scene.free(request["free"]) if request["free"] else scene
        answer = lo.solve(scene, request["target"], **request["options"])
    except lo.BadInput as error:
        return {"status": "refused", "message": str(error)}
    objectives = program_of(scene, request["target"]).objectives
    result, reached = answer.as_dict(), {**answer.design, **answer.figures}
    today = answer.today if hasattr(answer, "today") else answer.before
    return {
        "status": answer.status,
        "message": answer.message,
        "objectives": [[item.figure, reached[item.figure], item.scale, item.power] for item in objectives],
        "binding": sorted(f"{price.limit} {price.side}" for price in answer.binding),
        "worth": {f"{p.limit} {p.side}": dict(p.worth) for p in answer.binding},
        "keys": sorted(keys(result)),
        "clash": sorted(answer.clash),
        "relaxation": {f"{item.limit} {item.side}": item.needed for item in answer.relaxation},
        "figures": {**result["figures"], **{f"today's {k}": v for k, v in today.figures.items()}}
        if today
        else result["figures"],
    }


def program_of(scene: Any, target: str) -> Any:
    """Program of a target."""
    from loomopt.jobs import registry

    return registry.of(scene).program(scene, target)


def keys(result: Any, at: str = "") -> Iterator[str]:
    """Yield the paths of all keys of a JSON object; those of a list's entries once."""
    if isinstance(result, Mapping):
        for key, value in result.items():
            yield f"{at}.{key}"
            yield from keys(value, f"{at}.{key}")
    elif isinstance(result, list):
        for value in result:
            yield from keys(value, f"{at}[]")


# Compared ---------------------------------------------------------------------------------------------------------


def differences(here: Case, there: Case) -> Iterator[str]:
    """Yield how two answers to one case differ."""
    if here["status"] != there["status"]:
        yield f"status {here['status']} here, {there['status']} there: {here['message']} | {there['message']}"
        return
    if here["status"] == "refused":
        if here["message"] != there["message"]:
            yield f"refused here: {here['message']} | there: {there['message']}"
        return
    if here["status"] == "optimal":
        off = gap(here, there)
        if not off <= SAME:
            yield f"objectives off by {off:.2g}: {here['objectives']} | {there['objectives']}"
    for part in ("binding", "clash", "keys"):
        more, less = (sorted({*item[part]} - {*other[part]}) for item, other in ((here, there), (there, here)))
        if more or less:
            yield f"{part}: only here {more}, only there {less}"
    for limit, needed in there["relaxation"].items():
        values = here["relaxation"].get(limit)
        if values is None or abs(values - needed) > RELAXED * abs(needed):
            yield f"relaxation of {limit}: {values} here, {needed} there"


def gap(here: Case, there: Case) -> float:
    """Return by how much the objectives of two answers differ, in units of their scale."""
    pairs = zip(here["objectives"], there["objectives"], strict=True)
    return max(abs(abs(a) ** power - abs(b) ** power) / scale for (_, a, _, _), (_, b, scale, power) in pairs)


def farthest(here: Mapping[str, float | None], there: Mapping[str, float | None]) -> tuple[float, str]:
    """Largest relative difference of two sets of figures, and of which; below 1e-3 as of 1e-3."""
    shared = [(k, here.get(k), there.get(k)) for k in {*here, *there}]
    off = {k: abs(a - b) / max(abs(a), abs(b), 1e-3) for k, a, b in shared if a is not None and b is not None}
    worst = max(off, key=lambda k: off[k], default="")
    return off.get(worst, 0.0), worst


def main() -> None:
    """Compare all cases and print the exceptions."""
    parser = checkouts.arguments(__doc__ or "")
    parser.add_argument("--only", default="", help="scenes whose name starts so")
    parser.add_argument("--figures", type=float, default=1e-8, help="tell of figures that differ by more")
    options = parser.parse_args()
    wanted = [item for item in cases() if item["scene"].startswith(options.only)]
    rows = []
    with checkouts.workers(__file__, options.other) as pair:
        for item in wanted:
            for worker in pair:
                worker.send(item)
            here, there = (worker.receive() for worker in pair)
            report = list(differences(here, there))
            if here["status"] == there["status"] != "refused":
                off, which = farthest(here["figures"], there["figures"])
                report += [f"note: figure {which} differs by {off:.2g}"] if off > options.figures else []
            rows += [{"case": name_of(item), "exception": text} for text in report]
            for text in report:
                print(f"{name_of(item)}: {text}", file=sys.stderr)
    exceptions = [row for row in rows if not row["exception"].startswith("note")]
    harness.show(
        rows or [{"case": "none", "exception": ""}], options.json, cases=len(wanted), exceptions=len(exceptions)
    )
    sys.exit(bool(exceptions))


if __name__ == "__main__":
    if checkouts.WORKER in sys.argv:
        checkouts.serve(answered)
    else:
        main()
