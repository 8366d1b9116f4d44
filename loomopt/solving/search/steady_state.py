"""A search over designs with a steady state: begun again as long as its best needs a finer one."""

from collections.abc import Sequence
from dataclasses import replace

from loomopt.model.program import Program
from loomopt.model.session import working
from loomopt.solving.nlp.point import Point
from loomopt.solving.search.multistart import searched as searched_once
from loomopt.solving.search.search import OnStart, Search

RESOLVED = 5
"""Times a search begins again with what its best needs of a steady state: each doubles it, from the fewest to the most.
"""


@working()
def searched(
    search: Search,
    starts: int | None = None,
    seed: int = 0,
    near: Sequence[Point] = (),
    on_start: OnStart | None = None,
) -> Search:
    """Return how far a search comes; no scene is read, nothing is said in words.

    starts: so many, the job's own first, then random ones from `seed`; None for a search of the best basin; near: where
    neighbours' solves ended, to start warm from; one of another structure is left alone. Raises KeyboardInterrupt on
    Ctrl-C.
    """
    same = [point for point in near if point.structure == search.program.structure]
    search = searched_once(search, starts, seed, same, on_start)
    for _ in range(RESOLVED if search.best else 0):
        finer = _finer(search)
        if finer is search.program:
            break
        search = searched_once(replace(search, program=finer, candidates=(), best=None), starts, seed, (), on_start)
    return search


def _finer(search: Search) -> Program:
    """Return the program with what the steady state of a search's best needs; itself where it has that, or cannot."""
    program, best = search.program, search.best
    if not program.model.states or best is None:
        return program
    from loomopt.model.model import with_words_fixed

    try:
        model = with_words_fixed(program.model, {**program.parameters, **best.x})
    except ArithmeticError:
        return program
    return program if model is program.model else replace(program, model=model)
