"""Newton's corrections of a search end where they would leave what assembles."""

from support import toy

from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.search import search as searching
from loomopt.solving.search.search import Candidate, Search, objectives


def test_a_correction_to_where_nothing_assembles_is_not_made():
    """x − 2 √x is least at 1; at 9 Newton's step leads to −27, where there is no root."""
    program = toy.program("x", formulas={"f": lambda m, v: v["x"] - 2 * m.sqrt(v["x"])}, bounds={"x": (-30.0, 30.0)})
    point = Point({"x": 9.0}, "Solve_Succeeded", True)
    result = searching._certify_candidate(
        Search(toy.ToyJob(program), program, Settings()), Candidate(point, objectives(program, point.x))
    )
    assert result.best.x == {"x": 9.0}
    assert result.best.certificate.correction["x"] < -9.0
    assert not result.passed
