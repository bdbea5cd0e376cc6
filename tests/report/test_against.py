"""What a comparison reads in ``against`` is what the code that writes the sentence knows: they are made here by it."""

import inspect
import math
import pkgutil
from dataclasses import fields, is_dataclass, replace
from fractions import Fraction
from importlib import import_module
from itertools import permutations

import msgspec
import pytest

import heavytop.exact
from heavytop.claims.ershkov import PartialCase
from heavytop.exact.axes import ALL, renamed_state, renamed_top
from heavytop.exact.catalogue import find
from heavytop.integrate.trajectory import Problem
from heavytop.measure.computed_reference import ComputedReference
from heavytop.measure.known import Known, known_motion
from heavytop.precision import DOUBLE, EXTENDED
from heavytop.report.against import Against, weaker
from heavytop.suite.cases import CASES
from heavytop.suite.measurements import measure
from heavytop.suite.measurements.claimed import true_motion
from heavytop.suite.measurements.ensemble_reference import Wider, reference
from heavytop.suite.plan import Plan, expand

ONE = Fraction(1)
OWN = Against("its own first integrals", False, None, None, (), (), None)


def problem(name: str, precision=DOUBLE) -> Problem:
    case = CASES[name]
    return Problem.of(case.top, case.start, precision, case.system)


def log(value: float) -> float:
    return math.log10(abs(value))


def said(known: Known) -> Against:
    """What the text of a known motion says, worked out from its fields."""
    certificate = known.certificate
    proven, radius = certificate.kind != "computed", -known.bits * math.log10(2)
    return Against("known", proven, radius, None, (certificate.agreed_digits,), (log(known.time),), None)


def same(read: Against, known: Against) -> bool:
    numbers = ((read.radius, known.radius), (read.part, known.part), *zip(read.times, known.times, strict=True))
    # a radius is written to three digits, rounded up
    close = all(a == b or (a is not None and b is not None and abs(a - b) < 5e-3) for a, b in numbers)
    none = {"radius": None, "part": None, "times": ()}
    return close and replace(read, **none) == replace(known, **none)


@pytest.fixture(scope="module")
def known() -> list[Known]:
    """One of each kind of certificate: at the time itself, at both ends, an enclosure's own; both directions."""
    asked = [("lagrange", ONE), ("euler", Fraction(-1, 3)), ("euler", Fraction(10**6)), ("generic", ONE)]
    found = [known_motion(problem(name), time) for name, time in asked]
    assert all(isinstance(each, Known) for each in found)
    assert {each.certificate.kind for each in found} == {"proven", "proven at both ends"}
    return found


def methods() -> set[str]:
    """The names of every closed form and enclosure in exact/, and those of a top whose axes have other names."""
    modules = [
        import_module(module.name) for module in pkgutil.iter_modules(heavytop.exact.__path__, "heavytop.exact.")
    ]
    classes = [each for module in modules for _, each in inspect.getmembers(module, inspect.isclass)]
    defaults = [f.default for each in classes if is_dataclass(each) for f in fields(each) if f.name == "method"]
    names = {name for name in [*defaults, *(vars(each).get("method") for each in classes)] if isinstance(name, str)}
    top, start = CASES["lagrange"].top, CASES["lagrange"].start
    renamed = {find(renamed_top(top, axes), renamed_state(start, axes)).method for axes in ALL[:3]}
    assert any("axes" in name for name in renamed)
    return names | renamed


def test_every_closed_form_under_every_certificate_is_read_as_it_is(known) -> None:
    names = methods()
    assert len(names) > 12
    assert "validated: Taylor enclosure" in names
    for each in known:
        for name in names:
            one = replace(each, certificate=replace(each.certificate, method=name))
            assert same(Against.of(one.text), said(one)), one.text
            assert weaker(each.text, one.text) == ""


def certified_otherwise(known: Known, **change) -> Known:
    return replace(known, certificate=replace(known.certificate, **change))


@pytest.mark.parametrize(
    ("part", "change"),
    [
        ("digits", lambda k: certified_otherwise(k, agreed_digits=k.certificate.agreed_digits * 3 // 4)),
        ("digits", lambda k: certified_otherwise(k, agreed_digits=0)),
        ("proven", lambda k: certified_otherwise(k, kind="computed")),
        ("time", lambda k: replace(k, time=k.time / 3)),
        ("time", lambda k: replace(k, time=Fraction(1, 10**200))),
        ("radius", lambda k: replace(k, bits=k.bits - 4)),
    ],
)
def test_a_known_motion_that_is_known_to_less_is_weaker(known, part: str, change) -> None:
    for each in known:
        less = change(each)
        assert part in weaker(each.text, less.text), less.text
        assert weaker(less.text, each.text) == ""


def test_runs_that_agree_are_read_with_their_radius() -> None:
    case = CASES["generic"]
    texts = [ComputedReference(case.top, case.start, [ONE / 8], bits).method for bits in (100, 160)]
    coarse, fine = map(Against.of, texts)
    assert (coarse.kind, coarse.proven, coarse.digits, coarse.times) == ("computed", False, (), ())
    assert -50 < fine.radius < -44 < -32 < coarse.radius < -26
    assert "radius" in weaker(texts[1], texts[0])
    assert weaker(*texts) == ""


def test_the_truth_of_a_claim_is_read_whichever_it_is() -> None:
    times = [ONE / 8, ONE / 2]
    closed, enclosed = (true_motion(PartialCase(ONE, ONE, ONE / ratio), times)[1] for ratio in (2, 6))
    for text in (closed, enclosed):
        read = Against.of(text)
        assert (read.kind, read.proven) == ("known", True)
        assert read.times == pytest.approx((log(1 / 2),), abs=1e-5)
        assert read.digits[0] >= 45
        assert read.radius == pytest.approx(-160 * math.log10(2), abs=5e-3)
    assert weaker(closed, enclosed) == weaker(enclosed, closed) == ""


def ensemble(problems: list[Problem], times: list[Fraction], name: str | None) -> str:
    return reference(problems, problems, times, name, {}, Wider({}, lambda: None)).text


def test_references_of_ensembles_are_read_as_they_are() -> None:
    times = [ONE, Fraction(12)]
    closed = ensemble([problem("lagrange")] * 2, times, None)
    read = Against.of(closed)
    assert (read.kind, read.proven, read.starts) == ("known", True, 2)
    assert len(read.digits) == len(read.times) == 2
    assert min(read.digits) >= 19
    four = [problem("generic")] * 4
    computed = ensemble(four, times, "extended")
    read = Against.of(computed)
    assert (read.kind, read.proven, read.radius, read.digits, read.starts) == ("computed", False, None, (), 4)
    assert read.times == pytest.approx((log(12),), abs=1e-3)
    assert -5 < read.part < -1
    assert "starts" in weaker(computed, ensemble(four[:1], times, "extended"))
    assert "earlier" in weaker(computed, ensemble(four, times[:1], "extended"))
    # what was not fit to score with is no reference, whatever is said of it
    unfit = ensemble([problem("generic", EXTENDED)], times, "extended")
    assert "of the error measured" in unfit
    assert Against.of(unfit) == Against.of(ensemble(four, times, None)) == OWN


PLAN = {
    "name": "tiny",
    "measure": [
        {"kind": "drift", "cases": ["generic"], "runs": [{"precision": "double", "horizon": "101", "samples": 2}]},
        {"kind": "local_error", "cases": ["euler"], "precisions": ["double"], "horizon": "1"},
        {"kind": "claim_evaluation", "cases": ["ershkov-partial-2"], "precisions": ["double"], "rate_times": ["1"]},
    ],
}


def test_the_other_rows_say_what_they_are_compared_with() -> None:
    drift, steps, *formulas = (measure(task).against for task in expand(msgspec.convert(PLAN, Plan)))
    assert Against.of(drift) == OWN
    assert Against.of(steps) == Against("known", True, None, None, (), (), None)
    texts = [drift, steps, *formulas]
    for one, other in permutations(texts, 2):
        assert bool(weaker(one, other)) is (one != other)
    assert "proven" in weaker(steps, "known: by somebody")
