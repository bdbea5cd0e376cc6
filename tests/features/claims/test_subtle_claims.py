"""Some of the claims of validation/subtle_claims.jsonl: what is not true never holds, what is true is never refuted."""

import json
from pathlib import Path

import pytest

from heavytop.errors import InputError
from heavytop.features.claims.audit.audit import audit_claim, claim_from_table

LINES = (Path(__file__).parents[3] / "validation" / "subtle_claims.jsonl").read_text("utf-8").splitlines()
CLAIMS = [json.loads(line) for line in LINES]
QUICK = CLAIMS[::23]


@pytest.mark.slow
@pytest.mark.parametrize("claim", QUICK, ids=[claim["label"] for claim in QUICK])
def test_what_is_not_true_never_holds_and_what_is_true_is_never_refuted(claim):
    try:
        verdict = audit_claim(claim_from_table({"name": "subtle"} | claim["table"], "subtle")).verdict
    except InputError:
        verdict = "refused"
    wrong = {"true": {"refuted", "refused"}, "false": {"holds"}, "open": {"holds"}}
    assert verdict not in wrong[claim["truth"]]


def test_there_are_enough_of_each_truth():
    truths = [claim["truth"] for claim in CLAIMS]
    assert min(truths.count(truth) for truth in ("true", "false", "open")) > 60
    assert len({claim["label"] for claim in CLAIMS}) == len(CLAIMS)
