"""Every public function with odd arguments: an answer, or an error with cause and remedy, and nothing else."""

import inspect
import itertools
import math
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any, get_args, get_type_hints

import mpmath
import numpy as np
import pytest

import heavytop as ht
from support import audits
from support.helpers import START, TOP

REST = ht.HeavyTop((2, 2, 2), 0, (0, 0, 0))
STILL = ht.State((0, 0, 0), ("3/5", 0, "4/5"))


class Hostile:
    """Fails at whatever is asked of it."""

    def __iter__(self):
        raise RuntimeError("no")

    def __index__(self):
        raise RuntimeError("no")

    def __repr__(self):
        raise RuntimeError("no")


def failing():
    yield 1
    raise KeyError("no")


ODD: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 3, 10**6000, -(10**400), 0.0, -0.0, 53.0, 0.1, 1e-30, 1e308, 5e-324, math.nan,
    math.inf, -math.inf, 1j, "", " ", "1", "321", "1/0", "nan", "1e99999999", "0x1p3", "double", "heavy_top", "smoke",
    "x" * 5000, "\ud800",
    "\0", "٣", b"1", bytearray(b"321"), Fraction(1, 3), Fraction(10) ** 500, Fraction(1, 10**500), Decimal("0.1"),
    Decimal("NaN"), Decimal("sNaN"), Decimal("-Infinity"), Decimal("1e999999999"), mpmath.mpf(1), mpmath.nan,
    np.float64(0.5), np.float32("nan"), np.float16(2), np.longdouble(1) / 3, np.longdouble("inf"), np.int8(3),
    np.uint64(7), np.bool_(True), np.str_("1"), np.complex128(1), np.datetime64("2020-01-01"), np.array(2.0),
    np.array([]),
    np.array([1.0, 2.0, 3.0]), np.array([[1.0, 2.0], [3.0, 4.0]]), np.array(["1", "x"]), np.array([None]),
    np.ma.masked_array([1.0, 2.0], [True, False]), np.zeros((2, 6)), np.zeros((2, 3, 6)), [], [1], [1, 2, 3], [3, 2, 1],
    [0], [0, 1], [1, 1], [1, -1], ["1", 2.0, None], [[1, 2, 3]], (1, 2, 3, 4), (0, 0, 0), (1, 1, 1), {1, 2, 3},
    frozenset({1}), {1: 2}, {}, range(1, 4), object, object(), Hostile(), len, lambda *_: None, Path("nowhere"), Path(),
    ht.DOUBLE, ht.Precision("double", 99), ht.Precision("odd", 3), ht.HEAVY_TOP, ht.GYROSTAT, TOP, START, [TOP],
    [START], (TOP, None), ht.HeavyTop((1, 1, "1e-200"), "1e140", (0, 0, "1e140")), ht.State((1, 2, 3), (1, 1, 0)),
    ht.State((0, 0, 0), (0, 0, 0)), ht.State((0, 0, 0), (0, 0, 1)), ht.State((0.1, 0.2, 0.3), (0.6, 0.0, 0.8)),
)  # fmt: skip
GENERATORS: tuple[Callable[[], Any], ...] = (failing, lambda: (x for x in (1, 2, 3)), lambda: iter("321"))

GOOD: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "HeavyTop": (ht.HeavyTop, {"inertia": (3, 2, 1), "weight": 1, "centre": (1, 0, 0)}),
    "State": (ht.State, {"omega": (1, 2, 3), "gamma": (0, 0, 1)}),
    "Body": (ht.Body, {"mass": 1, "gravity": 1, "centre": (0, 0, 1), "inertia": (3, 2, 1), "about": "pivot"}),
    "real": (ht.real, {"bits": 60}),
    "propagate": (ht.propagate, {"top": TOP, "start": START, "times": [1], "step_limit": 5}),
    "ensemble": (ht.ensemble, {"tops": [TOP], "starts": START, "times": [1], "threads": 1, "step_limit": 5}),
    "reference": (ht.reference, {"top": REST, "start": STILL, "times": [1], "digits": 20}),
    "claim_library": (ht.claim_library, {"tag": "delone"}),
    "events": (
        ht.events,
        {"top": TOP, "start": START, "until": 3, "function": "gamma3 = 1/2", "step_limit": 5, "limit": 2},
    ),
    "poincare": (ht.poincare, {"top": TOP, "starts": [START], "until": 1, "limit": 2}),
    "score": (
        ht.score,
        {
            **{"times": [1], "states": [[0.1, 0.4, 0.9, 0.6, 0.0, 0.8]], "top": REST, "start": STILL},
            **{"name": "a", "integrator": "b", "require": 3},
        },
    ),
    "score_derivatives": (
        ht.score_derivatives,
        {"times": [1], "jacobians": np.eye(6)[None], "top": REST, "start": STILL, "derivatives": "start", "require": 3},
    ),
    "digits_end": (ht.digits_end, {"top": TOP, "start": START, "until": 1}),
    "between_samples": (ht.between_samples, {"top": TOP, "start": START, "until": 1, "spacing": "1/2"}),
    "power": (ht.power, {"top": TOP, "start": START, "until": 1, "tolerance": "1e-3", "step": "1/2"}),
    "drift": (ht.drift, {}),
    "audit": (ht.audit, {"claim": "none"}),
    "run": (ht.run, {"plan": "none", "out": "made", "workers": 1}),
    "hunt": (ht.hunt, {"horizon": 1, "budget": 1, "family": "euler", "seed": 1}),
    "read_survey": (ht.read_survey, {"path": "nowhere"}),
    "read_report": (ht.read_report, {"path": "nowhere"}),
    "compare": (ht.compare, {"baseline": "nowhere", "candidate": "nowhere"}),
    "history": (ht.history, {"reports": ["nowhere", "nowhere"]}),
}
"""Every public function with arguments that it takes; what is not named is its default."""


SLOW = ("hunt", "score", "score_derivatives", "digits_end", "between_samples", "power")


def parameters(function: Callable[..., Any]) -> Iterator[str]:
    """Every argument by name; those of a typed record behind ``**`` one by one."""
    for each in inspect.signature(function).parameters.values():
        if each.kind is each.VAR_KEYWORD:
            (record,) = get_args(get_type_hints(function)[each.name])
            yield from record.__annotations__
        else:
            yield each.name


def answered(function: Callable[..., Any], arguments: dict[str, Any]) -> None:
    try:
        found = function(**arguments)
    except ht.HeavyTopError as refused:
        error = refused
    else:
        assert isinstance(repr(found), str)
        return
    assert 0 < len(error.cause) < 1500
    assert error.remedy, error.cause


def test_the_table_names_every_public_function() -> None:
    functions = {name for name in ht.__all__ if inspect.isfunction(getattr(ht, name))} - {"available", "holding"}
    assert functions | {"HeavyTop", "State", "Body"} == set(GOOD)


def test_an_unknown_option_is_refused_as_python_refuses_it() -> None:
    for call in (lambda: ht.propagate(TOP, START, [1], tol=1), lambda: ht.Integrator(TOP, tol=1)):
        with pytest.raises(TypeError, match="unexpected keyword argument 'tol'"):
            call()
    for angles in (False, True):
        with pytest.raises(TypeError, match="unexpected keyword argument 'stepping'"):
            ht.propagate(TOP, START, [1], angles=angles, stepping=None)
    with pytest.raises(TypeError, match="unexpected keyword argument 'xi'"):
        ht.ensemble([TOP], START, [1], xi=None)


@pytest.mark.slow
@pytest.mark.usefixtures("undiagnosed")
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("name", "argument"),
    [(name, argument) for name, (function, _) in GOOD.items() for argument in parameters(function)],
)
def test_one_odd_argument_is_answered_or_refused_in_words(
    name: str, argument: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    audits.here(monkeypatch)
    function, arguments = GOOD[name]
    # arguments of one kind are checked in one place: each function is asked every fourth value, or fewer where it takes
    # its time, others for each argument
    index, every = list(parameters(function)).index(argument), 24 if name in SLOW or argument == "anew" else 4
    values = ODD[index % every :: every]
    for odd in itertools.chain(values, (make() for make in GENERATORS)):
        if name == "run" and isinstance(odd, str) and odd == "smoke":
            continue  # a plan that is there
        if name == "claim_library" and (odd is None or (isinstance(odd, str) and odd == "heavy_top")):
            continue  # most of it: tests/features/claims/test_library.py
        if argument in ("observer", "reached", "done", "advance", "finder") and callable(odd):
            continue  # what the caller's own function raises is the caller's
        answered(function, arguments | {argument: odd})


@pytest.mark.slow
@pytest.mark.usefixtures("undiagnosed")
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ["HeavyTop", "State", "propagate", "ensemble", "reference", "score", "compare"])
def test_two_odd_arguments_at_once_are_answered_or_refused_in_words(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    random = Random(7)
    function, arguments = GOOD[name]
    for _ in range(60):
        names = [each for each in arguments if each not in ("observer", "reached", "done", "finder")]
        changed = {each: random.choice(ODD) for each in random.sample(names, 2)}
        answered(function, arguments | changed)


NUMBERS = [value for value in ODD if not isinstance(value, list | tuple | dict | set)]


@pytest.mark.slow
@pytest.mark.usefixtures("undiagnosed")
@pytest.mark.filterwarnings("ignore")
def test_one_odd_component_is_answered_or_refused_in_words() -> None:
    for place, odd in enumerate(NUMBERS):
        answered(ht.HeavyTop, {"inertia": (3, odd, 1), "weight": 1, "centre": (0, 0, 1)})
        answered(ht.State, {"omega": (0, 0, 1), "gamma": (0, odd, 1)})
        for name, argument, value in (
            ("propagate", "times", [odd, 2]),
            ("propagate", "xi", [0, odd, 0]),
            ("reference", "times", [1, odd]),
            ("score", "times", [odd]),
            ("score", "states", [[0.1, odd, 0.9, 0.6, 0.0, 0.8]]),
            ("ensemble", "tops", [odd, TOP]),
        ):
            function, arguments = GOOD[name]
            if place % (6 if name in SLOW else 2) == 0:
                answered(function, arguments | {argument: value})


MASKED = np.ma.masked_equal([0.1, 0.4, 0.9, 0.6, 0.0, 0.8], 0.4)


@pytest.mark.parametrize(
    ("call", "cause"),
    [
        (lambda: ht.HeavyTop("321", 1, (0, 0, 0)), "inertia must be a list; got '321'"),
        (lambda: ht.HeavyTop({3, 2, 1}, 1, (0, 0, 0)), "inertia must be a list; got {1, 2, 3}"),
        (lambda: ht.HeavyTop((True, 2, 1), 1, (0, 0, 0)), "inertia: True is not a number"),
        (lambda: ht.HeavyTop((np.True_, 2, 1), 1, (0, 0, 0)), "True_ is not a number"),
        (lambda: ht.real(53.0), "BITS of real:BITS must be an integer; got 53.0"),
        (lambda: ht.real(True), "must be an integer; got True"),
        (lambda: ht.real(10**5000), "must be from 24 to 20000"),
        (lambda: ht.propagate(TOP, START, [1], ht.Precision("double", 99)), "Unknown precision"),
        (lambda: ht.propagate(TOP, START, [1], tolerance="x"), "tolerance: 'x'"),
        (lambda: ht.power(TOP, START, until="x", tolerance="1e-3"), "until: 'x'"),
        (lambda: ht.score([1], [[0] * 6], top=TOP, start=START, require="x"), "require: 'x'"),
        (lambda: ht.reference(TOP, START, [1], 10, effort="x"), "effort: 'x'"),
        (lambda: ht.propagate(TOP, START, [1], tolerance=-1), "to 1; got -1"),
        (lambda: ht.propagate(TOP, START, [1], tolerance=1e-17), "The tolerance in double must be from its eps"),
        (lambda: ht.propagate(TOP, START, [1], tolerance=math.nan), "nan is not a finite number"),
        (lambda: ht.propagate(TOP, START, [1], tolerance="tight"), "'tight' is not a finite number"),
        (lambda: ht.propagate(TOP, START, [1], xi=(1, 0)), "xi must have 3 numbers; got 2"),
        (lambda: ht.propagate(TOP, START, [1], xi=(0, 2, 0)), "|xi|^2 - 1 = 3"),
        (lambda: ht.propagate(TOP, START, [1], xi=(1, 0, 0)), "xi·gamma = 0.6"),
        (lambda: ht.propagate(TOP, START, [1], xi=(0, 1, 0), attitude=False), "xi was given with attitude=False"),
        (lambda: ht.reference(TOP, START, [1], finder=lambda *_: None), "must be an exact solution; got None"),
        (lambda: ht.propagate(TOP, START, [1], step_limit=-1), "step_limit must be at least 1; got -1"),
        (lambda: ht.propagate(TOP, START, [1], observer=3), "observer must be callable; got 3"),
        (lambda: ht.propagate(TOP, START, [1], integrator="splitting:4", step_limit=3), "does not support step_limit"),
        (lambda: ht.propagate(TOP, (0, 0, 1), [1]), "start must be a State; got (0, 0, 1)"),
        (lambda: ht.propagate(TOP, START, "123"), "times must be a list; got '123'"),
        (lambda: ht.propagate(TOP, START, MASKED[:2]), "masked is not a number"),
        (lambda: ht.Integrator(TOP).propagate(MASKED, 1), "start must be a State or an array of numbers"),
        (lambda: ht.Integrator(TOP).propagate(np.ma.array([MASKED] * 2), 1), "start must be a State or an array"),
        (lambda: ht.ensemble([TOP] * 2, [START] * 3, [1]), "equally many; got 2 and 3"),
        (lambda: ht.ensemble([], START, [1]), "No tops were given"),
        (lambda: ht.ensemble(TOP, [], [1]), "No starts were given"),
        (lambda: ht.ensemble(TOP, START, [1], threads=0), "threads must be at least 1; got 0"),
        (lambda: ht.reference(TOP, START, [1], 0), "digits must be from 1 to 20000; got 0"),
        (lambda: ht.reference(TOP, START, []), "No times"),
        (lambda: ht.score([1], np.zeros((1, 9)), top=TOP, start=START), "states[0] has 9 numbers, not 6"),
        (lambda: ht.score([1, 2], np.zeros((1, 6)), top=TOP, start=START), "equally many; got 2 and 1"),
        (lambda: ht.score([1], [[1, 2, 3]], top=TOP, start=START), "states[0] has 3 numbers"),
        (lambda: ht.compare("nowhere", "nowhere"), "contains no report"),
        (lambda: ht.run("smok"), "Unknown plan 'smok'"),
        (lambda: ht.audit("paper"), "Unknown claim 'paper'"),
    ],
)
def test_what_is_wrong_is_said_with_its_value(call: Callable[[], object], cause: str) -> None:
    with pytest.raises(ht.InputError) as caught:
        call()
    assert cause in caught.value.cause
    assert caught.value.remedy
