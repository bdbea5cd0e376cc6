"""Which of two references is the weaker; they are made here as runs make them."""

import inspect
import pkgutil
from dataclasses import fields, is_dataclass, replace
from fractions import Fraction
from importlib import import_module

import msgspec
import pytest

import heavytop.exact
from heavytop.cases import CASES
from heavytop.exact.catalogue import find
from heavytop.exact.closed_form import ALL, renamed_state, renamed_top
from heavytop.features.claims.kinds.claim_model import true_motion
from heavytop.features.claims.library.ershkov import PartialCase
from heavytop.integrate.trajectory import Problem
from heavytop.measure.truth import Known, known_motion, of_rounded, reference
from heavytop.precision import DOUBLE
from heavytop.records import Against
from heavytop.report.compare.verdicts import weaker
from support.reports import expand, measure, plan_of

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


def test_a_certificate_less_is_weaker(known) -> None:
    one = known[0].against
    both = msgspec.structs.replace(one, certificates=one.certificates * 2)
    for fewer in (one, msgspec.structs.replace(one, certificates=())):
        assert weaker(both, fewer)
        assert not weaker(fewer, both)


@pytest.mark.slow
def test_runs_that_agree_say_their_radius() -> None:
    coarse, fine = (of_rounded([problem("generic")], [ONE / 8], bits)[0].against for bits in (100, 160))
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


@pytest.mark.slow
def test_references_of_ensembles_say_what_they_are_known_to() -> None:
    times = (ONE, Fraction(12))
    closed = reference((problem("lagrange"),) * 2, times).against
    first, every = closed.certificates
    assert (closed.how, first.starts, every.starts, every.of_starts) == ("proven", None, 2, 2)
    assert min(first.digits, every.digits) >= 19
    assert "2 of 2 starts certified" in closed.text
    four = (problem("generic"),) * 4
    found = reference(four, times)
    computed = found.against
    assert (computed.how, computed.certificates, found.samples) == ("computed", (), 2)
    assert "words of 106 and 138 bits agree within" in computed.text
    assert 0 < max(map(max, found.blur)) < 1e-20
    assert weaker(closed, computed) == "different references: a proven reference → a computed reference"
    worse = msgspec.structs.replace(computed, radius="1e-10")
    assert "radius" in weaker(computed, worse)


def test_a_truth_that_ends_earlier_is_weaker() -> None:
    whole, late, early = (Against("computed", "words", "1e-9", until=until) for until in ("", "400", "-150"))
    for old, new in ((whole, late), (whole, early), (late, early)):
        assert weaker(old, new) == "the reference is valid until an earlier time"
        assert weaker(new, old) == ""
    assert weaker(late, msgspec.structs.replace(late, until="300")) == ""


PLAN = {
    "name": "tiny",
    "measure": [
        {"kind": "drift", "cases": ["generic"], "runs": [{"precision": "double", "horizon": "1e4", "samples": 2}]},
        {"kind": "local_error", "cases": ["euler"], "precisions": ["double"], "horizon": "1"},
        {"kind": "claim_evaluation", "cases": ["ershkov-partial-2"], "precisions": ["double"], "rate_times": ["1"]},
    ],
}


@pytest.mark.slow
def test_the_other_rows_say_what_they_are_compared_with() -> None:
    drift, steps, *formulas = (measure(task).reference for task in expand(plan_of(PLAN)))
    assert [each.how for each in (drift, steps, *formulas)] == ["none"] + ["proven"] * (1 + len(formulas))
    for other in (steps, *formulas):
        assert weaker(drift, other)
        assert weaker(other, drift)
    assert "proven" in weaker(steps, msgspec.structs.replace(steps, how="computed"))
    assert weaker(Against("equations", "those of one"), Against("equations", "those of another"))
