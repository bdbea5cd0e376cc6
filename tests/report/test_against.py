"""Which of two references is the weaker; they are made here as runs make them."""

import inspect
import pkgutil
from dataclasses import fields, is_dataclass, replace
from fractions import Fraction
from importlib import import_module

import msgspec
import pytest

import heavytop.exact
from heavytop.claims.ershkov import PartialCase
from heavytop.exact.axes import ALL, renamed_state, renamed_top
from heavytop.exact.catalogue import find
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.trajectory import Problem
from heavytop.kinds.claim_model import true_motion
from heavytop.measure.computed_reference import ComputedReference
from heavytop.measure.ensemble_reference import Wider, reference
from heavytop.measure.known import Known, known_motion
from heavytop.precision import DOUBLE, EXTENDED
from heavytop.records import Against
from heavytop.report.against import weaker
from heavytop.suite.cases import CASES
from reports import expand, measure, plan_of

ONE = Fraction(1)


def problem(name: str, precision=DOUBLE) -> Problem:
    case = CASES[name]
    return Problem.of(case.top, case.start, precision, case.system)


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


def test_every_closed_form_is_as_good_as_any_other_under_the_same_certificate(known) -> None:
    names = methods()
    assert len(names) > 12
    assert "validated: Taylor enclosure" in names
    for each in known:
        certificate, against = each.certificate, each.against
        assert against.how == "proven"
        assert Fraction(against.radius) >= Fraction(1, 2**each.bits) > Fraction(against.radius) * Fraction(99, 100)
        (certified,) = against.certificates
        assert (certified.digits, certified.source) == (certificate.agreed_digits, certificate.second_source)
        assert (Fraction(certified.time), certified.proven) == (each.time, certificate.kind)
        for name in names:
            one = replace(each, certificate=replace(certificate, method=name)).against
            assert name in one.text
            assert weaker(against, one) == weaker(one, against) == ""


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
        assert part in weaker(each.against, less.against), less.against
        assert weaker(less.against, each.against) == ""


def test_runs_that_agree_say_their_radius() -> None:
    case = CASES["generic"]
    coarse, fine = (ComputedReference(case.top, case.start, [ONE / 8], bits).against for bits in (100, 160))
    assert (coarse.how, coarse.certificates) == ("computed", ())
    assert 0 < Fraction(fine.radius) < Fraction(1, 10**44) < Fraction(1, 10**32) < Fraction(coarse.radius)
    assert "radius" in weaker(fine, coarse)
    assert weaker(coarse, fine) == ""


def test_the_truth_of_a_claim_is_proven_whichever_it_is() -> None:
    times = [ONE / 8, ONE / 2]
    closed, enclosed = (true_motion(PartialCase(ONE, ONE, ONE / ratio), times)[1] for ratio in (2, 6))
    for against in (closed, enclosed):
        assert against.how == "proven"
        assert [Fraction(each.time) for each in against.certificates] == [ONE / 2]
        assert against.certificates[0].digits >= 45
    assert weaker(closed, enclosed) == weaker(enclosed, closed) == ""


def ensemble(problems: list[Problem], times: list[Fraction], name: str | None) -> Against:
    wider = Wider({}, lambda: None)
    return reference(problems, problems, times, name, propagate_ensemble, wider).against


def test_references_of_ensembles_say_what_they_are_known_to() -> None:
    times = [ONE, Fraction(12)]
    closed = ensemble([problem("lagrange")] * 2, times, None)
    first, every = closed.certificates
    assert (closed.how, first.starts, every.starts, every.of_starts) == ("proven", None, 2, 2)
    assert min(first.digits, every.digits) >= 19
    assert "2 of 2 starts certified" in closed.text
    four = [problem("generic")] * 4
    computed = ensemble(four, times, "extended")
    assert (computed.how, computed.radius, computed.certificates) == ("computed", "", ())
    assert (computed.checked.starts, Fraction(computed.checked.until)) == (4, 12)
    assert Fraction(1, 10**5) < Fraction(computed.checked.part) < Fraction(1, 10)
    assert "starts" in weaker(computed, ensemble(four[:1], times, "extended"))
    assert "earlier" in weaker(computed, ensemble(four, times[:1], "extended"))
    worse = msgspec.structs.replace(computed, checked=msgspec.structs.replace(computed.checked, part="1"))
    assert "error of the computed reference" in weaker(computed, worse)
    # what was not fit to score with is no reference, whatever is said of it
    unfit, none = ensemble([problem("generic", EXTENDED)], times, "extended"), ensemble(four, times, None)
    assert "of the error measured" in unfit.text
    assert unfit.how == none.how == "none"
    assert weaker(unfit, none) == weaker(none, unfit) == ""


PLAN = {
    "name": "tiny",
    "measure": [
        {"kind": "drift", "cases": ["generic"], "runs": [{"precision": "double", "horizon": "101", "samples": 2}]},
        {"kind": "local_error", "cases": ["euler"], "precisions": ["double"], "horizon": "1"},
        {"kind": "claim_evaluation", "cases": ["ershkov-partial-2"], "precisions": ["double"], "rate_times": ["1"]},
    ],
}


def test_the_other_rows_say_what_they_are_compared_with() -> None:
    drift, steps, *formulas = (measure(task).reference for task in expand(plan_of(PLAN)))
    assert [each.how for each in (drift, steps, *formulas)] == ["none"] + ["proven"] * (1 + len(formulas))
    for other in (steps, *formulas):
        assert weaker(drift, other)
        assert weaker(other, drift)
    assert "proven" in weaker(steps, msgspec.structs.replace(steps, how="computed"))
    assert weaker(Against("equations", "those of one"), Against("equations", "those of another"))
