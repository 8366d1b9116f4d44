"""Steady motions in an NLP: sums of a formula over the angles of a turn, and harmonics whose coefficients follow.

Written out at every angle they would be most of the NLP. Here rows read them as symbols s(x); they are functions mapped
over the angles, and matrices. With ds/dx the derivatives of the NLP follow by the chain rule: the expressions are
differentiated along the columns of ds/dx only.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from loomopt.maths.systems import Maths, Number


class MappedSum(NamedTuple):
    """Σ weights[k][i] formula(angles[i]), for every k the symbol `symbols[k]`; angle: the formula's own symbol, rad."""

    symbols: Any
    formula: Any
    angle: Any
    angles: Sequence[float]
    weights: Sequence[Sequence[float]]


class HarmonicSum(NamedTuple):
    """Σ cosines[n] cos nφ + sines[n] sin nφ at several angles φ, rad, each with its symbol."""

    cosines: Sequence[Any]
    sines: Sequence[Any]
    angles: list[Any]
    symbols: list[Any]


class SumRecorder:
    """Sums that formulas request of a CasADi system with its `spread`, `weighted` and `harmonics`."""

    def __init__(self) -> None:
        self.sums: list[MappedSum] = []
        self._harmonics: dict[object, HarmonicSum] = {}
        self._spread: tuple[Any, Sequence[float]] = (None, ())

    @property
    def harmonic_sums(self) -> list[HarmonicSum]:
        """Sums of harmonics, one for each set of coefficients."""
        return list(self._harmonics.values())

    @property
    def column(self) -> Any:
        """Symbols of all sums."""
        import casadi as ca

        harmonics = (symbol for harmonic in self.harmonic_sums for symbol in harmonic.symbols)
        return ca.vertcat(*(mapped.symbols for mapped in self.sums), *harmonics)

    @property
    def formulas(self) -> list[Any]:
        """Formulas of the sums, each at one angle."""
        import casadi as ca

        series = [ca.vertcat(*harmonic.cosines, *harmonic.sines) for harmonic in self.harmonic_sums]
        return [*(mapped.formula for mapped in self.sums), *series]

    def spread(self, numbers: Sequence[Number], pattern: Iterable[Number]) -> Number:
        """One symbol for all angles."""
        import casadi as ca

        self._spread = ca.SX.sym("angle"), numbers
        return self._spread[0]

    def weighted(self, weights: Sequence[Sequence[Number]], value: Number) -> list[Number]:
        """Symbols of the sums of a formula of the last angle that was spread."""
        import casadi as ca

        symbols = ca.SX.sym("sum", len(weights))
        self.sums.append(MappedSum(symbols, ca.SX(value), *self._spread, weights))
        return list(ca.vertsplit(symbols))

    def harmonics(self, cosines: Sequence[Number], sines: Sequence[Number], phi: Number) -> Number:
        """Symbol of Σ cosines[n] cos nφ + sines[n] sin nφ."""
        import casadi as ca

        key = tuple(v if isinstance(v, float | int) else v.element_hash() for v in (*cosines, *sines))
        harmonic = self._harmonics.setdefault(key, HarmonicSum(cosines, sines, [], []))
        harmonic.angles.append(phi)
        harmonic.symbols.append(ca.SX.sym("harmonics"))
        return harmonic.symbols[-1]


class WrittenNlp(NamedTuple):
    """An NLP as expressions of variables x and parameters p, with the sums of `recorder` as symbols.

    slopes: of all rows g with respect to x, the sums as they are; lagrangian: with the multipliers lam_f and lam_g.
    """

    x: Any
    p: Any
    f: Any
    g: Any
    slopes: Any
    lam_f: Any
    lam_g: Any
    lagrangian: Any

    def functions(self, recorder: SumRecorder) -> tuple[dict[str, Any], dict[str, Any]]:
        """The NLP, and the functions of its derivatives under the names of IPOPT's options."""
        import casadi as ca

        if recorder.sums or recorder.harmonic_sums:
            return _with_sums(self, recorder)
        x, p = self.x, self.p
        hessian = ca.triu(ca.hessian(self.lagrangian, x)[0])
        return {"x": x, "p": p, "f": self.f, "g": self.g}, {
            "grad_f": ca.Function("nlp_grad_f", [x, p], [self.f, ca.gradient(self.f, x)]),
            "jac_g": ca.Function("nlp_jac_g", [x, p], [self.g, self.slopes]),
            "hess_lag": ca.Function("nlp_hess_l", [x, p, self.lam_f, self.lam_g], [hessian]),
        }


def _with_sums(nlp: WrittenNlp, recorder: SumRecorder) -> tuple[dict[str, Any], dict[str, Any]]:
    """NLP and derivatives; the sums are functions of x and p."""
    import casadi as ca

    symbols, layers = recorder.column, _Layers(nlp.x, nlp.p, recorder)
    follow = ca.SX.sym("follow", symbols.numel(), len(layers.used))
    inputs, multipliers = [nlp.x, nlp.p, symbols], [nlp.lam_f, nlp.lam_g]
    slope, pull = ca.gradient(nlp.lagrangian, nlp.x), ca.gradient(nlp.lagrangian, symbols)
    along = _Along(symbols, follow)
    objective = ca.Function("objective", [*inputs, follow], [nlp.f, ca.gradient(nlp.f, nlp.x), along(nlp.f)])
    rows = ca.Function("rows", [*inputs, follow], [nlp.g, nlp.slopes, along(nlp.g)])
    bends = [ca.hessian(nlp.lagrangian, nlp.x)[0], along(slope), along(pull), pull]
    curvature = ca.Function("curvature", [*inputs, *multipliers, follow], bends)
    x, p = ca.MX.sym("x", nlp.x.numel()), ca.MX.sym("p", nlp.p.numel())
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", nlp.lam_g.numel())
    state = layers.at(x, p)
    value, gradient, moved = objective(x, p, state.values, state.slopes)
    g, jacobian, moved_rows = rows(x, p, state.values, state.slopes)
    hessian, mixed, reduced, pulls = curvature(x, p, state.values, lam_f, lam_g, state.slopes)
    place = _columns(layers.used, nlp.x.numel())
    mixed = ca.mtimes(mixed, place.T)
    own = ca.mtimes(state.slopes.T, reduced) + state.curvature(pulls)
    hessian = hessian + mixed + mixed.T + ca.mtimes([place, own, place.T])
    return {"x": x, "p": p, "f": value, "g": g}, {
        "grad_f": ca.Function("nlp_grad_f", [x, p], [value, gradient + ca.mtimes(place, moved.T)]),
        "jac_g": ca.Function("nlp_jac_g", [x, p], [g, jacobian + ca.mtimes(moved_rows, place.T)]),
        "hess_lag": ca.Function("nlp_hess_l", [x, p, lam_f, lam_g], [ca.triu(hessian)]),
    }


class _Along(NamedTuple):
    """Derivatives of expressions along the columns of ds/dx; symbols: s."""

    symbols: Any
    follow: Any

    def __call__(self, expression: Any) -> Any:
        import casadi as ca

        return ca.sparsify(ca.jtimes(expression, self.symbols, self.follow))


def _columns(places: Sequence[int], size: int) -> Any:
    """Matrix that puts entries on their places among `size`."""
    import casadi as ca

    count = len(places)
    return ca.DM.triplet(list(places), list(range(count)), [1.0] * count, size, count)


def _read(expression: Any, column: Any) -> list[int]:
    """Places of a column that an expression depends on."""
    import casadi as ca

    return [place for place, reads in enumerate(ca.which_depends(expression, column, 1, False)) if reads]


class _Layers:
    """All sums as functions of x and p; used: the places of x that they read."""

    def __init__(self, x: Any, p: Any, recorder: SumRecorder) -> None:
        import casadi as ca

        sums = recorder.sums
        first = ca.vertcat(*(mapped.symbols for mapped in sums))
        series = [
            (ca.vertcat(*harmonic.cosines, *harmonic.sines), ca.vertcat(*harmonic.angles))
            for harmonic in recorder.harmonic_sums
        ]
        read = ca.vertcat(*(mapped.formula for mapped in sums), *(part for parts in series for part in parts))
        self.used = _read(read, x)
        self.parts = [_MappedPart(mapped, x, p, self.used) for mapped in sums]
        self.series = [_HarmonicPart(*parts, x, p, first, self.used) for parts in series]

    def at(self, x: Any, p: Any) -> "_State":
        return _State(self, x, p)


class _State:
    """Sums at x and p, MX; values, slopes: of all sums, with respect to the variables that they read."""

    def __init__(self, layers: _Layers, x: Any, p: Any) -> None:
        import casadi as ca

        self._layers, self._x, self._p = layers, x, p
        values, slopes = [part.values(x, p) for part in layers.parts], [part.slopes(x, p) for part in layers.parts]
        self._count = sum(part.count for part in layers.parts)
        self._first, self._follow = ca.vertcat(*values), ca.vertcat(*slopes)
        self._series = [part.at(x, p, self._first, self._follow) for part in layers.series]
        self.values = ca.vertcat(self._first, *(series.values for series in self._series))
        self.slopes = ca.vertcat(self._follow, *(series.slopes for series in self._series))

    def curvature(self, prices: Any) -> Any:
        """Second derivatives of all sums, weighted by prices."""
        pulls, begin = prices[: self._count], self._count
        total: Any = 0
        for series in self._series:
            end = begin + series.values.numel()
            bends, pulled = series.curvature(prices[begin:end])
            total, pulls, begin = total + bends, pulls + pulled, end
        begin = 0
        for part in self._layers.parts:
            total = total + part.curvature(self._x, self._p, pulls[begin : begin + part.count])
            begin += part.count
        return total


class _MappedPart:
    """One sum over angles as functions of x and p."""

    def __init__(self, mapped: MappedSum, x: Any, p: Any, used: Sequence[int]) -> None:
        import casadi as ca

        self.count, self._size = len(mapped.weights), len(mapped.angles)
        self._weights, self._angles = ca.DM(mapped.weights), ca.DM(mapped.angles).T
        self._places = [_read(mapped.formula, part) for part in (x, p)]
        own, numbers = (part[places] for part, places in zip((x, p), self._places, strict=True))
        weight = ca.SX.sym("factor")
        self._columns = _columns([used.index(place) for place in self._places[0]], len(used))
        inputs, slope = [mapped.angle, own, numbers], ca.gradient(mapped.formula, own)
        bend = ca.vec(ca.densify(ca.jacobian(slope, own))) * weight
        self._value = ca.Function("term", inputs, [mapped.formula]).map(self._size)
        self._slope = ca.Function("term_slope", inputs, [ca.densify(slope)]).map(self._size)
        self._bend = ca.Function("term_bend", [*inputs, weight], [bend]).map(self._size)

    def _inputs(self, x: Any, p: Any) -> list[Any]:
        import casadi as ca

        columns = (part[places] for part, places in zip((x, p), self._places, strict=True))
        return [self._angles, *(ca.repmat(column, 1, self._size) for column in columns)]

    def values(self, x: Any, p: Any) -> Any:
        import casadi as ca

        return ca.mtimes(self._weights, self._value(*self._inputs(x, p)).T)

    def slopes(self, x: Any, p: Any) -> Any:
        import casadi as ca

        return ca.mtimes([self._weights, self._slope(*self._inputs(x, p)).T, self._columns.T])

    def curvature(self, x: Any, p: Any, prices: Any) -> Any:
        import casadi as ca

        size = len(self._places[0])
        bends = ca.sum2(self._bend(*self._inputs(x, p), ca.mtimes(prices.T, self._weights)))
        return ca.mtimes([self._columns, ca.reshape(bends, size, size), self._columns.T])


class _HarmonicPart:
    """Harmonics at several angles as functions of x, p and the sums over angles (`first`)."""

    def __init__(self, coefficients: Any, angles: Any, x: Any, p: Any, first: Any, used: Sequence[int]) -> None:
        import casadi as ca

        own, follow = x[used], ca.SX.sym("follow", first.numel(), len(used))
        along, inputs = _Along(first, follow), [x, p, first, follow]
        self.count = coefficients.numel() // 2
        slopes = ca.jacobian(coefficients, own) + along(coefficients)
        self._coefficients = ca.Function("coefficients", inputs, [coefficients, ca.densify(slopes)])
        self._angles = ca.Function("angles", [x, p], [angles, ca.densify(ca.jacobian(angles, own))])
        prices, shifts = ca.SX.sym("prices", coefficients.numel()), ca.SX.sym("shifts", angles.numel())
        weighed = ca.dot(prices, coefficients) + ca.dot(shifts, angles)
        slope, pull = ca.gradient(weighed, own), ca.gradient(weighed, first)
        mixed = along(slope)
        bends = ca.jacobian(slope, own) + mixed + mixed.T + ca.mtimes(follow.T, along(pull))
        self._bends = ca.Function("bends", [*inputs, prices, shifts], [ca.densify(bends), ca.densify(pull)])

    def at(self, x: Any, p: Any, first: Any, follow: Any) -> "_Harmonics":
        return _Harmonics(self, [x, p, first, follow])


class _Harmonics:
    """Harmonics at x and p, MX."""

    def __init__(self, part: _HarmonicPart, inputs: list[Any]) -> None:
        import casadi as ca

        self._part, self._inputs, count = part, inputs, part.count
        both, both_slopes = part._coefficients(*inputs)
        (a, b), (a_x, b_x) = ((each[:count, :], each[count:, :]) for each in (both, both_slopes))
        phi, self._phi_x = part._angles(*inputs[:2])
        order = ca.DM(range(count))
        self._cos, self._sin = ca.cos(ca.mtimes(phi, order.T)), ca.sin(ca.mtimes(phi, order.T))
        self.values = self._turned(a, b)
        self._rate, self._bend = self._turned(order * b, -order * a), self._turned(-(order**2) * a, -(order**2) * b)
        self.slopes = ca.mtimes(ca.diag(self._rate), self._phi_x) + self._turned(a_x, b_x)
        scale = ca.diag(order)
        self._rate_x = self._turned(ca.mtimes(scale, b_x), -ca.mtimes(scale, a_x))

    def _turned(self, cosines: Any, sines: Any) -> Any:
        import casadi as ca

        return ca.mtimes(self._cos, cosines) + ca.mtimes(self._sin, sines)

    def curvature(self, prices: Any) -> tuple[Any, Any]:
        """Second derivatives weighted by prices, with the sums over angles as they are; and the prices of those."""
        import casadi as ca

        weights = ca.vertcat(ca.mtimes(self._cos.T, prices), ca.mtimes(self._sin.T, prices))
        bends, pull = self._part._bends(*self._inputs, weights, self._rate * prices)
        mixed = ca.mtimes([self._phi_x.T, ca.diag(prices), self._rate_x])
        bent = ca.mtimes([self._phi_x.T, ca.diag(prices * self._bend), self._phi_x])
        return bends + mixed + mixed.T + bent, pull


def with_recorder(system: Maths, recorder: SumRecorder) -> Maths:
    """System whose sums over angles, and of harmonics, are symbols."""
    return replace(system, spread=recorder.spread, weighted=recorder.weighted, summed=recorder.harmonics)
