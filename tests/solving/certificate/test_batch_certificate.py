"""Certificates of many designs: each is what it would be alone, whoever stands beside it."""

import itertools
import re

import numpy as np
import pytest

from loomopt.jobs import registry
from loomopt.scenes import designs
from loomopt.solving import engine
from loomopt.solving.certificate import batch_certificate
from loomopt.solving.certificate.batch_derivatives import DesignAt
from loomopt.solving.certificate.certificate import certify, prepare
from loomopt.solving.certificate.derivatives import JetDerivatives, jet_derivatives

ACCURACY, ROUNDED = 1e-8, 1e-12
TASKS = [
    ("beatup", "balance"),
    ("beatup", "pulse"),
    ("shedding", "force"),
    ("rapier", "stroke-dwell"),
    pytest.param("rapier", "dwell", marks=pytest.mark.slow),
    pytest.param("shedding", "law", marks=pytest.mark.slow),
]


def optimum(job, target):
    scene = registry.load(job)
    program = registry.find(job).program(scene, target)
    answer = engine.solve(scene, target, starts=1)
    full = {scene.full(name): value for name, value in designs.flat(answer.design).items()}
    return program, registry.find(job).values(program, full)


def scattered_designs(program, x, share, count):
    """Return an optimum and designs around it, all off by a share of scales."""
    drawn = np.random.default_rng(1).standard_normal((count, len(program.variables)))
    moved = [
        {
            v.name: x[v.name] + share * v.scale * d * (v.lower < v.upper)
            for v, d in zip(program.variables, row, strict=True)
        }
        for row in drawn
    ]
    return [dict(x), *({**x, **item} for item in moved)]


@pytest.mark.few(1)
@pytest.mark.parametrize(("job", "target"), TASKS)
def test_derivatives_are_those_of_each_design_alone(job, target):
    program, x = optimum(job, target)
    places = [(item, prepare(program, item, ACCURACY)) for item in scattered_designs(program, x, 1e-9, 4)]
    requests = [DesignAt(program, item, sampler, active.rows) for item, (sampler, active) in places]
    for of, result in zip(requests, jet_derivatives(requests), strict=True):
        alone = JetDerivatives(program, of.x, of.sampler, of.rows)
        basis = np.linalg.qr(np.random.default_rng(2).standard_normal((len(alone.names), 3)))[0]
        for mine, values in (
            (result.gradients(), alone.gradients()),
            (result.curvatures(basis), alone.curvatures(basis)),
        ):
            assert np.abs(mine - values).max() <= ROUNDED * max(1.0, np.abs(values).max())


@pytest.mark.few(1)
@pytest.mark.parametrize(("job", "target"), TASKS)
def test_derivatives_are_the_same_bits_in_batches_of_any_size(job, target):
    program, x = optimum(job, target)
    places = [(entry, prepare(program, entry, ACCURACY)) for entry in scattered_designs(program, x, 1e-9, 10)]
    requests = [DesignAt(program, entry, sampler, active.rows) for entry, (sampler, active) in places]
    whole = jet_derivatives(list(itertools.islice(itertools.cycle(requests), 200)))
    for size in (1, 8):
        parts = [jet_derivatives(requests[begin : begin + size]) for begin in range(0, len(requests), size)]
        for item, other in zip(itertools.chain(*parts), whole[: len(requests)], strict=True):
            assert item.gradients().tobytes() == other.gradients().tobytes()
            basis = np.eye(len(item.names))
            assert item.curvatures(basis).tobytes() == other.curvatures(basis).tobytes()


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("job", "target", "count"),
    [("beatup", "balance", 8), ("shedding", "force", 8)]
    + [
        pytest.param(*task, 200, marks=pytest.mark.slow) for task in (("beatup", "balance"), ("rapier", "stroke-dwell"))
    ],
)
def test_adversaries_are_refused_in_batches_as_they_are_alone(job, target, count):
    """The optimum, and designs a millionth and a ten-thousandth off it: the same digits in batches of 1 and more."""
    program, x = optimum(job, target)
    requests = [(program, item) for share in (1e-6, 1e-4) for item in scattered_designs(program, x, share, 2)]
    several = list(itertools.islice(itertools.cycle(requests), count))
    whole = batch_certificate.certify_batch(several, ACCURACY)
    for k, (_, item) in enumerate(requests):
        assert verdict(whole[k]) == verdict(certify(program, item, ACCURACY))
        assert whole[k].passed == (item == x)
        assert whole[k] == batch_certificate.certify_batch([requests[k]], ACCURACY)[0]
    assert all(whole[k] == whole[k % len(requests)] for k in range(count))


def verdict(certificate):
    """Return what a certificate says, without its numbers."""
    texts = [re.sub(r"[0-9][-+0-9.e]*", "#", reason) for reason in certificate.reasons]
    return certificate.passed, certificate.minimum, certificate.unique, certificate.by, texts
