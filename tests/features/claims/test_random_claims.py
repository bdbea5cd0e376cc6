"""Claims at random against an evaluation of their own: no false ``holds``, no false ``refuted``, few left undecided.

A few of each; hundreds are in `validation/random_claims.py`.
"""

import random

import pytest

import claim_traps
import random_claims


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "count"), [("integral_claim", 8), ("motion_claim", 2), ("elliptic_claim", 1), ("gyrostat_claim", 4)]
)
def test_no_verdict_is_false_and_what_is_true_by_construction_holds(kind, count, monkeypatch):
    monkeypatch.setattr(random_claims, "random_claim", getattr(random_claims, kind))
    found = list(random_claims.outcomes(count, 4, 3))
    assert [(o.fault, o.claim.table) for o in found if o.fault] == []
    true = [o for o in found if o.claim.truth == "true"]
    missed = [o.claim.table for o in true if o.verdict != "holds"]
    assert len(true) > count / 4
    # one of twenty, and one of fewer than that
    assert len(missed) <= max(1, len(true) / 20), missed


@pytest.mark.slow
def test_no_family_of_traps_gets_a_false_verdict():
    found = list(random_claims.trap_outcomes(14, 4))
    assert [(o.fault, o.reason, o.claim.table) for o in found if o.fault] == []
    assert len({o.claim.family for o in found}) == 14
    refused = [o for o in found if o.claim.truth == "refused"]
    assert [o.claim.table for o in refused if not o.verdict.startswith(("refused", "undecided"))] == []


@pytest.mark.slow
def test_numbers_contradict_what_the_flow_leaves_or_changes():
    """The check that the verdicts are held to, on claims that are false and on their true neighbours."""
    draw = random.Random(1)
    free = {"inertia": ["2", "3", "4"], "centre": ["0", "0", "0"]}
    square = "4*Omega1^2 + 9*Omega2^2 + 16*Omega3^2"
    for value, where, wrong in (
        ("Omega1", ["Omega2"], "condition is left"),
        (square, [], ""),
        (f"{square} + 1e-2*Omega1", [], "value changes"),
        (f"{square} + 0*sqrt(Omega1)", [], "no value"),
    ):
        told = claim_traps.contradiction(claim_traps._integral(value, where, **free), "heavy_top", draw)
        assert wrong in told if wrong else not told
    plane = {"inertia": ["2", "3", "4"], "centre": ["0", "0", "1"]}
    half = ["Omega2", "Omega3", "gamma1", "sqrt(Omega1^2) - Omega1"]
    assert not claim_traps.contradiction(claim_traps._integral("1", half[:3], **plane), "heavy_top", draw)
    assert claim_traps.contradiction(claim_traps._integral("1", half, **plane), "heavy_top", draw)


def test_the_evaluation_of_its_own_sees_a_mistake_and_what_is_not_real():
    draw = random.Random(5)
    claim = next(c for c in iter(lambda: random_claims.motion_claim(draw), None) if c.truth == "true")
    assert random_claims.passes(claim, 6, draw)
    claim.table["motion"]["omega"][0] += " + 1e-9*t"
    assert random_claims.passes(claim, 6, draw) is False
    claim.table["motion"]["omega"][0] += " + 0*sqrt(-1 - t^2)"
    assert random_claims.passes(claim, 6, draw) is None
