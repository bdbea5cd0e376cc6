"""The known first step of a compiled integrator: known from elsewhere too, and met only by healthy code."""

from fractions import Fraction

import numpy
import pytest

from heavytop.cases import CASES
from heavytop.errors import Contradiction, InputError
from heavytop.exact.enclosure.run import Validated
from heavytop.integrate.heyoka import engines
from heavytop.integrate.heyoka.engines import GAMMA, OMEGA, PARAMETERS, check, compiled, derivatives
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.trajectory import Problem
from heavytop.precision import DOUBLE, EXTENDED, QUAD, real
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, Parameters
from heavytop.top.heavy_top import HeavyTop, State


def test_the_known_derivatives_are_those_of_the_enclosed_motion() -> None:
    """The enclosure has a recurrence of its own, in balls."""
    top, start = HeavyTop(PARAMETERS.inertia, 1, PARAMETERS.moment), State(OMEGA, GAMMA)
    series = Validated(top, start, HEAVY_TOP).series(Fraction(0), 12, 200)
    factorial = 1
    for n, known in enumerate(derivatives(HEAVY_TOP, False, 12)):
        factorial *= n or 1
        for component, value in zip(series, known, strict=True):
            assert (component[n] * factorial).contains(value)


@pytest.mark.slow
@pytest.mark.parametrize("system", [HEAVY_TOP, GYROSTAT, HEAVY_GYROSTAT], ids=lambda system: system.name)
def test_every_kind_of_integrator_passes_and_is_at_time_0_again(system, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engines.build, "results", {})
    for precision in (EXTENDED, QUAD, real(24)) if system is HEAVY_TOP else (QUAD,):
        engine = compiled(system, precision, attitude=True).engine
        assert engine.time == 0
        assert not numpy.any(engine.state != 0)
    compiled(system, DOUBLE, tolerance=Fraction(1, 10**12), lanes=4)
    for options in ({"high_accuracy": True}, {"compact_mode": True}) if system is HEAVY_TOP else ():
        compiled(system, DOUBLE, **options)


class Faulty:
    """A healthy integrator of which one thing is off by one part in 10^12."""

    def __init__(self, engine, what: str) -> None:
        self.__dict__.update(engine=engine, what=what)

    def __getattr__(self, name: str):
        value = getattr(self.engine, name)
        if name == "tc" and self.what.startswith("coefficient"):
            value = value.copy()
            value[4, int(self.what.split()[1])] *= 1 + 1e-12
        elif name == self.what == "last_h":
            return value * (1 + 1e-11)
        return value

    def __setattr__(self, name: str, value) -> None:
        setattr(self.engine, name, value)

    def update_d_output(self, time):
        return self.engine.update_d_output(time) * (1 + 1e-12 * (self.what == "dense"))

    def step(self, **options):
        if self.what == "nan":
            self.engine.pars[0] = float("nan")
        return self.engine.step(**options)


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ("coefficient 1", "Taylor coefficient 1"),
        ("coefficient 20", "Taylor coefficient 20"),
        ("last_h", "length of the step"),
        ("dense", "dense output"),
        ("nan", "Taylor coefficient"),
    ],
)
def test_a_part_in_a_million_million_is_found(what: str, message: str) -> None:
    engine = compiled(HEAVY_TOP, DOUBLE).engine
    check(Faulty(engine, "nothing"), HEAVY_TOP, DOUBLE)
    with pytest.raises(Contradiction, match=message):
        check(Faulty(engine, what), HEAVY_TOP, DOUBLE)
    check(engine, HEAVY_TOP, DOUBLE)


@pytest.mark.parametrize(
    ("inertia", "moment"),
    [
        ((3, 2, 1.5), (1 / 2, 1 / 3, 1 / 5)),
        ((3.5, 8, 6), (1 / 4, 1 / 2, 1 / 5)),
        ((1.5, 8, 1.5), (1 / 3, 1 / 4, 1 / 2)),
    ],
)
def test_a_coefficient_whose_terms_cancel_is_right_to_the_rounding_of_the_terms(inertia, moment) -> None:
    p, tool = Parameters(inertia, moment, 0), compiled(HEAVY_TOP, DOUBLE)
    with tool.borrowed() as engine:
        engine.pars[:] = [*inertia, *moment]
        check(engine, HEAVY_TOP, DOUBLE, p.mapped(Fraction))
        with pytest.raises(Contradiction, match="Taylor coefficient 8"):
            check(Faulty(engine, "coefficient 8"), HEAVY_TOP, DOUBLE, p.mapped(Fraction))


@pytest.mark.slow
def test_a_wrong_field_is_refused_before_its_first_use(monkeypatch: pytest.MonkeyPatch) -> None:
    healthy = engines.expressions

    def biased(*args):
        (first, rate), *rest = healthy(*args)
        return [(first, rate * (1 + 1e-13)), *rest]

    monkeypatch.setattr(engines, "expressions", biased)
    monkeypatch.setattr(engines.build, "results", {})
    with pytest.raises(Contradiction, match="Taylor coefficient 1"):
        compiled(HEAVY_TOP, DOUBLE)
    assert not engines.build.results


@pytest.mark.slow
def test_code_with_the_numbers_of_a_top_is_checked_with_these_and_computes_the_same_motion() -> None:
    case = CASES["kovalevskaya"]
    given = Problem.of(case.top, case.start, DOUBLE).parameters
    runs = [propagate(case.top, case.start, [10], DOUBLE, constants=each) for each in (False, True)]
    assert [run.flags["coefficients"] for run in runs] == ["par", "constants"]
    assert numpy.allclose(runs[0].states[0], runs[1].states[0], rtol=1e-12, atol=1e-14)
    engine = compiled(HEAVY_TOP, DOUBLE, constants=given).engine
    other = given._replace(inertia=(given.inertia[0] * (1 + Fraction(1, 10**12)), *given.inertia[1:]))
    with pytest.raises(Contradiction, match="Taylor coefficient"):
        check(engine, HEAVY_TOP, DOUBLE, other)


def test_constants_are_for_double_alone() -> None:
    case = CASES["euler"]
    given = Problem.of(case.top, case.start, QUAD).parameters
    with pytest.raises(InputError, match="double"):
        compiled(HEAVY_TOP, QUAD, constants=given)
