"""Whatever a table of a plan asks is part of what is compared: reports of two requests are incomparable."""

from __future__ import annotations

from functools import cache
from typing import Any

import msgspec
import pytest

from heavytop.features.drift.kind import DriftRun
from heavytop.features.growth.kind import GrowthRun
from heavytop.features.kinds import KINDS
from heavytop.features.survey.gathered import gathered
from heavytop.features.work_precision.kind import Curve
from heavytop.harness.sweeps import Random, SweepGrid
from heavytop.records import SCHEMA, Against, Report
from heavytop.report.compare.noise import Policy
from support.reports import compare, expand, measure, plan_of

CHANGES_NOTHING = {("survey", "map"), ("work_precision", "timings")}
"""What is drawn of the same motions, and how often they are run."""
RANDOM = {"kind": "random", "name": "tops", "seed": 1, "count": 3, "family": "any"}
GRID = {
    "kind": "grid",
    "name": "tops",
    "inertia": [["3", "2", "1.5"], ["2", "2", "1"]],
    "weight": "1",
    "centre": ["0", "0", "1"],
    "omega": ["1", "0", "2"],
    "gamma": ["0", "0", "1"],
    "rotor": None,
    "system": "heavy_top",
}
DRIFT = {"precision": "double", "horizon": "2", "samples": 4}
GROWTH = {"precision": "double", "horizon": "10", "starts": 6, "samples": 4, "decades": 2}
CLAIM = {"cases": ["ershkov-partial-2"], "directions": ["forward"]}
CURVE = {"integrator": "heyoka", "precision": "double", "tolerances": ["1e-9"], "steps": []}
BASES: dict[str, dict[str, Any]] = {
    "audit": {"claims": ["ershkov-partial"], "systems": ["gyrostat"]},
    "claim_evaluation": CLAIM | {"precisions": ["double"], "rate_times": ["1", "2", "4"]},
    "claim_model": CLAIM | {"times": ["1", "2"], "grid": 4},
    "drift": {"cases": ["euler"], "runs": [DRIFT], "noise": False},
    "growth": {"cases": ["euler"], "runs": [GROWTH]},
    "homoclinic": CLAIM | {"precisions": ["double"], "samples": 2},
    "hunt": {"horizon": "1", "budget": 1, "limit": "1"},
    "local_error": {"cases": ["euler"], "precisions": ["double"], "horizon": "1"},
    "survey": {"cases": ["sweep:tops"], "horizon": "2", "samples": 2, "sweep": RANDOM},
    "work_precision": {"cases": ["euler"], "horizon": "2", "ladders": [CURVE], "samples": 4},
}
"""Of each kind a table; what is not named is its default."""
CHANGES: dict[str, list[dict[str, Any]]] = {
    "audit": [{"claims": ["ershkov-general"]}, {"systems": ["heavy_top"]}],
    "claim_evaluation": [
        *({"cases": ["ershkov-partial-6"]}, {"precisions": ["quad"]}),
        *({"rate_times": ["1", "3", "4"]}, {"directions": ["backward"]}),
    ],
    "claim_model": [
        *({"cases": ["ershkov-partial-6"]}, {"times": ["1.5", "2"]}, {"grid": 8}, {"directions": ["backward"]}),
    ],
    "drift": [
        *({"cases": ["lagrange"]}, {"integrator": "multiword"}, {"attitude": True}, {"noise": True}),
        *({"runs": [DRIFT | {key: value}]} for key, value in (("precision", "extended"), ("horizon", "3"))),
        *({"runs": [DRIFT | {"samples": 8}]}, {"integrator": "splitting:2", "step": "1/50"}),
    ],
    "growth": [
        *({"cases": ["lagrange"]}, {"integrator": "multiword"}),
        *(
            {"runs": [GROWTH | {key: value}]}
            for key, value in {
                **{"precision": "extended", "horizon": "11", "starts": 7, "seed": 2, "samples": 8, "decades": 3},
                **{"tolerance": "1e-9", "high_accuracy": True, "bias": "1e-9", "reference": "quad", "attitude": True},
            }.items()
        ),
    ],
    "homoclinic": [
        *({"cases": ["delone"]}, {"precisions": ["extended"]}, {"samples": 4}, {"directions": ["backward"]}),
        {"integrator": "multiword"},
    ],
    "hunt": [
        *({"integrator": "multiword"}, {"precision": "extended"}, {"horizon": "2"}, {"budget": 2}),
        *({"family": "euler"}, {"against": "multiword"}, {"limit": "2"}, {"limit": ""}, {"seed": 2}),
        {"found": "tops.toml"},
    ],
    "local_error": [
        *({"cases": ["lagrange"]}, {"precisions": ["extended"]}, {"horizon": "2"}, {"integrator": "multiword"}),
    ],
    "survey": [
        *({"horizon": "3"}, {"precision": "extended"}, {"samples": 4}, {"integrator": "multiword"}),
        *({"tolerance": "1e-9"}, {"map": ["omega1", "omega2"]}),
        *({"sweep": RANDOM | {key: value}} for key, value in (("seed", 2), ("count", 4), ("family", "euler"))),
        {"cases": ["sweep:others"], "sweep": RANDOM | {"name": "others"}},
    ],
    "work_precision": [
        *({"cases": ["lagrange"]}, {"horizon": "3"}, {"samples": 8}, {"timings": True}, {"attitude": True}),
        *({"ladders": [CURVE | {key: value}]} for key, value in (("precision", "extended"), ("tolerances", ["1e-8"]))),
        *({"ladders": [CURVE | {"integrator": name}]} for name in ("multiword", "heyoka:constants")),
        {"ladders": [CURVE | {"tolerances": [], "steps": ["1/50"], "integrator": "splitting:2"}]},
    ],
}
ALL = [(kind, change) for kind, changes in CHANGES.items() for change in changes]


def report(kind: str, table: dict[str, Any]) -> Report:
    document = {"name": "requests", "measure": [{"kind": kind} | {k: v for k, v in table.items() if k != "sweep"}]}
    tasks = expand(plan_of(document | ({"sweep": [table["sweep"]]} if "sweep" in table else {})))
    rows = [measure(task) for task in tasks]
    if kind == "survey":
        rows = gathered(zip(tasks, rows, strict=True))
    return Report(SCHEMA, {"name": "requests"}, {}, rows)


@cache
def base(kind: str) -> Report:
    return report(kind, BASES[kind])


@pytest.fixture(autouse=True)
def _no_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hunt that finds nothing and audits of one equation: the request is what is looked at."""
    from heavytop.features.claims.audit import judge as audits
    from heavytop.features.hunt import kind as hunt
    from heavytop.features.hunt.search import Hunted

    judge = audits.judge
    monkeypatch.setattr(audits, "judge", lambda statements, setting: judge(statements[:1], setting))
    monkeypatch.setattr(hunt, "kept", lambda path: [])
    monkeypatch.setattr(hunt, "hunt", lambda asked: Hunted(asked, (), (), 1, 1, 1.0, 1e-15, 0, 0))


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "change"), ALL, ids=lambda value: str(value)[:60])
def test_another_request_is_incomparable(kind: str, change: dict[str, Any]) -> None:
    """Both ways round; unless the key is one that changes nothing."""
    other = report(kind, BASES[kind] | change)
    verdicts = {compare(*pair, Policy()).verdict for pair in ((base(kind), other), (other, base(kind)))}
    nothing = all((kind, key) in CHANGES_NOTHING for key in change)
    assert verdicts == ({"same"} if nothing else {"incomparable"})


@pytest.mark.slow
@pytest.mark.parametrize("kind", BASES)
def test_the_same_request_is_compared(kind: str) -> None:
    assert compare(base(kind), report(kind, BASES[kind]), Policy()).verdict == "same"


def test_every_key_of_every_table_is_changed() -> None:
    assert BASES.keys() == {kind.name for kind in KINDS.values() if kind.table is not None}
    for kind, changes in CHANGES.items():
        table = KINDS[kind].table
        assert table is not None
        assert set(table.__struct_encode_fields__) == {key for change in changes for key in change} - {"sweep"}
    for record, kind, key, base_of in ((DriftRun, "drift", "runs", DRIFT), (GrowthRun, "growth", "runs", GROWTH)):
        changed = {name for each in CHANGES[kind] for run in each.get(key, []) for name in run if run != base_of}
        assert changed == set(record.__struct_encode_fields__)
    assert CURVE.keys() == set(Curve.__struct_encode_fields__)


GRIDS = {
    "inertia": [["3", "2", "1.5"], ["2", "2", "1.25"]],
    "weight": "2",
    "centre": ["0", "0", "1/2"],
    "omega": ["1", "0", "3"],
    "gamma": ["0", "0", "-1"],
    "rotor": ["0", "0", "1"],
}


@pytest.mark.parametrize("key", GRIDS)
def test_a_sweep_with_other_data_is_another_one(key: str) -> None:
    one, other = (msgspec.convert(table, SweepGrid) for table in (GRID, GRID | {key: GRIDS[key]}))
    assert one.exact_data != other.exact_data


def test_the_same_data_written_otherwise_are_the_same() -> None:
    other = GRID | {"inertia": [["3.0", "4/2", "3/2"], ["2", "2", "1"]], "name": "others", "system": None}
    assert msgspec.convert(GRID, SweepGrid).exact_data == msgspec.convert(other, SweepGrid).exact_data
    assert "3 random tops" in msgspec.convert(RANDOM, Random).exact_data


@pytest.mark.slow
def test_a_candidate_that_no_longer_says_its_request_is_incomparable() -> None:
    """And a baseline of before that rows said it is compared, unless its request is all that says which tops it has."""
    for kind in ("drift", "survey"):
        silent = [msgspec.structs.replace(row, request=msgspec.UNSET) for row in base(kind).rows]
        without = msgspec.structs.replace(base(kind), rows=silent)
        silenced = compare(base(kind), without, Policy())
        assert silenced.verdict == "incomparable"
        assert all("the candidate does not state its request" in finding.reason for finding in silenced.changed)
        assert compare(without, base(kind), Policy()).verdict == ("same" if kind == "drift" else "incomparable")


def test_a_failed_hunt_without_its_limit_is_no_better() -> None:
    """A limit that is taken out makes a success of a failure."""
    found = {"outcome": "failed", "metrics": {}, "against": "", "reference": Against("none", reason="found")}
    failed = [msgspec.structs.replace(row, **found) for row in base("hunt").rows]
    before = msgspec.structs.replace(base("hunt"), rows=failed)
    assert compare(before, report("hunt", BASES["hunt"] | {"limit": ""}), Policy()).verdict == "incomparable"
