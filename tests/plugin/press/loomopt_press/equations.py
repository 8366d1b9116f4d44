"""The equations a press scene really uses: the slide's travel, each effect's own formula on symbols."""

from loomopt.maths import systems
from loomopt.model.model import JobModel
from loomopt.physics import balance
from loomopt.picture import effect_equations
from loomopt.picture.equations import Equation, Symbols, equation, symbol
from loomopt_press.model import SlidePose


def equations(model: JobModel) -> tuple[Equation, ...]:
    """Return travel with its derivatives, each term, balance and crank torque."""
    names = "q", "q'", "q''"
    slide = SlidePose(systems.sympy(), symbol("crank"), symbol("rod"), symbol("phi"), symbol("omega"))
    travel = zip(names, (slide.q, slide.q1, slide.q2), strict=True)
    pose = balance.Pose(slide.phi, slide.omega, *map(symbol, names))
    known = effect_equations.given(model, Symbols())
    written = [equation("travel", symbol(name), value) for name, value in travel]
    return (*written, *effect_equations.forces(model, pose, known, "Q", "Q"))
