"""What people and machines get to read of a report, a comparison and a history.

Golden text lies in tests/report/golden; `python tests/report/test_outputs.py` writes it anew (with tests on the path),
to be looked at in the diff.
"""

import json
import re
from io import StringIO
from pathlib import Path
from xml.etree import ElementTree

import msgspec
import pytest
from rich.console import Console

from heavytop.measure.scalar import of_fraction
from heavytop.precision import exact
from heavytop.records import Law, Quantity, Report, Series
from heavytop.report.compare.compare import Differences
from heavytop.report.compare.noise import Policy
from heavytop.report.document.document import logarithm
from heavytop.report.render.comparison import comparison
from heavytop.report.render.export import comparison_junit, comparison_markdown
from heavytop.report.render.history import _ticks, history_json, history_page, history_text
from heavytop.report.render.plots import growth
from heavytop.report.render.text import Lines
from support.reports import compare, comparison_page, history, replace, report_page, summary
from support.small_reports import error, report, row

pytestmark = pytest.mark.pictures
GOLDEN = Path(__file__).parent / "golden"
HOSTILE = 'a | b <script>alert("1")</script>\n`x`\x01' + "y" * 10_000


def baseline() -> Report:
    return report(
        row(laws={"drift_energy": Law("t^0.5", 64, 0.5, 0.45, 0.55)}),
        row(case="lagrange", metrics={"drift_energy_max": error("3e-13"), "solution_error_across_max": error("1e-9")}),
        row(case="gone"),
        row(case="stopped"),
        row(
            case="delone/forward",
            measure="homoclinic",
            metrics={
                "break_away_time": of_fraction(exact("35.5"), "duration"),
                "solution_error_omega_max": error("2.5e-13"),
            },
        ),
        row(case="delone/backward", measure="homoclinic", precision="real:237", bits=237),
    )


def candidate() -> Report:
    rows = [each for each in baseline().rows if each.case != "gone"]
    rows[0] = replace(rows[0], laws={"drift_energy": Law("t", 64, 1.0, 0.9, 1.1)})
    rows[0].metrics["drift_energy_max"] = error("1e-10")
    rows[1].metrics["solution_error_across_max"] = error("1e-14")
    rows[2] = replace(rows[2], outcome="step_limit", time_reached="7.5")
    made = report(*rows, row(case="added"))
    return replace(made, environment={"packages": {"heyoka": "8"}, "llvm": "23.0"}, plan={"name": "test", "seed": "1"})


def compared() -> Differences:
    return compare(baseline(), candidate(), Policy())


def on_paper(renderable: object) -> str:
    console = Console(width=160, record=True, file=open("/dev/null", "w"), highlight=False)  # noqa: SIM115
    console.print(renderable)
    console.file.close()
    return "\n".join(line.rstrip() for line in console.export_text().splitlines()) + "\n"


def shown() -> Report:
    made = baseline()
    drift = {"drift_energy": Series(["1", "10"], ["1e-14", "1e-13"])}
    made.rows[0] = replace(made.rows[0], series=drift)
    steps = {
        "local_error_ulp_max": error("0.65"),
        "local_error_ulp_rms": error("0.28"),
        "observed_order": of_fraction(exact("19"), "value"),
    }
    made.rows.extend(
        [
            row(measure="local_error", metrics=steps, order=20),
            row(measure="local_error", metrics={}, outcome="step_limit", time_reached="7.5"),
            row(measure="score", integrator="rk4.f90"),
            row(measure="growth", laws={"drift_area": Law("t", 64, 1.0), "drift_energy": Law("t", 64, 1.0, 0.9, 1.1)}),
            row(measure="of a later version"),
        ]
    )
    return made


def three() -> tuple[list[str], list[Report]]:
    return ["v1", "v2", "v3"], [baseline(), baseline(), candidate()]


MADE = {
    "show.txt": lambda: on_paper(summary(shown())),
    "compare.txt": lambda: on_paper(comparison(compared())),
    "compare.md": lambda: comparison_markdown(compared(), Path("out/both sides.html")),
    "compare.xml": lambda: comparison_junit(compared()),
    "history.txt": lambda: on_paper(
        history_text(three()[0], [t for t in history(three()[1], Policy()) if t.steps]),
    ),
}


@pytest.mark.parametrize("name", MADE)
def test_the_text_is_the_golden_one(name: str) -> None:
    assert MADE[name]() == (GOLDEN / name).read_text("utf-8")


def hostile() -> Differences:
    bad = row(case=HOSTILE, metrics={HOSTILE: error("1e-5")})
    return compare(report(row(case=HOSTILE, metrics={HOSTILE: error("1e-12")})), report(bad), Policy())


def test_hostile_names_do_not_get_out_of_a_markdown_cell() -> None:
    text = comparison_markdown(hostile())
    row, quantity = [line for line in text.splitlines() if line.startswith("| worse")]
    assert max(map(len, text.splitlines())) < 1000
    assert row.replace(r"\|", "").count("|") == 4
    assert quantity.replace(r"\|", "").count("|") == 7
    assert "<script>" not in text.replace(r"\<", "")


@pytest.mark.slow
def test_a_long_comparison_stays_a_short_comment() -> None:
    old = report(*(row(case=f"top-{i}") for i in range(80)))
    new = report(*(row(case=f"top-{i}", metrics={**row().metrics, "drift_energy_max": error("1")}) for i in range(80)))
    text = comparison_markdown(compare(old, new, Policy()))
    assert "and 30 more." in text
    assert len(text) < 65_536


def test_junit_is_xml_whatever_the_names_and_counts_what_it_holds() -> None:
    for result in (compared(), hostile()):
        suite = ElementTree.fromstring(comparison_junit(result).encode())
        cases = suite.findall("testcase")
        assert len(cases) == int(suite.get("tests", "")) == len(result.findings)
        assert len(suite.findall("testcase/failure")) == int(suite.get("failures", "")) > 0
        assert len(suite.findall("testcase/error")) == int(suite.get("errors", ""))


def test_a_history_marks_each_step_at_the_report_it_came_with() -> None:
    names, reports = three()
    tracks = {(t.row.case, t.metric): t for t in history(reports, Policy())}
    track = tracks["euler", "drift_energy_max"]
    assert track.values == ["1E-12", "1E-12", "1E-10"]
    assert {number: verdict.value for number, (verdict, _) in track.steps.items()} == {2: "worse"}
    assert tracks["euler", "break_away_time"].steps == {}
    assert tracks["gone", ""].steps[2][0].value == "missing"
    assert tracks["added", ""].steps[2][0].value == "new"
    document = json.loads(json.dumps(history_json(names, list(tracks.values()))))
    assert document["reports"] == names
    assert document["tracks"][0]["values"] == track.values


@pytest.mark.slow
def test_a_history_has_a_page_with_a_chart_for_each_row_and_its_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    names, reports = three()
    tracks = history(reports, Policy())
    page = history_page([HOSTILE, *names[1:]], reports, tracks)
    one, other = (history_page(names, reports, tracks[:2]) for _ in range(2))
    assert one == other
    assert "<script" not in page
    drawn = {t.row for t in tracks if sum(logarithm(value) is not None for value in t.values) > 1}
    assert page.count("<figure class") == len(drawn) > 3
    for name in names[1:]:
        assert f">{name}</text>" in page
    assert "drift_energy_max worse at 3: 6.6 bits lost" in page
    assert "1e-10 ▲ worse" in re.sub("<span.*?>|</span>", "", page)
    for track in tracks:
        assert (track.metric or "whole row") in page
    missing = [track for track in tracks if not track.metric]
    quiet = history_page(names, reports, missing)
    assert "<figure class" not in quiet
    assert "missing" in quiet
    rows = [msgspec.structs.replace(t, row=t.row._replace(case=f"{i}")) for i in range(3) for t in tracks[:1]]
    monkeypatch.setattr("heavytop.report.render.history.MOST_PICTURES", 2)
    many = history_page(names, reports, rows)
    assert many.count("<figure class") == 2
    assert "more in the table alone" in many


CONTROL = "a\x00\x1b[31m\x07\x9b1m\u202e\ufffe[/red]$b"


@pytest.mark.slow
def test_no_control_character_gets_out_to_a_terminal_or_breaks_xml() -> None:
    metrics = {"error_max": error("1e-5"), CONTROL: error("1e-12")}
    rows = [
        row(case=CONTROL, integrator=CONTROL, measure=measure, metrics={**row().metrics, **metrics})
        for measure in ("drift", "work_precision", "audit", "local_error", "score", CONTROL)
    ]
    rows.append(row(case=CONTROL, outcome="step_limit", time_reached="1", system=CONTROL, seconds={"least": 1.0}))
    old, new = report(*rows), report(*(replace(each, metrics={CONTROL: error("1")}) for each in rows))
    old = replace(old, environment=old.environment | {CONTROL: CONTROL}, plan={"name": CONTROL})
    found, tracks = compare(old, new, Policy()), history([old, new], Policy())
    texts = [
        on_paper(summary(old)),
        on_paper(comparison(found)),
        on_paper(history_text([CONTROL, "b"], tracks)),
        comparison_markdown(found),
        comparison_junit(found),
        history_page([CONTROL, "b"], [old, new], tracks[:3]),
        comparison_page(old, new, found),
        report_page(old),
    ]
    for text in texts:
        assert not set(text) & {chr(code) for code in (*range(32), *range(127, 160)) if chr(code) not in "\n\t"}
    ElementTree.fromstring(comparison_junit(found).encode())


if __name__ == "__main__":
    for file, make in MADE.items():
        (GOLDEN / file).write_text(make(), "utf-8")


def printed(made, width: int) -> str:
    console = Console(width=width, record=True, file=StringIO(), highlight=False)
    console.print(made)
    text = console.export_text()
    assert max(map(len, text.splitlines())) <= width
    return text


@pytest.mark.parametrize("width", [60, 80, 100, 160])
def test_no_number_and_no_name_is_broken_however_narrow_the_terminal(width: int) -> None:
    run = ["lagrange sundials:CVODE", "double", "20", "1258", "success", "12.5", "2.7e-13 ± 0.43", "5.1e-13 ± 0.38"]
    drifts = "|γ|² 1.0e-13 ± 0.35  M·γ 1.8e-13 ± 0.28  energy 3.9e-14 ± 0.31  Ω3 0"
    head = ["case", "format", "T", "steps", "outcome", "digits right", "error along", "across", "drift of integrals"]
    text = printed(Lines(head, [[*run, drifts]], left=True), width)
    for word in [*" ".join(run[:6]).split(), *run[6:], *drifts.split("  ")]:  # no number stands apart from its noise
        assert word in text
    names = ["ershkov-partial-2/backward", "a-very-long-name-of-a-case-nobody-would-like-to-see-broken"]
    made = Lines(["case", "format", "largest error"], [[name, "double-double", "1.25e-13 ± 0.31"] for name in names])
    text = printed(made, width)
    assert all(word in text for word in (*names, "double-double", "1.25e-13 ± 0.31", "case"))


@pytest.mark.slow
def test_the_first_integral_is_drawn_that_drifts_farthest_at_any_sample_of_both_reports() -> None:
    def drifting(**drifts: tuple[str, str]) -> Report:
        series = {f"drift_{name}": Series(["1", "9"], [*d], Quantity("drift", name)) for name, d in drifts.items()}
        return report(
            row(metrics={f"drift_{name}_max": error(max(d, key=float)) for name, d in drifts.items()}, series=series)
        )

    old, new = (
        drifting(area=("1e-14", "1e-13"), energy=("1e-15", "1e-15")),
        drifting(area=("1e-14", "1e-13"), energy=("1e-3", "1e-15")),
    )
    section = growth([("baseline", old), ("candidate", new)])
    assert section is not None
    assert [cells[2:4] for cells in section.rows] == [["drift of energy", "1e-15"], ["drift of energy", "0.001"]]


def test_reports_of_one_folder_name_stand_by_their_number_on_the_axis() -> None:
    found = report(row())
    assert _ticks(["v1/out", "v2/out"], [found, found]) == ["1", "2"]
    assert _ticks(["out/v1", "out/v2"], [found, found]) == ["v1", "v2"]
