"""Which epigraph variables and which whole-cycle rows a program needs."""

from waves import objective, program

from loomopt.solving.nlp.rows import Epigraph, RowFamily, epigraphs, families


def test_one_variable_stands_above_each_objective_and_one_family_for_each_quantity():
    peaks = {"row": "circle", "form": "peak", "others": ("shifted",)}
    limit = [("wave", 1, 9.0)]
    worst = program(limit, (objective(**peaks), objective("bowl")))
    assert epigraphs(worst) == (Epigraph(0, ("circle", "shifted")),)
    assert families(worst) == [RowFamily("circle", 0), RowFamily("shifted", 0), RowFamily("wave", limit=0)]
    both = program(limit, (objective("bowl"), objective("circle", "peak"), objective("shifted", "peak")))
    assert epigraphs(both) == (Epigraph(1, ("circle",)), Epigraph(2, ("shifted",)))
    assert families(both) == [RowFamily("circle", 0), RowFamily("shifted", 1), RowFamily("wave", limit=0)]
    magnitudes = program(limit, (objective("x", "magnitude", ("y",)), objective("x", "value", ("y",))))
    assert epigraphs(magnitudes) == (Epigraph(0, ("x", "y")), Epigraph(1, ("x", "y")))
    assert families(magnitudes) == [RowFamily("wave", limit=0)]
    assert epigraphs(program(limit, (objective("x"), objective("y")))) == ()
    assert epigraphs(worst, elastic=True) == ()
    assert families(worst, elastic=True) == [RowFamily("wave", limit=0)]


def test_a_family_stands_below_one_thing_only():
    task = program([("wave", 1, 9.0)], (objective("circle", "peak"),))
    assert [(family.epigraph, family.limit) for family in families(task)] == [(0, -1), (-1, 0)]
