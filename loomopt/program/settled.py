"""What of a model depends on a design and yet is structure: the words by which its states choose their formulas."""

import functools
import math
from collections.abc import Mapping
from dataclasses import replace

from loomopt.maths.systems import FLOAT
from loomopt.physics.cycle import TURN
from loomopt.physics.effects.kinds import UnsteadyError
from loomopt.program import states
from loomopt.program.instant import Integral
from loomopt.program.model import JobModel

RESOLVED = 95
"""Samples, of those a state asks for, that the rule of a mean resolves to rounding (4 swings of the state's own)."""
Word = tuple[str, str, str]


def settled(model: JobModel, values: Mapping[str, float]) -> JobModel:
    """Return the model as its states need it at a design (SI); itself where it serves that already.

    Raises UnsteadyError where there is no steady state to trust.
    """
    if not model.states:
        return model
    given = model.plain(FLOAT, values, frozenset(values))
    words = {(effect, key): word for effect, key, word in model.words}
    for state in model.states:
        carried = states.carried(FLOAT, model.kinematics, model.loads, given, state)
        fixed = state.fixed(given.values, given.own[state.name], carried)
        words |= {(state.name, key): word for key, word in fixed.items()}
    first = _with(model, tuple((*key, word) for key, word in words.items()), ())
    return _with(first, first.words, _parts(first, values))


def unserved(model: JobModel, values: Mapping[str, float]) -> str:
    """Return why the model is none for a design (SI), "" where it serves it."""
    try:
        return "" if settled(model, values) is model else "a steady state needs more here than it was solved with"
    except UnsteadyError as error:
        return error.problem


def _parts(model: JobModel, values: Mapping[str, float]) -> tuple[int, ...]:
    """Return into how many parts each mean's pieces are cut, so that its rule resolves what rings on them."""
    given = model.given(FLOAT, values)
    samples, cycle = model.samples(given), model.split(FLOAT, given)
    stretches = [cycle.stretch(mean.where) for mean in model.integrals]
    shares = [(end - begin) / TURN for begin, end in stretches]
    return tuple(
        max(mean.parts, math.ceil(share * samples / RESOLVED))
        for mean, share in zip(model.integrals, shares, strict=True)
    )


@functools.lru_cache(maxsize=64)
def _made(model: JobModel, words: tuple[Word, ...], integrals: tuple[Integral, ...]) -> JobModel:
    return replace(model, words=words, integrals=integrals)


def _with(model: JobModel, words: tuple[Word, ...], parts: tuple[int, ...]) -> JobModel:
    """Return the model with these words, and means in these parts; itself where it has them."""
    cut = tuple(mean._replace(parts=n) for mean, n in zip(model.integrals, parts, strict=False)) or model.integrals
    return model if (words, cut) == (model.words, model.integrals) else _made(model, words, cut)
