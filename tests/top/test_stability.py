"""Stability of steady motions: against eigenvalues in 60 digits, and against motions that start beside them."""

from fractions import Fraction
from random import Random

import mpmath
import pytest

import heavytop as ht
from heavytop.cases import CASES
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, System
from heavytop.top.stability import Stability, stability


def of(top: ht.HeavyTop, start: ht.State, system: System = HEAVY_TOP) -> Stability | None:
    return stability(system, system.parameters(top, start), start.flat)


def number(draw: Random) -> Fraction:
    return Fraction(draw.randint(-12, 12), draw.randint(1, 6))


def steady(seed: int) -> tuple[ht.HeavyTop, ht.State, System]:
    """A random top in equilibrium, or turning steadily; with a rotor, free or heavy."""
    draw = Random(seed)
    inertia = [Fraction(draw.randint(6, 12), draw.randint(1, 3)) for _ in range(3)]
    if draw.random() < 0.3:
        inertia[1] = inertia[0]
    axis, spin = draw.randrange(3), number(draw) * draw.choice((0, 1, 3))
    unit = [Fraction(k == axis) for k in range(3)]
    omega = [spin * u for u in unit]
    kind = draw.choice(("free", "axis", "axis", "rotor", "tilted"))
    if kind == "free":
        return ht.HeavyTop(inertia, 0, (0, 0, 0)), ht.State(omega, ("2/7", "3/7", "6/7")), HEAVY_TOP
    if kind == "tilted":  # Ω = ω γ off the axes: n balances ω² γ × I γ
        gamma = [Fraction(2, 7), Fraction(3, 7), Fraction(6, 7)]
        lever = number(draw)
        n = [spin**2 * i * g + lever * g for i, g in zip(inertia, gamma, strict=True)]
        return ht.HeavyTop(inertia, 1, n), ht.State([spin * g for g in gamma], gamma), HEAVY_TOP
    gamma = [draw.choice((-1, 1)) * u for u in unit]
    centre = [number(draw) * u for u in unit]
    if kind == "rotor":
        return ht.HeavyTop(inertia, 1, centre, [number(draw) * u for u in unit]), ht.State(omega, gamma), HEAVY_GYROSTAT
    return ht.HeavyTop(inertia, 1, centre), ht.State(omega, gamma), HEAVY_TOP


def growth(top: ht.HeavyTop, start: ht.State, system: System) -> mpmath.mpf:
    """The largest real part of an eigenvalue, of Ω alone where γ does not enter."""
    p, y = system.parameters(top, start), list(start.flat)
    size = 3 if not any(p.moment) else 6
    columns = []
    for j in range(size):
        up, down = ([v + s * Fraction(k == j) for k, v in enumerate(y)] for s in (1, -1))
        pairs = zip(system.field(p, up), system.field(p, down), strict=True)
        columns.append([(a - b) / 2 for a, b in pairs])
    with mpmath.workdps(60):
        matrix = mpmath.matrix(size, size)
        for j, column in enumerate(columns):
            for i in range(size):
                matrix[i, j] = mpmath.mpf(column[i].numerator) / column[i].denominator
        values, _ = mpmath.eig(matrix)
        return max(mpmath.re(value) for value in values)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 200, 50))
def test_verdict_and_rate_are_those_of_the_eigenvalues(first: int) -> None:
    verdicts = set()
    for seed in range(first, first + 50):
        top, start, system = steady(seed)
        found = of(top, start, system)
        largest = growth(top, start, system)
        # a double eigenvalue has half of the digits, one that is sixfold ten of them
        assert bool(found.rate) == (largest > 1e-8)
        assert (found.verdict == "unstable") == bool(found.rate or found.drift)
        if found.rate:
            assert found.rate == pytest.approx(float(largest), rel=1e-12)
        verdicts.add(found.verdict)
    assert verdicts == {"stable", "unstable", "spectrally stable"}


@pytest.mark.parametrize("seed", range(60))
def test_beside_a_motion_that_is_called_stable_another_stays(seed: int) -> None:
    top, start, system = steady(seed)
    found = of(top, start, system)
    if found is None or found.verdict != "stable":
        return
    beside = ht.State([w + Fraction(k, 10**7) for k, w in enumerate(start.omega, 1)], start.gamma)
    run = ht.propagate(top, beside, [10 * k for k in range(1, 6)], system=system)
    assert max(abs(float(s[k]) - float(w)) for s in run.states for k, w in enumerate(start.omega)) < 1e-3


@pytest.mark.parametrize(
    ("spin", "verdict"), [("1999/1000", "unstable"), (2, "spectrally stable"), ("2001/1000", "stable")]
)
def test_the_sleeping_top_wakes_below_its_critical_spin(spin: object, verdict: str) -> None:
    for axis in range(3):
        unit = [int(k == axis) for k in range(3)]
        top = ht.HeavyTop((1, 1, 1), 1, unit)
        found = of(top, ht.State([Fraction(spin) * u for u in unit], unit))
        assert found.verdict == verdict


def test_a_regular_precession_is_stable_and_other_motions_are_none() -> None:
    # about the vertical at 1, spin 4 and inclination with cos θ = 4/5: ψ' I3 Ω3 = I1 ψ'² cos θ + n3
    sine, cosine = Fraction(3, 5), Fraction(4, 5)
    top = ht.HeavyTop((1, 1, "1/2"), 1, (0, 0, "6/5"))
    start = ht.State((sine, 0, 4), (sine, 0, cosine))
    found = of(top, start)
    assert found == Stability("regular precession of axis 3", "stable")
    assert of(top, ht.State((sine, 0, 5), (sine, 0, cosine))) is None
    assert of(CASES["generic"].top, CASES["generic"].start) is None
    assert of(CASES["gyrostat"].top, CASES["gyrostat"].start, GYROSTAT) is None


@pytest.mark.parametrize("axes", [(0, 1, 2), (1, 2, 0), (2, 0, 1)])
@pytest.mark.parametrize("rotor", [Fraction(0), Fraction(3, 5)])
def test_about_an_axis_between_two_equal_moments_omega_drifts_away(rotor: Fraction, axes: tuple[int, ...]) -> None:
    """Moments 2, 2, 1: Ω = (3, 4, Ω3) turns by the angle (Ω3 + k3)/2 t; beside the steady Ω3 = -k3 by ε t/2."""

    def renamed(*vector: object) -> list[object]:
        return [vector[axis] for axis in axes]

    off, time = Fraction(1, 1000), Fraction(1000)
    system = HEAVY_GYROSTAT if rotor else HEAVY_TOP
    top = ht.HeavyTop(renamed(2, 2, 1), 0, (0, 0, 0), renamed(0, 0, rotor) if rotor else None)
    steady_motion = of(top, ht.State(renamed(3, 4, rotor), (0, 0, 1)), system)
    assert (steady_motion.verdict, steady_motion.rate, steady_motion.drift) == ("unstable", 0, 0.5)
    assert "drift away linearly, by 0.5 ε t" in steady_motion.text()
    beside = ht.reference(top, ht.State(renamed(3, 4, rotor + off), (0, 0, 1)), [time], digits=12, system=system)
    omega = [float(beside.states[0][axes.index(k)].value) for k in range(2)]
    turned = complex(*omega) / complex(3, 4)
    assert abs(mpmath.arg(turned)) == pytest.approx(steady_motion.drift * off * time)
    assert of(top, ht.State(renamed(3, 4, rotor + off), (0, 0, 1)), system) is None


def test_omega_of_a_spherical_body_stays() -> None:
    steady_motion = of(ht.HeavyTop((2, 2, 2), 0, (0, 0, 0)), ht.State((3, 4, 0), (0, 0, 1)))
    assert steady_motion.drift == 0


def test_sentence_attribute_and_key_say_the_same() -> None:
    top, start = ht.HeavyTop((3, 2, 1), 0, (0, 0, 0)), ht.State((0, 20, 0), ("3/5", 0, "4/5"))
    said = "permanent rotation about the middle axis, unstable, 11.55 per unit of time: 2^-53 grows to 1 by t = 3.2"
    run, known = ht.propagate(top, start, [1]), ht.reference(top, start, [1], digits=10)
    assert said in str(run)
    assert said in str(known)
    assert run.stability == known.stability
    assert known.document()["stability"]["verdict"] == "unstable"
    assert ht.propagate(CASES["generic"].top, CASES["generic"].start, [1]).stability is None
