"""Recorded quantities: the bits of the formulas themselves in every number system, recorded when it is worth it."""

import functools
import gc
import itertools
import weakref
from unittest import mock

import numpy as np
import pytest
from made_up import CLOTH, FRONT, INERTIA, NUMBERS, SPRING, Yoke
from support.bits import bits
from test_states import ELASTIC, WITH_ARM

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.maths.jets import Jet, variables
from loomopt.model import reading
from loomopt.model.model import CycleQuantity, DesignRow, JobModel
from loomopt.model.reading import DATUM, Quantities
from loomopt.model.sampling import Sampler
from loomopt.model.session import Session, current, working
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Node
from loomopt.scenes.packaged import problems
from loomopt.solving.certificate.taylor_bounds import Boxes

EFFECTS = {
    "beatup": ("counterweight_inertia", "rocker_inertia", "rod_inertia", "gravity", "bearing_friction", "centrifugal"),
    "rapier": ("head_inertia", "tape_friction"),
    "shedding": ("damping", "dry_friction", "coil"),
}
LAWS = ("harmonic", "modified_sine", "modified_trapezoid", "polynomial_345", "freudenstein_13")


@functools.cache
def samplers():
    """Return today's machine of every packaged scene, of all effects together, of the cam laws, and made-up ones."""
    results = {}
    for name in problems():
        scene = lo.load(name)
        results[name] = registry.of(scene).sampler(scene, {})
    for name, effects in EFFECTS.items():
        scene = functools.reduce(lambda first, effect: first.with_effect(effect), effects, lo.load(name))
        results[f"{name} with all effects"] = registry.of(scene).sampler(scene, {})
    for law in LAWS:
        scene = lo.load("shedding").update({"mechanism.law": law, "effects.warp_tension.shape": "step"})
        results[law] = registry.of(scene).sampler(scene, {})
    results["a state"] = Sampler(ELASTIC, WITH_ARM)
    return results


NAMES = [*problems(), *(f"{name} with all effects" for name in EFFECTS), *LAWS, "a state"]


def quantities(model):
    """Return the names of all whole-cycle quantities of a model."""
    return list(model._quantities)


def nodes(sampler, count, seed):
    """Return pieces and u drawn at random, ends and middles among them."""
    drawn = np.random.default_rng(seed)
    pieces = np.sort(drawn.integers(0, sampler.cycle.pieces, count))
    return pieces, np.concatenate([[0.0, 1.0, 0.5], drawn.random(count - 3)])


def switched(sampler, piece):
    """Return the switches of a piece as plain numbers, and the datum that a mean hands over."""
    return {**{name: float(value) for name, value in sampler.cycle.switch(piece).items()}, DATUM: 0.3}


RECORDED = functools.cache(reading.recorded_quantities)


def outcome(read):
    """Return what is read, bit for bit, or what it raises."""
    try:
        with np.errstate(all="ignore"):
            return [bits(value) for value in read()]
    except (ArithmeticError, ValueError) as error:
        return [type(error)]


def alike(model, systems, given, node, whole=lambda value: value):
    """Assert that all quantities are the same to the last bit, or raise the same; return what was read.

    whole(value): as a value of all nodes, or of a whole series: a constant may be told with less.
    """
    results = []
    for name in quantities(model):
        recording = RECORDED(model, (name,), tuple(node.switch), given.known)
        results.append(outcome(lambda: [whole(model.quantity(systems[1], given, name, node))]))  # noqa: B023
        assert outcome(lambda: map(whole, recording.bind(systems, given)(node))) == results[-1], name  # noqa: B023
    return results


def spread(node):
    """Return what makes an array of all nodes of a value."""
    return lambda value: value if isinstance(value, Jet) else np.broadcast_to(np.asarray(value, float), node.phi.shape)


@pytest.mark.few(8)
@pytest.mark.parametrize("name", NAMES)
def test_arrays_of_all_pieces(name):
    sampler = samplers()[name]
    for count in (7, 2000):
        node = sampler.node(*nodes(sampler, count, count))
        node = Node(node.phi, {**node.switch, DATUM: np.linspace(-0.5, 0.5, count)})
        alike(sampler.model, (systems.FLOAT, systems.numpy()), sampler.given, node, spread(node))


@pytest.mark.parametrize("name", NAMES)
def test_several_together_are_each_alone(name):
    sampler = samplers()[name]
    names = tuple(quantities(sampler.model))
    node = sampler.node(*nodes(sampler, 20, 5))
    node = Node(node.phi, {**node.switch, DATUM: np.linspace(-0.5, 0.5, 20)})
    recording = reading.recorded_quantities(sampler.model, names, tuple(node.switch), sampler.given.known)
    result = recording.bind((systems.FLOAT, systems.numpy()), sampler.given)(node)
    for item, value in zip(names, result, strict=True):
        alone = sampler.model.quantity(systems.numpy(), sampler.given, item, node)
        assert bits(spread(node)(value)) == bits(spread(node)(alone)), item


@pytest.mark.parametrize("name", NAMES)
def test_plain_floats(name):
    sampler = samplers()[name]
    for piece, u in zip(*nodes(sampler, 12, 1), strict=True):
        phi = float(sampler.cycle.angles(np.array([piece]), np.array([u]))[0])
        alike(sampler.model, (systems.FLOAT, systems.FLOAT), sampler.given, Node(phi, switched(sampler, piece)))


@pytest.mark.parametrize("name", NAMES)
def test_forty_digits(name):
    sampler = samplers()[name]
    reading = sampler.read(systems.mpmath())
    for piece, u in zip(*nodes(sampler, 4, 2), strict=True):
        begin, end = reading.starts[piece : piece + 2]
        node = Node(begin + reading.maths.number(float(u)) * (end - begin), switched(sampler, piece))
        alike(sampler.model, (reading.maths, reading.maths), reading.given, node)


@pytest.mark.few(8)
@pytest.mark.parametrize("name", NAMES)
def test_series_of_balls(name):
    """Narrow boxes, and wide ones that hold what no formula can."""
    sampler = samplers()[name]
    boxes = Boxes(sampler)
    for (piece, u), half in itertools.product(zip(*nodes(sampler, 4, 3), strict=True), (0.0, 1e-3, 0.5)):
        begin, end = boxes.starts[piece : piece + 2]
        node = Node(begin + (end - begin) * systems.ball_series(float(u), half), switched(sampler, piece))
        whole = lambda value: systems.ball_series(0.0, 0.0) * 0 + value  # noqa: E731
        alike(sampler.model, (boxes.maths, boxes.maths), boxes.given, node, whole)


@pytest.mark.few(16)
@pytest.mark.parametrize("curved", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_jets(name, curved):
    """Every third number of the scene moves, as a design's variables do."""
    sampler = samplers()[name]
    values = {**sampler.values, **sampler.hints}
    free = list(values)[::3]
    moving = variables([values[of] for of in free], np.eye(len(free)), curved)
    given = sampler.model.given(systems.jets(), {**values, **dict(zip(free, moving, strict=True))})
    node = sampler.node(*nodes(sampler, 9, 4))
    node = Node(node.phi, {**node.switch, DATUM: np.linspace(-0.5, 0.5, 9)})
    alike(sampler.model, (systems.jets(), systems.jets()), given, node, spread(node))


def test_a_formula_that_raises_raises_the_same():
    """A drive whose links do not meet all round: in floats the root of a negative number."""
    sampler = samplers()["rapier"]
    given = sampler.model.given(systems.FLOAT, {**sampler.values, "l5": 1.4 * sampler.values["l5"]})
    results = [
        alike(sampler.model, (systems.FLOAT, systems.FLOAT), given, Node(phi, switched(sampler, 0)))
        for phi in np.linspace(0.0, 6.0, 40).tolist()
    ]
    assert [ValueError] in [item for of in results for item in of]
    assert any(ValueError not in item for of in results for item in of)


# When ---------------------------------------------------------------------------------------------------------------


def yoke(**quantities):
    """Return a machine of a model of its own, so that nothing was asked of it before."""
    values = {"torque": CycleQuantity(lambda at: at.crank_torque), **quantities}
    rows = {"front_force": DesignRow(lambda at: at.force, event=FRONT)}
    return JobModel(Yoke(), (INERTIA, SPRING, CLOTH), own_quantities=values, own_rows=rows)


@pytest.fixture
def made():
    """The recordings that are made: a mock that makes them."""
    with mock.patch.object(reading, "recorded_quantities", wraps=reading.recorded_quantities) as recorded:
        yield recorded


def test_a_quantity_is_recorded_once_after_as_many_evaluations_as_make_it_worth_it(made, monkeypatch):
    monkeypatch.setattr(reading, "WORTH_IT", 5)
    model, values = yoke(), []
    for _ in range(4):
        sampler = Sampler(model, NUMBERS)
        values += [sampler.at("torque", *sampler.grid()).tobytes() for _ in range(3)]
        assert made.call_count == (len(values) > 5)
    assert len(set(values)) == 1
    assert made.call_args.args[1:3] == (("torque",), ("cloth",))
    assert Sampler(yoke(), NUMBERS).at("torque", *sampler.grid()).tobytes() == values[0]
    assert made.call_count == 1, "another model is another"


def test_systems_share_a_recording(made, monkeypatch):
    monkeypatch.setattr(reading, "WORTH_IT", 0)
    sampler = Sampler(yoke(), NUMBERS)
    for system in (systems.FLOAT, systems.mpmath(), systems.jets()):
        sampler.read(system).at("torque", 0, system.number(0.25))
    sampler.at("torque", np.array([0]), np.array([0.25]))
    assert made.call_count == 1


def decided(at):
    """A formula that no number system but floats can do: it looks at a value."""
    return at.pose.q if at.values["r"] > 0 else -at.pose.q


def read_as_float(at):
    return float(at.values["r"]) * at.pose.q


@pytest.mark.parametrize("formula", [decided, read_as_float])
def test_a_formula_that_cannot_be_recorded_is_run_as_it_is(formula, made, monkeypatch):
    model = yoke(odd=CycleQuantity(formula))
    sampler = Sampler(model, NUMBERS)
    pieces, u = sampler.grid()
    before = sampler.at("odd", pieces, u)
    monkeypatch.setattr(reading, "WORTH_IT", 0)
    for _ in range(3):
        assert sampler.at("odd", pieces, u).tobytes() == before.tobytes()
    assert made.call_count == 1, "it is not tried again"
    with pytest.raises(TypeError, match=r"Recorded|no value"):
        reading.recorded_quantities(model, ("odd",), ("cloth",), sampler.given.known)


def test_numbers_made_by_hand_are_not_recorded(monkeypatch):
    """Nobody knows what they follow from."""
    monkeypatch.setattr(reading, "WORTH_IT", 0)
    sampler = Sampler(yoke(), NUMBERS)
    by_hand = Given(sampler.given.values, sampler.given.tables)
    node = Node(1.0, {"cloth": 0.0})
    (result,) = Quantities(sampler.model, (systems.FLOAT, systems.FLOAT), by_hand)(("torque",), node)
    assert result == sampler.model.quantity(systems.FLOAT, sampler.given, "torque", node)


def test_recordings_go_with_their_model(monkeypatch):
    monkeypatch.setattr(reading, "WORTH_IT", 0)
    model = yoke()
    Sampler(model, NUMBERS).at("torque", np.array([0]), np.array([0.5]))
    assert model in current()._values_by_owner
    gone = weakref.ref(model)
    del model
    gc.collect()
    assert gone() is None


@pytest.mark.few(1)
@pytest.mark.parametrize("name", ["beatup", "rapier", "shedding"])
def test_an_answer_does_not_hang_on_what_was_recorded(name, monkeypatch):
    """Nothing recorded, everything from the first evaluation on, and whatever this process has recorded so far."""
    answers = []
    for worth_it in (reading.WORTH_IT, 0, 10**9):
        monkeypatch.setattr(reading, "WORTH_IT", worth_it)
        with working(Session() if worth_it else None):
            answers.append(lo.solve(lo.load(name), starts=1))
    for other in answers[1:]:
        assert other.design == answers[0].design
        assert other.figures == answers[0].figures
        assert other.certificate == answers[0].certificate
