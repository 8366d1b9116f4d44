"""Where each parameter of an NLP stands."""

import numpy as np

from loomopt.solving.nlp.rows import Layout


def test_layout_gives_back_what_was_written():
    layout, vector = Layout(), np.zeros(9)
    layout.add("one")
    layout.add("grid", 2, 3)
    layout.add("pair", 2)
    layout.write(vector, "grid", [[1, 2, 3], [4, 5, 6]])
    layout.write(vector, "pair", [7, 8])
    layout.write(vector, "one", 9)
    assert layout.size == 9
    assert layout.read(vector, "one") == [9]
    assert layout.read(vector, "pair") == [7, 8]
    assert layout.rows(vector, "grid") == [[1, 2, 3], [4, 5, 6]]
    assert layout.part(range(9), "pair") == range(7, 9)
    assert layout.prefix(vector, "pair").tolist() == [9, 1, 2, 3, 4, 5, 6]
    layout.array(vector, "grid")[1, :2] = 0
    assert vector.tolist() == [9, 1, 2, 3, 0, 0, 6, 7, 8]
