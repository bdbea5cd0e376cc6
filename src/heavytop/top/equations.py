"""The three vector fields, written once over any ring.  The order of the state and every sign are decided here.

State y = (Ω1, Ω2, Ω3, γ1, γ2, γ3); γ is the unit vector pointing vertically up, in body axes.
The same functions serve heyoka expressions, Fractions, mpf, balls, power series
and sympy symbols: they use +, -, * and division by the principal moments, and no literals.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from itertools import permutations
from typing import Any, NamedTuple, Protocol

from heavytop.errors import InputError, quoted
from heavytop.precision import Scalar, Vector, cross, dot, shown
from heavytop.top.heavy_top import HeavyTop, State

VARIABLES = ("omega1", "omega2", "omega3", "gamma1", "gamma2", "gamma3")
NAMES = ("Ω1", "Ω2", "Ω3", "γ1", "γ2", "γ3")


class Parameters(NamedTuple):
    """The numbers that enter the fields, in any ring: principal moments I, n = P r, and the rotor.

    rotor: of `gyrostat` λ, by which the rotor makes the body turn faster about axis 2 (its angular momentum relative to
    the body is −I2 λ); of `heavy_gyrostat` that angular momentum k itself, a tuple of three; 0 of `heavy_top`.
    """

    inertia: Any
    moment: Any
    rotor: Any

    @property
    def rotors(self) -> tuple[Any, ...]:
        """The numbers of the rotor: k1, k2, k3, or λ alone."""
        return self.rotor if isinstance(self.rotor, tuple) else (self.rotor,)

    @property
    def rotor_rate(self) -> Fraction:
        """The rate of change by the rotor of an exact motion, in 1/time unit: |λ|, or the largest |k_i| over the
        smallest moment.
        """
        largest = max(map(abs, self.rotors))
        return largest / Fraction(min(self.inertia)) if isinstance(self.rotor, tuple) else Fraction(largest)

    @property
    def numbers(self) -> tuple[Any, ...]:
        """I, n and the rotor, one number after the other."""
        return (*self.inertia, *self.moment, *self.rotors)

    def mapped(self, number: Callable[[Any], Any]) -> Parameters:
        """The parameters in another ring: ``number`` of each of them."""
        rotors = tuple(map(number, self.rotors))
        rotor = rotors if isinstance(self.rotor, tuple) else rotors[0]
        return Parameters(tuple(map(number, self.inertia)), tuple(map(number, self.moment)), rotor)


def heavy_top(p: Parameters, y: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """(1.1) M' = M × Ω + P γ × r and (1.2) γ' = γ × Ω, as (Ω', γ') in the order of the state."""
    (i1, i2, i3), n = p.inertia, p.moment
    w1, w2, w3 = omega = y[:3]
    gamma = y[3:6]
    torque = cross(gamma, n)
    return (
        ((i2 - i3) * (w2 * w3) + torque[0]) / i1,
        ((i3 - i1) * (w3 * w1) + torque[1]) / i2,
        ((i1 - i2) * (w1 * w2) + torque[2]) / i3,
        *cross(gamma, omega),
    )


def gyrostat(p: Parameters, y: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """M' = M × ω and γ' = γ × ω with ω = Ω + λ e2: the free gyrostat with a constant rotor along axis 2.

    M = IΩ = Iω − I2 λ e2 is the angular momentum of body and rotor, so −I2 λ is the rotor's own, relative to the body.
    This is the system that the paper's formulas solve exactly, with λ = P b / (M·γ) from :func:`rotor`.
    """
    (i1, i2, i3), rotor = p.inertia, p.rotor
    w1, w2, w3 = y[:3]
    return (
        ((i2 - i3) * (w2 * w3) - rotor * (i3 * w3)) / i1,
        ((i3 - i1) * (w3 * w1)) / i2,
        ((i1 - i2) * (w1 * w2) + rotor * (i1 * w1)) / i3,
        *cross(y[3:6], (w1, w2 + rotor, w3)),
    )


def heavy_gyrostat(p: Parameters, y: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """M' = M × Ω + γ × n and γ' = γ × Ω with M = IΩ + k: a heavy top that carries a rotor of constant momentum k.

    k = 0 is the heavy top.  n = 0 is the gyrostat of Zhukovsky and Volterra; :func:`gyrostat` is its case
    k = (0, −I2 λ, 0), where Ω here is Ω + λ e2 there, and M and γ are the same.
    """
    (i1, i2, i3), n = p.inertia, p.moment
    w1, w2, w3 = omega = y[:3]
    gamma = y[3:6]
    torque, turning = cross(gamma, n), cross(p.rotor, omega)
    return (
        ((i2 - i3) * (w2 * w3) + turning[0] + torque[0]) / i1,
        ((i3 - i1) * (w3 * w1) + turning[1] + torque[1]) / i2,
        ((i1 - i2) * (w1 * w2) + turning[2] + torque[2]) / i3,
        *cross(gamma, omega),
    )


def _of_full_tensor(p: Parameters, y: Sequence[Scalar], rotor: Sequence[Scalar] | None) -> tuple[Scalar, ...]:
    """(1.1), (1.2) with products of inertia, ``p.inertia`` the three rows of the tensor, and k = ``rotor`` or None.

    Ω' = I⁻¹ (M × Ω + γ × n), with I⁻¹ by the cofactors of the symmetric tensor.
    """
    (a, f, e), (_, b, d), (_, _, c) = rows = p.inertia
    omega, gamma = y[:3], y[3:6]
    m = tuple(dot(row, omega) for row in rows)
    if rotor is not None:
        m = tuple(first + part for first, part in zip(m, rotor, strict=True))
    torque = tuple(first + part for first, part in zip(cross(m, omega), cross(gamma, p.moment), strict=True))
    adjugate = (
        (b * c - d * d, d * e - c * f, d * f - b * e),
        (d * e - c * f, a * c - e * e, e * f - a * d),
        (d * f - b * e, e * f - a * d, a * b - f * f),
    )
    determinant = dot(rows[0], adjugate[0])
    return (*(dot(row, torque) / determinant for row in adjugate), *cross(gamma, omega))


def _omega(p: Parameters, y: Sequence[Scalar]) -> tuple[Scalar, ...]:
    return tuple(y[:3])


def _omega_with_rotor(p: Parameters, y: Sequence[Scalar]) -> tuple[Scalar, ...]:
    return y[0], y[1] + p.rotor, y[2]


class VectorField(Protocol):
    """A function of a state, of as many numbers."""

    def __call__(self, p: Parameters, y: Sequence[Scalar], /) -> tuple[Scalar, ...]: ...


@dataclass(frozen=True, slots=True)
class System:
    """A system of equations: its field, and the angular velocity with which the body turns in space.

    enters: which parameters enter the field, by name.
    """

    name: str
    field: VectorField
    angular_velocity: VectorField
    enters: tuple[str, ...] = ("inertia", "moment")

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by name, so that a system is the same object in every process."""
        return system, (self.name,)

    def parameters(self, top: HeavyTop, start: State) -> Parameters:
        """Exact parameters of the field for this top and start; raises InputError if the system does not admit them."""
        require_no_other_rotor(self, top)
        if self is HEAVY_GYROSTAT:
            return Parameters(top.inertia, top.moment, top.rotor or (Fraction(0),) * 3)
        return Parameters(top.inertia, top.moment, rotor(top, start) if self is GYROSTAT else 0)

    def entering(self, p: Parameters) -> tuple[Any, ...]:
        """The numbers that enter the field, in order: the arguments of compiled code."""
        return tuple(value for name in self.enters for value in (p.rotors if name == "rotor" else getattr(p, name)))

    def taken_in(self, numbers: Sequence[Any]) -> Parameters:
        """The parameters from the numbers of :meth:`entering`; None for those that do not enter."""
        parameters: dict[str, Any] = dict.fromkeys(Parameters._fields)
        remaining = list(numbers)
        for name in self.enters:
            part, remaining = (remaining, []) if name == "rotor" else (remaining[:3], remaining[3:])
            parameters[name] = tuple(part) if len(part) > 1 else part[0]
        return Parameters(**parameters)

    def rates(self, p: Parameters, y: Sequence[Scalar]) -> tuple[Scalar, ...]:
        """The field where ``p.inertia`` may be the three rows of a full tensor, with y in its axes.

        ``field`` itself is for principal axes and has no branch: it is compiled.
        """
        if not isinstance(p.inertia[0], tuple):
            return self.field(p, y)
        return _of_full_tensor(p, y, p.rotor if "rotor" in self.enters else None)

    def attitude(self, p: Parameters, y: Sequence[Scalar], xi: Sequence[Scalar]) -> tuple[Scalar, Scalar, Scalar]:
        """ξ' = ξ × ω for a vector ξ fixed in space."""
        return cross(xi, self.angular_velocity(p, y))

    def with_attitude(self, p: Parameters, y: Sequence[Scalar]) -> tuple[Scalar, ...]:
        """(Ω', γ') of six numbers, (Ω', γ', ξ') of nine, ξ behind."""
        state = y[:6]
        return (*self.field(p, state), *(self.attitude(p, state, y[6:]) if len(y) > 6 else ()))


def rotor(top: HeavyTop, start: State) -> Fraction:
    """λ = P b / (M·γ), from the exact start.

    Raises InputError unless a = c = 0, M·γ is not 0 and γ is parallel to M (2.1): without these the paper's
    formulas, and so the gyrostat that they solve, are not defined.
    """
    a, _, c = top.centre
    if top.weight != 0 and (a != 0 or c != 0):
        raise InputError(
            f"The gyrostat needs the centre of mass on axis 2, but a = {shown(a)}, c = {shown(c)}.",
            "Give a centre of mass (0, b, 0): the paper assumes a = c = 0.",
        )
    momentum = top.angular_momentum(start.omega)
    area: Fraction = dot(momentum, start.gamma)
    if area == 0:
        raise InputError("The gyrostat needs M·gamma != 0, for lambda = P b / (M·gamma).", "Let it rotate about gamma.")
    across = cross(momentum, start.gamma)
    if any(across):
        raise InputError(
            "The gyrostat needs gamma parallel to M, as (2.1) claims: "
            f"M x gamma = ({', '.join(f'{float(x):.6g}' for x in across)}).",
            "Give gamma = M/|M| with a rational |M|.",
        )
    return top.moment[1] / area


HEAVY_TOP = System("heavy_top", heavy_top, _omega)
GYROSTAT = System("gyrostat", gyrostat, _omega_with_rotor, ("inertia", "rotor"))
HEAVY_GYROSTAT = System("heavy_gyrostat", heavy_gyrostat, _omega, ("inertia", "moment", "rotor"))
SYSTEMS = (HEAVY_TOP, GYROSTAT, HEAVY_GYROSTAT)
WHICH_SYSTEM = "heavy_top, gyrostat or heavy_gyrostat"


def system(name: str) -> System:
    """The system of that name; raises InputError for any other."""
    for known in SYSTEMS:
        if name == known.name:
            return known
    raise InputError(f"Unknown system {name[:60]!r}.", f"Use {WHICH_SYSTEM}.")


class WithRotor(Protocol):
    """A top or a body that may have a rotor."""

    @property
    def rotor(self) -> Vector | None: ...


def system_of(chosen: System | str | None, *tops: WithRotor) -> System:
    """The requested system; by default `heavy_gyrostat` if a top has a rotor, else `heavy_top`.

    Raises InputError for an unknown name, and for a system that does not admit the rotor of a top.
    """
    if chosen is None:
        return HEAVY_TOP if all(top.rotor is None for top in tops) else HEAVY_GYROSTAT
    resolved = system(chosen) if isinstance(chosen, str) else chosen
    for top in tops:
        require_no_other_rotor(resolved, top)
    return resolved


def require_no_other_rotor(chosen: System, top: WithRotor) -> None:
    """Raise InputError where the top has a rotor and the system another one, or none."""
    if top.rotor is not None and chosen is not HEAVY_GYROSTAT:
        why = "takes its rotor from the start" if chosen is GYROSTAT else "has no rotor"
        raise InputError(
            f"The top has a rotor ({', '.join(map(shown, top.rotor))}), but the system {chosen.name} {why}.",
            "Use the system heavy_gyrostat, or give no rotor.",
        )


# First integrals and invariant relations, written once over any ring, with the tops and starts for which they hold.
#
# Every integral takes (Parameters, y) with y in the order of the state.  Cases count up to a renaming of the axes:
# a renaming of odd sign turns Ω into -Ω, which changes no integral here but for its own sign.


Axes = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Integral:
    """A function that is constant along the motions for which :func:`holding` returns it.

    name: as it appears in reports.
    value: the function, over any ring.
    """

    name: str
    value: Callable[[Parameters, Any], Any]


def momentum(p: Parameters, y: Sequence[Scalar]) -> tuple[Scalar, Scalar, Scalar]:
    """M = I Ω, and + k of `heavy_gyrostat`."""
    first, second, third = momentum_of_body(p, y)
    if not isinstance(p.rotor, tuple):
        return first, second, third
    return first + p.rotor[0], second + p.rotor[1], third + p.rotor[2]


def momentum_of_body(p: Parameters, y: Sequence[Scalar]) -> tuple[Scalar, Scalar, Scalar]:
    """I Ω; of a full tensor where the moments are its three rows."""
    if isinstance(p.inertia[0], tuple):
        return dot(p.inertia[0], y[:3]), dot(p.inertia[1], y[:3]), dot(p.inertia[2], y[:3])
    return p.inertia[0] * y[0], p.inertia[1] * y[1], p.inertia[2] * y[2]


def gamma_squared(p: Parameters, y: Sequence[Scalar]) -> Scalar:
    """|γ|² = 1, the first of (1.3)."""
    return dot(y[3:6], y[3:6])


def area(p: Parameters, y: Sequence[Scalar]) -> Scalar:
    """C0 = M·γ, the second of (1.3)."""
    return dot(momentum(p, y), y[3:6])


def energy(p: Parameters, y: Sequence[Scalar]) -> Any:
    """C1 = ½ Ω·IΩ + P r·γ, the third of (1.3)."""
    return dot(momentum_of_body(p, y), y[:3]) / 2 + dot(p.moment, y[3:6])


def momentum_squared(p: Parameters, y: Sequence[Scalar]) -> Scalar:
    """|M|²: Euler's top (P r = 0), and the gyrostats without weight."""
    m = momentum(p, y)
    return dot(m, m)


def gyrostat_energy(p: Parameters, y: Sequence[Scalar]) -> Any:
    """½ M·I⁻¹M + λ M2, the gyrostat's energy."""
    m = momentum(p, y)
    return dot(m, y[:3]) / 2 + p.rotor * m[1]


def spin(p: Parameters, y: Sequence[Scalar], axes: Axes) -> Scalar:
    """Lagrange's integral: Ω along the axis of symmetry ``axes[2]``."""
    return y[axes[2]]


def kovalevskaya_xi(p: Parameters, y: Sequence[Scalar], axes: Axes) -> tuple[Scalar, Scalar]:
    """ξ = (Ω1 + iΩ2)² − (n1 + i n2)(γ1 + iγ2), n = P r/I3, the small moment on axis ``axes[2]``: (real, imaginary)."""
    i, j, k = axes
    a, b = p.moment[i], p.moment[j]
    real = y[i] * y[i] - y[j] * y[j] - (a * y[3 + i] - b * y[3 + j]) / p.inertia[k]
    imaginary = y[i] * y[j] + y[i] * y[j] - (a * y[3 + j] + b * y[3 + i]) / p.inertia[k]
    return real, imaginary


def kovalevskaya(p: Parameters, y: Sequence[Scalar], axes: Axes) -> Scalar:
    """|ξ|² of :func:`kovalevskaya_xi`."""
    real, imaginary = kovalevskaya_xi(p, y, axes)
    return real * real + imaginary * imaginary


def goryachev_chaplygin(p: Parameters, y: Sequence[Scalar], axes: Axes) -> Any:
    """Ω3 (Ω1² + Ω2²) − (n1 Ω1 + n2 Ω2) γ3, n = P r/I3, conserved on C0 = 0; the small moment on axis ``axes[2]``."""
    i, j, k = axes
    along = p.moment[i] * y[i] + p.moment[j] * y[j]
    return y[k] * (y[i] * y[i] + y[j] * y[j]) - along * y[3 + k] / p.inertia[k]


def hess(p: Parameters, y: Sequence[Scalar], axes: Axes) -> Any:
    """I1 a Ω1 + I3 c Ω3 (times P), an invariant relation: conserved where it is 0."""
    i, _, k = axes
    return p.moment[i] * p.inertia[i] * y[i] + p.moment[k] * p.inertia[k] * y[k]


def moment_along_centre(p: Parameters, y: Sequence[Scalar]) -> Any:
    """IΩ·r (times P) of a top with I1 = I2 = I3."""
    return dot(momentum_of_body(p, y), p.moment)


def _equatorial_square(y: Sequence[Scalar], axes: Axes) -> Scalar:
    return y[axes[0]] * y[axes[0]] + y[axes[1]] * y[axes[1]]


def kovalevskaya_yehia(p: Parameters, y: Sequence[Scalar], axes: Axes) -> Any:
    """|ξ|² of :func:`kovalevskaya_xi` + 2λ (Ω3 − λ)(Ω1² + Ω2²) − 4λ (n1 Ω1 + n2 Ω2) γ3, λ = k3/I3, n = P r/I3.

    The rotor lies on the axis of the small moment, ``axes[2]``.  Source: H. M. Yehia, 1986.
    """
    i, j, k = axes
    rotor = p.rotor[k] / p.inertia[k]
    along = (p.moment[i] * y[i] + p.moment[j] * y[j]) * y[3 + k] / p.inertia[k]
    half = rotor * ((y[k] - rotor) * _equatorial_square(y, axes) - (along + along))
    return kovalevskaya(p, y, axes) + half + half


def sretensky(p: Parameters, y: Sequence[Scalar], axes: Axes) -> Any:
    """(Ω3 − λ)(Ω1² + Ω2²) − (n1 Ω1 + n2 Ω2) γ3, λ = k3/I3, n = P r/I3, conserved on M·γ = 0.

    The rotor lies on the axis of the small moment, ``axes[2]``.  Source: L. N. Sretensky, 1963.
    """
    rotor = p.rotor[axes[2]] / p.inertia[axes[2]]
    return goryachev_chaplygin(p, y, axes) - rotor * _equatorial_square(y, axes)


class Magnitude:
    """A bound of |x| in a ring: that of a difference is a sum, so that no terms cancel."""

    def __init__(self, size: Any) -> None:
        self.size: Any = size.size if isinstance(size, Magnitude) else abs(size)

    def __add__(self, other: object) -> Magnitude:
        return Magnitude(self.size + Magnitude(other).size)

    def __mul__(self, other: object) -> Magnitude:
        return Magnitude(self.size * Magnitude(other).size)

    def __truediv__(self, other: object) -> Magnitude:
        return Magnitude(self.size / Magnitude(other).size)

    __sub__ = __radd__ = __add__
    __rmul__ = __mul__


def largest(integral: Integral, p: Parameters, omega: Any) -> Any:
    """The sum of the absolute terms of a first integral where every |Ω_i| is ``omega`` and every |γ_i| is 1."""
    return integral.value(p.mapped(Magnitude), [*map(Magnitude, (omega,) * 3), *map(Magnitude, (1, 1, 1))]).size


def holding(top: HeavyTop, start: State, system: System | None = None) -> tuple[Integral, ...]:
    """Every integral that holds for this top and start, found by exact rational tests on the exact data.

    system: by default the heavy gyrostat of a top with a rotor, else the heavy top.
    Invariant relations (Goryachev-Chaplygin, Hess) are returned only for starts on them.
    """
    square = Integral("gamma_squared", gamma_squared)
    system = system or system_of(None, top)
    if system is GYROSTAT:
        return (square, Integral("area", area), *_of_gyrostat(top))
    more = _of_heavy_gyrostat if system is HEAVY_GYROSTAT else _of_heavy_top
    p = system.parameters(top, start)
    return (square, Integral("area", area), Integral("energy", energy), *more(p, start.flat))


def _of_gyrostat(top: HeavyTop) -> Iterator[Integral]:
    yield Integral("momentum_squared", momentum_squared)
    yield Integral("gyrostat_energy", gyrostat_energy)
    if top.inertia[0] == top.inertia[2]:  # the rotor lies on the axis of symmetry
        yield Integral("spin2", partial(spin, axes=(2, 0, 1)))


def _of_heavy_top(p: Parameters, y: tuple[Fraction, ...]) -> Iterator[Integral]:
    n = p.moment
    if not any(n):
        yield Integral("momentum_squared", momentum_squared)
    if p.inertia[0] == p.inertia[1] == p.inertia[2] and any(n):
        yield Integral("moment_along_centre", moment_along_centre)
    on_zero_area = area(p, y) == 0
    for axes in permutations(range(3)):
        i, j, k = axes
        i1, i2, i3 = (p.inertia[axis] for axis in axes)
        if i < j and i1 == i2:
            if n[i] == n[j] == 0:
                yield Integral(f"spin{k + 1}", partial(spin, axes=axes))
            if i1 == 2 * i3 and n[k] == 0:
                yield Integral("kovalevskaya", partial(kovalevskaya, axes=axes))
        if i < j and i1 == i2 == 4 * i3 and n[k] == 0 and any(n) and on_zero_area:
            yield Integral("goryachev_chaplygin", partial(goryachev_chaplygin, axes=axes))
        if i < k and n[j] == 0 and n[i] != 0 and n[k] != 0 and i1 * (i2 - i3) * n[i] ** 2 == i3 * (i1 - i2) * n[k] ** 2:
            relation = partial(hess, axes=axes)
            if relation(p, y) == 0:
                yield Integral("hess", relation)


def _of_heavy_gyrostat(p: Parameters, y: tuple[Fraction, ...]) -> Iterator[Integral]:
    n, rotor = p.moment, p.rotor
    if not any(n):
        yield Integral("momentum_squared", momentum_squared)
    if p.inertia[0] == p.inertia[1] == p.inertia[2] and any(n) and not any(cross(rotor, n)):
        yield Integral("moment_along_centre", moment_along_centre)
    for axes in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        i, j, k = axes
        if p.inertia[i] != p.inertia[j] or rotor[i] != 0 or rotor[j] != 0:
            continue
        if n[i] == n[j] == 0:
            yield Integral(f"spin{k + 1}", partial(spin, axes=axes))
        if n[k] != 0 or not any(n):
            continue
        if p.inertia[i] == 2 * p.inertia[k]:
            relation = partial(kovalevskaya_yehia, axes=axes)
            yield Integral("kovalevskaya_yehia", relation)
        if p.inertia[i] == 4 * p.inertia[k] and area(p, y) == 0:
            yield Integral("sretensky", partial(sretensky, axes=axes))


# How fast a motion changes, from its parameters and start, in exact rationals.


_AXES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


def square_of_rate(system: System, p: Parameters, y: tuple[Any, ...]) -> Any:
    """The square of the largest rate at which the motion through ``y`` changes, in 1/time unit².

    The rates are those of the rotation, |Ω_k| and |λ| or |k_k|/√(I_i I_j); of the precession of Ω about axis k,
    Ω_k² (I_k − I_i)(I_k − I_j)/(I_i I_j); and of the pendulum about axis i that the weight drives, with the parts of
    P r and γ across that axis: |P r||γ|/I_i.  Largest components stand for lengths.  Rational for rational data; of
    doubles a double.
    """
    inertia, omega, gamma = p.inertia, y[:3], y[3:6]
    by_rotor = () if system is HEAVY_GYROSTAT else p.rotors
    squares = [max(map(abs, (*omega, *by_rotor))) ** 2]
    for i, j, k in _AXES:
        apart = (inertia[i] - inertia[j]) * (inertia[i] - inertia[k])
        squares.append(abs(omega[i] ** 2 * apart / (inertia[j] * inertia[k])))
        if system is HEAVY_GYROSTAT:
            squares.append(p.rotor[k] ** 2 / (inertia[i] * inertia[j]))
        if system is not GYROSTAT:
            across = [max(abs(vector[j]), abs(vector[k])) for vector in (p.moment, gamma)]
            squares.append(across[0] * across[1] / inertia[i])
    return max(squares)


def component(name: str) -> int:
    """The index of a component in the state, by a name such as omega1 or γ3; raises InputError for another name."""
    plain = str(name).strip()
    for greek, latin in (("Ω", "omega"), ("\N{OHM SIGN}", "omega"), ("γ", "gamma")):
        plain = plain.replace(greek, latin)
    if plain not in VARIABLES:
        raise InputError(f"{quoted(name)} is not a component of the state.", f"Use {', '.join(VARIABLES)}.")
    return VARIABLES.index(plain)
