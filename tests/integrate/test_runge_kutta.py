"""A Runge-Kutta method is its coefficients: its order, its way back, its attitude, and tableaux that are none."""

from fractions import Fraction

import numpy as np
import pytest

import heavytop as ht
from heavytop.cases import CASES
from heavytop.errors import InputError
from heavytop.integrate.peers.runge_kutta import Tableau

F = Fraction
EULER = Tableau(1, (), (1,))
MIDPOINT = Tableau(2, ((F(1, 2),),), (0, 1))
KUTTA = Tableau(3, ((F(1, 2),), (-1, 2)), (F(1, 6), F(2, 3), F(1, 6)))
CLASSICAL = Tableau(4, ((F(1, 2),), (0, F(1, 2)), (0, 0, 1)), (F(1, 6), F(1, 3), F(1, 3), F(1, 6)))
THREE_EIGHTHS = Tableau(4, ((F(1, 3),), (F(-1, 3), 1), (1, -1, 1)), (F(1, 8), F(3, 8), F(3, 8), F(1, 8)))
METHODS = [EULER, MIDPOINT, KUTTA, CLASSICAL, THREE_EIGHTHS]
LAST = F(1)


def error(method: Tableau, name: str, step: Fraction) -> float:
    case = CASES[name]
    known = ht.propagate(case.top, case.start, [LAST], system=case.system).to_numpy()
    run = method.peer("mine")(case.top, case.start, (LAST,), ht.DOUBLE, system=case.system, step=step)
    assert run.steps == LAST / step
    assert run.evaluations == len(method.b) * run.steps
    return float(abs(run.to_numpy() - known).max())


@pytest.mark.parametrize(("method", "name"), [*((method, "generic") for method in METHODS), (CLASSICAL, "gyrostat")])
def test_the_error_shrinks_by_the_order(method: Tableau, name: str) -> None:
    coarse, fine = (error(method, name, F(1, n)) for n in (32, 64))
    assert method.order - 0.3 < np.log2(coarse / fine) < method.order + 0.7


def test_it_goes_back_and_carries_the_attitude() -> None:
    case, peer = CASES["generic"], CLASSICAL.peer("mine:rk4")
    run = ht.propagate(case.top, case.start, [-1, -2], integrator=peer, attitude=True)
    known = ht.propagate(case.top, case.start, [-1, -2], attitude=True)
    assert abs(run.quaternions() - known.quaternions()).max() < 1e-6
    assert run.integrator == "mine:rk4"


@pytest.mark.parametrize(
    ("a", "b", "cause"),
    [
        ((), (), "sum to 1; got 0"),
        (((1,),), (1,), r"lengths: \[1\]"),
        (((F(1, 2),), (1,)), (0, 0, 1), r"lengths: \[1, 1\]"),
        (((F(1, 2),),), (0, F(99, 100)), "sum to 1; got 0.99"),
    ],
)
def test_coefficients_that_are_no_method_are_refused(a: tuple, b: tuple, cause: str) -> None:
    with pytest.raises(InputError, match=cause):
        Tableau(1, a, b)
