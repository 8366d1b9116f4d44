"""One point of a front: what a solve that ends beside what was asked is called."""

import loomopt as lo
from loomopt.studies import front, front_solve
from loomopt.studies.front_solve import Asking


def test_a_design_above_its_limit_is_uncertified_and_does_not_say_that_there_is_none(monkeypatch):
    solver = front.trade(lo.load("beatup"), ("peak_torque", "m4e"), "balance").solver
    asking = Asking(0, (None, 3.0))
    found = solver.solve(asking, [], False)
    assert found.status == "optimal"
    monkeypatch.setattr(front_solve, "FEASIBLE", -0.01)
    above = solver.solve(asking, [found.warm], False)
    assert (above.status, above.reason) == ("uncertified", "m4e comes out above what was asked")
