"""Certificates of a batch of designs: slopes and curvatures of all in one pass, then one certificate for each.

The result of a design does not depend on the rest of the batch or on its size, to the last bit: matrices are factored
one by one.
"""

import contextlib
from collections.abc import Mapping, Sequence

from loomopt.model.program import Program
from loomopt.model.sampling import Sampler, scan_together
from loomopt.solving.certificate.batch_derivatives import DesignAt
from loomopt.solving.certificate.certificate import NO_NUMBER, certify, certify_by, draft_from, prepare
from loomopt.solving.certificate.derivatives import JetDerivatives, jet_derivatives
from loomopt.solving.certificate.kkt import ActiveSet
from loomopt.solving.certificate.records import Certificate
from loomopt.solving.certificate.taylor_bounds import cycle_rows
from loomopt.solving.nlp.point import Settings, sampler_at, search_extremes
from loomopt.solving.search import tie_break


def certify_batch(requests: Sequence[tuple[Program, Mapping[str, float]]], accuracy: float) -> list[Certificate]:
    """Certificates of variables (SI) of several programs.

    The steps are those of `certify`: only the derivatives are read in a batch. A design that floats leave in doubt is
    certified in 40 digits, and one without a number in the batch is certified alone. requests: program and variables of
    each. Returns one certificate for each.
    """
    samples = Settings(accuracy).sample_count
    designs_at = [(sampler_at(program, x, samples), program) for program, x in requests]
    search_extremes((sampler, tuple(name for name, _, _ in cycle_rows(program))) for sampler, program in designs_at)
    samplers: list[tuple[Sampler, ActiveSet] | None] = []
    for program, x in requests:
        try:
            samplers.append(prepare(program, x, accuracy))
        except NO_NUMBER:
            samplers.append(None)
    places = [k for k, pair in enumerate(samplers) if pair]
    if len(places) > 1:
        tie_break.measure_moves([requests[k] for k in places])
    designs = [DesignAt(*requests[k], pair[0], pair[1].rows) for k in places if (pair := samplers[k])]
    slopes = dict(zip(places, jet_derivatives(designs), strict=True))
    _scan([(program, pair[0]) for (program, _), pair in zip(requests, samplers, strict=True) if pair], accuracy)
    return [_certify_single(*requests[k], samplers[k], slopes.get(k), accuracy) for k in range(len(requests))]


def _scan(designs: Sequence[tuple[Program, Sampler]], accuracy: float) -> None:
    """Scan the whole cycle of designs between refined points, those of equal quantities in one pass."""
    by_names: dict[tuple[str, ...], list[Sampler]] = {}
    for program, sampler in designs:
        by_names.setdefault(tuple(name for name, _, _ in cycle_rows(program)), []).append(sampler)
    for names, group in by_names.items():
        # A design without a number fails again where it is certified.
        with contextlib.suppress(*NO_NUMBER):
            scan_together(group, names, Settings(accuracy).check_count)


def _certify_single(
    program: Program,
    x: Mapping[str, float],
    prepared: tuple[Sampler, ActiveSet] | None,
    slopes: JetDerivatives | None,
    accuracy: float,
) -> Certificate:
    """Certificate of one design from the derivatives of the batch, if it has any."""
    if prepared is None or slopes is None:
        return certify(program, x, accuracy)
    try:
        certificate = draft_from(program, x, *prepared, slopes, accuracy).whole
    except NO_NUMBER:
        return certify(program, x, accuracy)
    if certificate.clear:
        return certificate
    from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives

    return certify_by(MpmathDerivatives, program, x, accuracy)
