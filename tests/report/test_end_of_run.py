"""What a run says when it is over: 25 lines of 80 columns, whatever the report."""

from __future__ import annotations

from pathlib import Path

import pytest

from heavytop.features.kinds import KINDS
from heavytop.records import SCHEMA, Against, Law, Metric, Report, Row, Series
from heavytop.report.document.document import Card, Note
from heavytop.report.render.terminal import LINES, MOST_ROWS, WIDTH, _lines, _shown, brief, fitted
from heavytop.report.store import store
from support.small_reports import error, row

RESULTS = Path(__file__).parents[2] / "results"


def summary(*rows) -> list[str]:
    return brief(Report(SCHEMA, {"name": "p"}, {}, []), iter(rows), KINDS).splitlines()


def said(*rows) -> list[str]:
    """The summary after its headline."""
    lines = summary(*rows)
    return lines[next(i for i, line in enumerate(lines) if line.startswith("Plan p: ")) :]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["default", "growth", "long", "peers"])
def test_every_plan_ends_in_few_lines_that_are_not_cut(name: str) -> None:
    report = store.read(RESULTS / name, KINDS)
    lines = brief(report, report.rows, KINDS).splitlines()
    assert len(lines) <= LINES
    assert max(map(len, lines)) <= WIDTH
    ended = "1 aborted." if name == "peers" else "all finished."  # CVODE, whose step became too small
    said_of_plan = f"Plan {name}: {len(report.rows)} measurements, {ended}"
    assert said_of_plan in lines[1:]
    assert not any("lines more" in line for line in lines)


def test_the_digits_of_each_motion_and_format_stand_in_a_table() -> None:
    digits = {"solution_error_relative_max": error("1e-9")}
    rows = [
        row(metrics=digits, horizon="1000"),
        row(metrics=digits | {"solution_error_relative_max": error("1e-7")}, horizon="100000"),
        row(case="a" * 99, precision="quad", bits=113, metrics=digits | {"x": error("1")}, horizon="20"),
    ]
    assert summary(*rows) == [
        "heyoka in double: 7.0 of 16 digits right to T = 1e5 (euler).",
        "Plan p: 3 measurements, all finished.",
        f"{'Digits right, to |t|':39}      double       quad",
        f"{'euler':39}  7.0 to 1e5          -",
        f"{'a' * 38}…           -  9.0 to 20",
    ]


def test_what_failed_is_named_and_counted() -> None:
    ended = {"outcome": "step_limit", "time_reached": f"0.{'0' * 65}75", "horizon": f"0.{'0' * 64}1", "metrics": {}}
    lines = said(*(row(case=f"top-{i}", **ended) for i in range(9)))
    assert lines[0] == "Plan p: 9 measurements, 9 failed:"
    assert lines[1] == "  top-0 in double: step_limit at t = 7.5e-66 of 1e-65"
    assert lines[3] == "  and 7 more"


def test_of_steps_that_were_not_measured_nothing_is_said() -> None:
    unmeasured = {"local_error_ulp_max": Metric("missing", None, "error")}
    lines = said(row(measure="local_error", outcome="step_too_small", samples=0, metrics=unmeasured))
    assert not any("one step errs" in line for line in lines)


@pytest.mark.slow
def test_many_rows_are_counted() -> None:
    lines = said(*(row(case=f"top-{i}") for i in range(MOST_ROWS + 1)))
    assert lines[1] == f"drift in double: {MOST_ROWS + 1} success"


def test_parts_that_are_too_long_are_cut_where_they_are_longest_and_say_so() -> None:
    parts = [["a"], [f"b{i}" for i in range(30)], [f"c{i}" for i in range(4)], []]
    found = fitted(parts, 12)
    assert len(found) == 12
    assert found[0] == "a"
    assert found[-4:] == ["c0", "c1", "c2", "c3"]
    assert found[6:8] == ["  and 24 lines more", "b29"]
    assert fitted(parts, 100) == [line for part in parts for line in part]


def law_row(growth: str, integrator: str = "mine:rk4", **laws: str) -> Row:
    found = {"solution_error_along": growth, **laws}
    times = [f"{10**k}" for k in range(4)]
    series = {"solution_error_along": Series(times, ["1e-9", "1e-8", "1e-7", "5e-6"])}
    return row(
        measure="growth",
        integrator=integrator,
        laws={name: Law(each, 12) for name, each in found.items()},
        series=series,
    )


@pytest.mark.parametrize(
    ("growth", "words"),
    [
        ("t^1.5", "grows like t^1.5: rounding noise alone, the smallest possible."),
        ("t", "grows like t: a constant frequency error, from truncation or a wrong coefficient."),
        ("bounded", "is bounded."),
        ("unresolved", "shows no law over three decades of t; over the last decade it is like t^1.7."),
    ],
)
def test_the_law_of_an_integrator_of_others_is_said_with_what_it_means(growth: str, words: str) -> None:
    lines = said(law_row("t^1.5", "heyoka"), law_row(growth))
    sentence = " ".join(line.strip() for line in lines[4:])
    assert sentence == f"euler: the error of mine:rk4 along the flow {words}"


def test_laws_that_do_not_fit_a_column_are_counted() -> None:
    drifts = {"drift_energy": "unresolved", "drift_area": "t^0.5", "drift_gamma_squared": "t"}
    (line,) = (line for line in said(law_row("t", **drifts)) if "double" in line)
    assert line.split() == ["mine:rk4", "double:", "euler", "3", "laws", "t", "-"]


@pytest.mark.parametrize(
    ("orders", "words"),
    [
        ("4", "1.9e-11; order 4 confirmed in single steps."),
        ("0", "1.9e-11; order 0 in single steps."),
        ("", "1.9e-11."),
        ("4 0", "1.9e-11; order 0 in whole runs, not the declared 4."),  # a fault, and no memory
        (
            "3 2",
            "1.9e-11; order 2 in whole runs, not the declared 4 (3 in single steps: a multistep method should declare "
            "one_step = false).",
        ),
    ],
)
def test_a_step_of_an_integrator_of_others_is_said_with_its_order(orders: str, words: str) -> None:
    names = zip(("observed_order", "observed_order_runs"), orders.split(), strict=False)
    metrics = {"local_error_ulp_max": error("85947")} | {name: error(order) for name, order in names}
    theirs = row(measure="local_error", integrator="mine:rk4", metrics=metrics, order=4)
    sentence = " ".join(line.strip() for line in said(row(measure="local_error", metrics=metrics), theirs)[1:])
    assert sentence == f"euler mine:rk4 in double: one step errs by at most {words}"
    coarse = row(
        case="coarse", measure="local_error", integrator="mine:rk4", metrics={"local_error_ulp_max": error("1e9")}
    )
    assert summary(theirs, coarse)[0].startswith("euler") == ("not the declared" in words)


def test_escapes_in_one_format_stand_by_integrator() -> None:
    metrics = {"break_away_time": error("33.6")}
    rows = [row(measure="homoclinic", integrator=name, metrics=metrics) for name in ("heyoka", "mine:rk4")]
    assert said(*rows)[1:] == [
        "Escape from a homoclinic motion at |t|  heyoka  mine:rk4",
        "euler                                     33.6      33.6",
    ]


def escaping(integrator: str, time: str, gamma: str, drift: str) -> Row:
    errors = {"solution_error_omega_max": "1e-12", "solution_error_gamma_max": gamma, "drift_energy_max": drift}
    metrics = {name: error(value) for name, value in errors.items()}
    return row(measure="homoclinic", integrator=integrator, metrics=metrics | {"break_away_time": error(time)})


@pytest.mark.parametrize(
    ("time", "gamma", "drift", "words"),
    [
        ("33.6", "1e-12", "2e-6", "the drift of mine:rk4 is 2e-6, heyoka's 1e-14."),
        ("40", "3e-9", "1e-13", "the error of γ of mine:rk4 is 3e-9, heyoka's 1e-12."),
        ("33.6", "5e-11", "9e-13", ""),
        # that it is worse is seen already
        ("20", "1e-3", "1e-3", ""),
    ],
)
def test_an_escape_time_hides_no_error(time: str, gamma: str, drift: str, words: str) -> None:
    lines = said(escaping("heyoka", "33.6", "1e-12", "1e-14"), escaping("mine:rk4", time, gamma, drift))
    assert lines[3:] == [f"euler: {words}"] * bool(words)


@pytest.mark.parametrize(("end", "words"), [("5e-6", " At the end it is 5e-6, heyoka's 1e-12."), ("9e-11", "")])
def test_a_law_hides_no_size(end: str, words: str) -> None:
    rows = [law_row("unresolved", "heyoka"), law_row("unresolved")]
    for each, value in zip(rows, ("1e-12", end), strict=True):
        each.metrics["solution_error_along_final"] = error(value)
    assert " ".join(line.strip() for line in said(*rows)[4:]).endswith(f"like t^1.7.{words}")


def test_a_card_has_its_title_alone_on_a_line_and_nothing_is_cut() -> None:
    """Long lines of a survey are broken, as everywhere; none is joined to the title above it."""
    line = "a-sweep-of-tops heavyoka double to T = 10: 300 success; error: median 6e-16, q99 5.7e-15, max 8.2e-15"
    for lines in ([line], [line, line], ["short"]):
        card = Card("Surveys: a record for each motion in survey.parquet", [Note(each) for each in lines])
        first, *rest = _lines(_shown([card, card], brief=True))[: 1 + 2 * len(lines)]
        assert first == card.title
        assert " ".join(part.strip() for part in rest).startswith(" ".join(lines)[: 80 * len(lines)])


def test_rows_that_are_not_supported_are_not_finished() -> None:
    rows = [row(), row(case="lagrange", outcome="unsupported", metrics={}, reference=Against("none", reason="no"))]
    assert "Plan p: 2 measurements, 1 finished, 1 not supported." in said(*rows)
