"""A survey: the records equal what the scorer says of each motion alone, and the file its row of the report."""

import json
import math
from fractions import Fraction
from functools import reduce
from itertools import chain
from pathlib import Path
from random import Random as Dice

import numpy
import pytest

import heavytop as ht
from heavytop.errors import Contradiction, InputError
from heavytop.features.kinds import KINDS
from heavytop.features.survey import joined as comparing
from heavytop.features.survey import measured as records
from heavytop.features.survey.gathered import gathered, read_chunk
from heavytop.features.survey.measured import chunks, drawn
from heavytop.harness.checkpoint import Saved
from heavytop.harness.plan import read
from heavytop.harness.rows import failed
from heavytop.harness.sweeps import Random, SweepGrid
from heavytop.integrate.ensemble import propagate_ensemble
from heavytop.integrate.registry import described
from heavytop.integrate.trajectory import Problem
from heavytop.measure.scorer import Scorer
from heavytop.measure.truth import truth
from heavytop.multiword.pairs import Pairs
from heavytop.precision import DOUBLE, exact
from heavytop.records import SCHEMA, Row
from heavytop.report.compare.noise import Policy
from support.in_process import heavytop
from support.reports import asked, compare, plan_file, table

pytestmark = pytest.mark.pictures

TIMES = [Fraction(n) for n in (1, 2, 3)]


def plan(folder: Path, count: int = 5, more: str = "") -> Path:
    sweep = table("sweep", kind="random", name="many", seed=3, count=count)
    return Path(plan_file(folder, f"{sweep}{asked('survey', 'sweep:many', horizon='3', samples=3)}{more}"))


@pytest.mark.slow
@pytest.mark.parametrize("family", ["any", "euler", "lagrange", "kovalevskaya"])
def test_records_equal_the_scorers(family: str) -> None:
    sweep = Random(name="s", seed=7, count=4, family=family)  # type: ignore[arg-type]
    motions = drawn(chunks(sweep, sweep.cases(), 0), DOUBLE)
    found = records.measured(motions, described("heyoka"), TIMES, DOUBLE, {})
    runs = propagate_ensemble(motions.problems, TIMES, threads=1)
    for place, (case, run) in enumerate(zip(sweep.cases(), runs, strict=True)):
        problem = Problem.of(case.top, case.start, DOUBLE)
        assert problem == motions.problems[place]
        scorer = Scorer(problem, truth(problem, TIMES))
        for time, state in zip(run.times, run.states, strict=True):
            scorer(time, state)
        metrics = scorer.metrics()
        for name, part in (("error_max", "relative"), ("error_omega", "omega"), ("error_gamma", "gamma")):
            expected = float(metrics[f"solution_error_{part}_max"])
            assert found[name][place] == pytest.approx(expected, rel=1e-7)
        for name in ("gamma_squared", "area", "energy"):
            assert found[f"drift_{name}"][place] == pytest.approx(float(metrics[f"drift_{name}_max"]), rel=1e-7)
        further = [float(m) for key, m in metrics.items() if key.startswith("drift_") and key.endswith("_max")][3:]
        value = found["drift_further"][place]
        assert value == pytest.approx(max(further), rel=1e-7) if further else math.isnan(value)
        assert found["steps"][place] == run.steps
        assert 0 < found["reference_radius"][place] < 1e-24
    kind = {"any": "general"}.get(family, family)
    assert motions.classes == [kind] * 4


def test_pairs_are_a_ring_to_a_hundred_bits() -> None:
    dice = Dice(5)
    for _ in range(200):
        a, b = (Pairs.of(numpy.array([dice.uniform(-1, 1) * 10.0 ** dice.randint(-20, 20)])) for _ in range(2))
        c = a * b + a
        one, two = (Fraction(float(x.high[0])) for x in (a, b))

        def value(pair: Pairs) -> Fraction:
            return Fraction(float(pair.high[0])) + Fraction(float(pair.low[0]))

        for pair, true in (
            (c, one * two + one), (c / b, value(c) / two), (1 - c, 1 - value(c)), (abs(-c), abs(value(c))),
        ):  # fmt: skip
            assert abs(value(pair) - true) <= abs(true) * Fraction(1, 2**98)


def test_a_grid_is_drawn_as_its_cases() -> None:
    omega = [["0.1", "0", "1e-3"], ["1/3", "1", "0"]]
    axis = ["0", "0", "1"]
    sweep = SweepGrid(name="g", inertia=["3", "2", "1"], weight="1", centre=axis, omega=omega, gamma=axis)  # type: ignore[arg-type]
    cases = sweep.cases()
    motions = drawn(chunks(sweep, cases, 0), DOUBLE)
    assert list(motions.problems) == [Problem.of(case.top, case.start, DOUBLE) for case in cases]


def test_a_reference_that_is_off_is_a_contradiction(monkeypatch: pytest.MonkeyPatch) -> None:
    sweep = Random(name="s", seed=7, count=2, family="lagrange")
    motions = drawn(chunks(sweep, sweep.cases(), 0), DOUBLE)
    computed = records._truth

    def off(*given: object) -> object:
        pairs, radius = computed(*given)  # type: ignore[arg-type]
        return Pairs(pairs.high, pairs.low + 1e-20), radius

    monkeypatch.setattr(records, "_truth", off)
    with pytest.raises(Contradiction, match="off the proven one"):
        records.measured(motions, described("heyoka"), TIMES, DOUBLE, {})


@pytest.mark.slow
def test_a_run_writes_a_row_and_a_record_a_motion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("heavytop.features.survey.measured.CHUNK", 4)
    run = heavytop("run", "--plan", plan(tmp_path, 9), "--out", tmp_path / "out", "--workers", 1)
    assert run.returncode == 0, run.stderr
    (row,) = json.loads((tmp_path / "out" / "report.json").read_text())["rows"]
    table = ht.read_survey(tmp_path / "out")
    assert list(table["index"]) == list(range(9))
    assert row["metrics"]["motions_success"]["value"] == "9"
    assert float(row["metrics"]["solution_error_relative_max"]["value"]) == pytest.approx(table.error_max.max())
    worst = row["worst"]
    assert [each["index"] for each in worst] == list(table.error_max.sort_values(ascending=False).index)
    case = Random(name="many", seed=3, count=9).cases()[worst[0]["index"]]
    assert tuple(map(exact, worst[0]["data"]["omega"])) == case.start.omega
    assert list(ht.read_survey(tmp_path / "out", columns=["digits_right"]).columns) == ["digits_right"]
    again = heavytop(*worst[0]["command"].partition("|")[0].split()[1:])
    state = json.loads(again.stdout)
    assert state


def test_a_survey_that_lost_a_chunk_is_worse_than_one_that_did_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("heavytop.features.survey.measured.CHUNK", 2)
    tasks = list(read(str(plan(tmp_path, 4)), KINDS)[2])
    rows = [KINDS["survey"].measure(task, Saved()) for task in tasks]
    lost = [failed(task, "heyoka aborted") for task in tasks]

    def report(*parts: Row) -> ht.Report:
        return ht.Report(SCHEMA, {"name": "many"}, {}, gathered(zip(tasks, parts, strict=True)))

    whole, part, none = report(*rows), report(rows[0], lost[1]), report(*lost)
    assert [row.metrics["motions_success"].value for each in (whole, part) for row in each.rows] == ["4", "2"]
    for bad, first in ((part, 2), (none, 0)):
        found = compare(whole, bad, Policy())
        assert (found.verdict, found.exit_code, len(found.findings)) == ("worse", 1, 1)
        assert f"heyoka aborted, in many[{first}]" in found.findings[0].reason
    assert compare(none, none, Policy()).verdict == "same"


@pytest.mark.slow
def test_records_do_not_depend_on_where_chunks_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def recorded(count: int, size: int) -> list[list[dict[str, object]]]:
        monkeypatch.setattr("heavytop.features.survey.measured.CHUNK", size)
        rows = [KINDS["survey"].measure(task, Saved()) for task in read(str(plan(tmp_path, count)), KINDS)[2]]
        return [read_chunk(row.chunk).to_pylist() for row in rows]  # type: ignore[arg-type]

    (whole,) = recorded(9, 9)
    for count in (1, 3, 4, 5, 8, 9):
        parts = recorded(count, 4)
        assert [len(part) for part in parts] == [4] * (count // 4) + [count % 4] * (count % 4 > 0)
        assert list(chain.from_iterable(parts)) == whole[:count]


@pytest.mark.slow
def test_a_resumed_run_leaves_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("heavytop.features.survey.measured.CHUNK", 3)
    file, whole, half = plan(tmp_path, 6), tmp_path / "whole", tmp_path / "half"
    ht.run(file, whole, workers=1)
    kind = KINDS["survey"]
    measure = kind.measure

    def stopped(task: object, saved: object) -> object:
        if task.case.first:  # type: ignore[attr-defined]
            raise KeyboardInterrupt
        return measure(task, saved)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(kind, "measure", stopped)
        with pytest.raises(KeyboardInterrupt):
            ht.run(file, half, workers=1)
    ht.run(file, half, workers=1, resume=True)
    name = "survey.parquet"
    assert (whole / name).read_bytes() == (half / name).read_bytes()
    assert [r.worst for r in ht.read_report(whole).rows] == [r.worst for r in ht.read_report(half).rows]


@pytest.mark.slow
def test_an_integrator_without_lanes_is_surveyed_too() -> None:
    sweep = Random(name="s", seed=7, count=2)
    motions = drawn(chunks(sweep, sweep.cases(), 0), DOUBLE)
    found = records.measured(motions, described("scipy:DOP853"), TIMES, DOUBLE, {})
    assert found["outcome"] == ["success"] * 2
    assert all(found["error_max"] > 0)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("samples = 3", 'precision = "quad"\nsamples = 3', "precision must be that of a survey; got quad"),
        ("samples = 3", 'tolerance = "nan"\nsamples = 3', "not a finite number"),
        ("samples = 3", "samples = 0", "samples"),
        ("samples = 3", 'integrator = "none-such"\nsamples = 3', "none-such"),
        ("samples = 3", 'map = ["omega1"]\nsamples = 3', "two axes"),
        ('"sweep:many"', '"sweep:many", "euler"', "must name a sweep; got 'euler'"),
    ],
)
def test_impossible_surveys_are_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    file = plan(tmp_path)
    file.write_text(file.read_text().replace(old, new))
    with pytest.raises(InputError, match=said):
        read(str(file), KINDS)


def test_columns_and_folders_that_are_not_there_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no survey"):
        ht.read_survey(tmp_path)
    (tmp_path / "survey.parquet").write_bytes(b"")
    with pytest.raises(InputError, match="cannot be read"):
        ht.read_survey(tmp_path)
    with pytest.raises(InputError, match="column must be one of a survey"):
        ht.read_survey(tmp_path, columns=["nothing"])


@pytest.mark.slow
def test_the_page_draws_the_worst_motions_and_the_map_asked_for(tmp_path: Path) -> None:
    file = plan(tmp_path, 45, 'map = ["omega3", "gamma3"]')
    ht.run(file, tmp_path / "out", workers=1)
    (row,) = ht.read_report(tmp_path / "out").rows
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Digits right over Ω3 and γ3" in page
    assert isinstance(row.worst, tuple)
    assert all(f">{each.index}<" in page for each in row.worst)
    assert sum(row.spread.histograms["error_max"].counts) == 45  # type: ignore[union-attr]


def _surveyed(folder: Path, fault: float = 0.0, places: tuple[int, ...] = ()) -> Path:
    """A run of 80 motions, of which some are off by a planted error of γ1; NaN for runs that end early."""
    runs = records._runs

    def faulty(*given: object) -> object:
        outcomes, states, steps = runs(*given)  # type: ignore[arg-type]
        states.high[list(places), -1, 3] += fault
        outcomes[[place for place in places if math.isnan(fault)]] = "incomplete"
        return outcomes, states, steps

    folder.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(records, "_runs", faulty)
        patch.setattr("heavytop.api.run_folder.page.write_report", lambda *given: None)
        ht.run(plan(folder, 80), folder / "out", workers=1)
    return folder / "out"


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _surveyed(tmp_path_factory.mktemp("surveys") / "healthy")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("spread",), None, "spread: missing"),
        (("spread", "histograms", "error_max", "counts"), [], "a distribution of no motions"),
        (("spread", "map", "x_edges"), [], "whose cells do not fit its edges"),
        (("spread", "map", "digits_lost"), [], "whose cells do not fit its edges"),
        (("worst", 0, "data", "gamma"), ["0", "1"], "worst: 2 components of gamma"),
    ],
)
def test_distributions_and_worst_motions_that_no_survey_has_are_refused(
    healthy: Path, tmp_path: Path, path: tuple[str | int, ...], value: object, said: str
) -> None:
    document = json.loads((healthy / "report.json").read_text())
    *inner, last = path
    part = reduce(lambda found, key: found[key], inner, document["rows"][0])
    if value is None:
        del part[last]
    else:
        part[last] = value
    (tmp_path / "report.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match=said):
        ht.read_report(tmp_path)


@pytest.mark.slow
def test_motions_that_got_worse_are_listed_with_the_command_that_shows_each(healthy: Path, tmp_path: Path) -> None:
    faulty = _surveyed(tmp_path / "faulty", 1e-9, (11, 40))
    (found,) = ht.compare(healthy, faulty).motions
    assert (found.joined, found.worse, {each.index for each in found.first}) == (80, 2, {11, 40})
    table = ht.read_survey(healthy)
    for each in found.first:
        assert each.before == round(table.digits_right[each.index], 2)
        assert each.after == pytest.approx(9, abs=0.5)
    said = heavytop("compare", healthy, faulty)
    assert said.returncode == 1
    pasted = " ".join(said.stdout.replace("\\\n", " ").split())
    assert f"got worse: 2 of 80 {found.first[0].text} {found.first[0].command} motion" in pasted
    assert json.loads(heavytop("compare", healthy, faulty, "--json").stdout)["surveys"][0]["worse"] == 2
    (back,) = ht.compare(faulty, healthy).motions
    assert (back.worse, back.sentence) == (0, "")


def test_a_command_made_of_a_record_measures_the_same_motion(healthy: Path) -> None:
    (row,) = ht.read_report(healthy).rows
    columns = comparing._records(healthy / "survey.parquet", row)
    for index in (3, 70):
        line = comparing._command(row, columns, index, "success").partition(" | ")[0].split()
        state = json.loads(heavytop("propagate", *line[2:]).stdout)
        case = Random(name="many", seed=3, count=80).cases()[index]
        expected = ht.propagate(case.top, case.start, TIMES, ht.DOUBLE)
        assert [*map(float, state["states"][-1])] == [*map(float, expected.states[-1])]


@pytest.mark.slow
def test_a_fault_that_no_quantile_sees_is_listed_all_the_same(tmp_path: Path) -> None:
    before = tuple(range(0, 80, 3))  # a third of the motions is off in both
    found = ht.compare(*(_surveyed(tmp_path / str(len(off)), 1e-9, off) for off in (before, (*before, 11))))
    assert found.verdict == "same"
    assert [each.index for each in found.motions[0].first] == [11]


@pytest.mark.slow
def test_a_motion_that_fails_now_is_worse_than_any_that_lost_digits(healthy: Path, tmp_path: Path) -> None:
    faulty = _surveyed(tmp_path / "faulty", math.nan, (7,))
    (found,) = ht.compare(healthy, faulty).motions
    assert [(each.index, each.after, each.outcome) for each in found.first] == [(7, None, "incomplete")]
    assert not found.first[0].command.endswith("score -")
    assert ht.compare(faulty, faulty).motions[0].worse == 0


@pytest.mark.slow
def test_surveys_of_other_tops_are_not_joined(healthy: Path, tmp_path: Path) -> None:
    file = plan(tmp_path, 9)
    file.write_text(file.read_text().replace("seed = 3", "seed = 4"))
    ht.run(file, tmp_path / "other", workers=1)
    (found,) = ht.compare(healthy, tmp_path / "other").motions
    assert found.reason == "motion 0 is another top or start"
    assert not found.first
