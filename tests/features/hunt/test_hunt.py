"""Planted faults are found, shrunk and proven; a healthy integrator has none."""

import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

import heavytop as ht
from heavytop.errors import InputError
from heavytop.features.hunt.measured import FAMILIES, MOST_TURNS, Meter, drawn, possible
from heavytop.features.hunt.search import digits, keep, kept
from heavytop.features.kinds import KINDS
from heavytop.harness.checkpoint import Saved
from heavytop.integrate.registry import INTEGRATORS, Integrator, described
from heavytop.precision import exact
from heavytop.report.store.checks import check_rows
from heavytop.top.amplification import amplification
from heavytop.top.equations import HEAVY_TOP
from support.in_process import heavytop
from support.reports import tasks_of
from support.small_reports import row

NUMBERS = ("inertia", "centre", "omega", "gamma")


def numbers(found: dict[str, object]) -> list[Fraction]:
    return [exact(text) for key in NUMBERS for text in found[key]] + [exact(found["weight"])]  # type: ignore[attr-defined]


def hunted(fault: str, monkeypatch: pytest.MonkeyPatch, **options: object) -> ht.Hunt:
    """A hunt of a fault of validation/hunts.py, in this process: one of its own takes seconds to begin."""
    planted = Integrator(f"planted:{fault}", f"hunts:{fault}")
    monkeypatch.setitem(INTEGRATORS, planted.name, planted)
    return ht.hunt(planted.name, **options)


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["branch", "rest"])
def test_a_planted_fault_is_found_and_shrunk(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    hunt = hunted(fault, monkeypatch, budget=128, horizon=2)
    assert hunt.found
    worst = hunt.found[0]
    assert max(map(digits, numbers(worst))) <= 3
    assert max(len(part) for v in numbers(worst) for part in str(v).lstrip("-").split("/")) <= 3
    if fault == "branch":
        assert exact(worst["omega"][2]) < 0
        assert exact(worst["gamma"][0]) > Fraction(9, 10)
        assert hunt.hunted.proofs[0].proven
        assert worst["ratio"] > 1e10
    else:
        assert worst["outcome"] == "failed"
    assert worst["toml"].startswith("[[top]]\n")
    assert "Features: " in str(hunt)


@pytest.mark.slow
def test_changes_of_the_worst_motions_find_what_random_ones_rarely_meet(monkeypatch: pytest.MonkeyPatch) -> None:
    assert hunted("corner", monkeypatch, budget=512, horizon=1).found


@pytest.mark.slow
def test_a_fault_of_heavy_gyrostats_is_found_shrunk_and_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    hunt = hunted("rotor", monkeypatch, budget=10, horizon=1, family="heavy_gyrostat")
    worst = hunt.found[0]
    assert worst["system"] == "heavy_gyrostat"
    assert max(map(digits, [*numbers(worst), *map(exact, worst["rotor"])])) <= 3
    assert exact(worst["rotor"][2]) < 0
    assert exact(worst["omega"][0]) < 0
    assert "--rotor" in worst["command"]
    assert hunt.hunted.proofs[0].proven
    keep(tmp_path / "found.toml", [m.motion for m in hunt.hunted.found])
    assert kept(tmp_path / "found.toml") == tuple(m.motion for m in hunt.hunted.found)
    assert not ht.hunt(budget=8, horizon=1, family="heavy_gyrostat").found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("integrator", "horizon", "law"),
    [("heyoka", 4, "eps A √(1 + rate T)"), ("splitting:4", 20, "(rate h)^order"), ("splitting:4", "1e-60", "eps T/h")],
)
def test_a_healthy_integrator_has_none_and_says_what_explains_its_worst(integrator, horizon, law: str) -> None:
    hunt = ht.hunt(integrator, budget=96, horizon=horizon, seed=3)
    assert (hunt.found, hunt.motions, hunt.seed) == ([], 96, 3)
    assert "Nothing found" in str(hunt)
    assert law in str(hunt)
    assert "--budget 96 --seed 3" in str(hunt)


@pytest.mark.slow
def test_the_command_line_prints_the_document_and_ends_with_1_where_anything_is_found() -> None:
    done = heavytop("hunt", "--limit", "1e-6", "--budget", 2, "--horizon", 1, "--family", "euler", "--json")
    document = json.loads(done.stdout)
    assert done.returncode == 1
    assert set(document) == {"found", "motions", "seed"}
    keys = "inertia weight centre omega gamma system digits_lost ratio outcome class command toml"
    assert list(document["found"][0]) == keys.split()


@pytest.mark.slow
@pytest.mark.parametrize(
    "wrong",
    [
        *(f"--budget {budget}" for budget in ("0", "nan", "-5s")),
        *("--horizon 0", "--horizon inf", "--limit -1", "--seed -1", "--family hess", "--integrator nobody"),
        *("--against nobody", "--against heyoka", "--precision double-double"),
    ],
)
def test_what_is_no_hunt_is_refused(wrong: str) -> None:
    done = heavytop("hunt", *wrong.split())
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_draws_are_bodies_of_their_family_and_depend_on_seed_and_index_alone() -> None:
    for family in FAMILIES:
        for index in range(1, 120, 7):
            motion = drawn(5, index, family, Fraction(100))
            assert motion == drawn(5, index, family, Fraction(100))
            assert possible(motion, family, Fraction(100)) is not None
            assert not motion[0].warnings()
            assert sum(g * g for g in motion[1].gamma) == 1
            assert 100 * max(map(abs, motion[1].omega)) <= MOST_TURNS


@pytest.mark.slow
def test_error_and_amplification_are_those_of_the_scorer_and_the_variational_equation() -> None:
    meter = Meter(described("heyoka"), ht.DOUBLE, Fraction(10), None)
    motions = [drawn(1, index, "any", Fraction(10)) for index in (0, 2, 4)]
    for found in meter.measure(motions):
        top, start = found.motion
        states = ht.propagate(top, start, meter.times).states
        scored = ht.score(meter.times, states, top=top, start=start)
        worst = float(scored.distance["gamma"].max)
        assert worst / 2 < found.error < 20 * worst
        parameters = HEAVY_TOP.parameters(top, start)
        whole = amplification(HEAVY_TOP, parameters, start.flat, Fraction(10))
        assert whole / 10 < found.amplification < whole * 3


def test_a_row_without_its_largest_error_is_refused() -> None:
    empty = row(measure="hunt", metrics={})
    with pytest.raises(InputError, match="a row of hunt without hunt_error_relative_to_law_max"):
        check_rows(Path("report.json"), [empty], KINDS)


@pytest.mark.slow
def test_what_a_plan_finds_is_kept_and_measured_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    table = 'kind = "hunt"\nhorizon = "1"\nbudget = 2\nfamily = "euler"\nlimit = "1e-9"\nfound = "found.toml"'
    (task,) = tasks_of(tmp_path, f"[[measure]]\n{table}\n")
    row = KINDS["hunt"].measure(task, Saved())
    assert row.outcome == "failed"
    assert "heavytop propagate" in row.against
    first = Path("found.toml").read_text()
    assert first.count("[[top]]") >= 1
    assert KINDS["hunt"].measure(task, Saved()).outcome == "failed"
    assert Path("found.toml").read_text().startswith(first)


@pytest.mark.slow
def test_what_is_rounded_on_the_way_may_grow_by_more_than_what_is_rounded_at_the_start() -> None:
    # a hunt of heyoka once found this motion, near the separatrix of a pendulum, and blamed heyoka
    top = ht.HeavyTop(("199/1000000000", "239/1000000000", "134337/1000000000000"), 56, ("7/10000000", 0, 0))
    start = ht.State(("1/50", 0, "-3/100"), (0, 0, 1))
    meter = Meter(described("heyoka"), ht.DOUBLE, Fraction(3), None)
    (found,) = meter.measure([(top, start)])
    assert meter.sharper(found).amplification > 2 * found.amplification
    assert found.error < 100 * meter.sharper(found).explained(2.0**-52)
    assert replace(found, order=1000, turns=2e4, steps=1.0).explained(2.0**-52) > 1e200


@pytest.mark.slow
def test_the_same_seed_searches_the_same() -> None:
    one, two = (ht.hunt(budget=24, horizon=2, seed=9).hunted.worst for _ in range(2))
    assert [(m.motion, m.error) for m in one] == [(m.motion, m.error) for m in two]
