"""What is read off work against precision, on rows whose answers are known."""

import math
from pathlib import Path
from typing import Any

import msgspec
import pytest

from heavytop.errors import InputError
from heavytop.features.kinds import KINDS
from heavytop.features.work_precision.charts import work_precision
from heavytop.features.work_precision.curves import (
    WorkPrecisionLine,
    WorkPrecisionPoint,
    beside_ours,
    fastest,
    leads,
    panels,
)
from heavytop.records import Metric, Series
from heavytop.report.document.document import Headline
from heavytop.report.document.svg import quiet_style
from heavytop.report.render.plots import draw_report
from support import small_reports
from support.helpers import shown
from support.reports import Row, summary
from support.small_reports import report

pytestmark = pytest.mark.pictures

KIND = ("svg", "pdf")


def row(integrator: str, log10: float | None, seconds: float, *, case: str = "top/T=9", **more: Any) -> Row:
    """A row of an error and of the least seconds."""
    metrics = {"error_max": Metric("1", log10) if log10 is not None else Metric("missing", None)}
    metrics["error_final"] = Metric("1", None if log10 is None else log10 - 1)
    series = dict.fromkeys(("drift_energy", "solution_error_along"), Series(["1", "2"], ["1e-9", "unresolved"]))
    given = {"seconds": {"run": 99.0, "least": seconds, "compile": more.pop("compile", 0.0)}, "series": series} | more
    common = {"measure": "work_precision", "horizon": "9", "time_reached": "9", "steps": 5, "against": ""}
    return small_reports.row(case=case, integrator=integrator, metrics=metrics, **common, **given)


OURS = [row("heyoka tolerance=1e-8", -8, 1.0), row("heyoka tolerance=1e-12", -12, 4.0)]
CYRK = [row("cyrk:DOP853 tolerance=1e-8", -9, 3.0), row("cyrk:DOP853 tolerance=1e-12", -11, 27.0)]
SPLITTING = [row("splitting:4 step=1/4", -5, 0.5)]
FAILED = [row("sundials:CVODE tolerance=1e-16", None, 0.1, outcome="step_too_small")]
LANES = [row("heyoka:lanes tolerance=eps", -13, 0.001)]
ALL = OURS + CYRK + SPLITTING + FAILED + LANES


def line_of(*points: tuple[int, float]) -> WorkPrecisionLine:
    return WorkPrecisionLine("x", "double", [WorkPrecisionPoint(*point, "") for point in points])


def test_the_lead_is_over_the_best_peer_that_gets_there() -> None:
    (lead,) = leads(ALL)
    assert (lead.case, lead.other) == ("top/T=9", "cyrk:DOP853")
    assert lead.ours == pytest.approx(2)
    assert lead.ratio == pytest.approx(4.5)
    assert "is 4.5 × as fast as the best other integrator, cyrk:DOP853" in lead.text
    assert lead.text.endswith("(2 s against 9 s); a motion in lanes takes 1 ms")
    assert lead.short == "At 1e-10 heyoka double is 4.5 × as fast as cyrk:DOP853"


def compiled_in(seconds: float, log10: float = -11.0) -> Row:
    return row("heyoka:constants tolerance=1e-11", log10, seconds, compile=0.25)


def test_the_best_scalar_form_of_heyoka_leads_and_the_general_one_is_stated_beside_it() -> None:
    ours = [row("heyoka tolerance=1e-8", -8, 1.0, compile=0.125), row("heyoka tolerance=1e-12", -12, 4.0, compile=0.5)]
    (lead,) = leads([*ours, compiled_in(1.0), *CYRK])
    assert lead.text == (
        "top/T=9: heyoka:constants at error 1e-10 is 9.0 × as fast as the best other integrator, cyrk:DOP853 "
        "(1 s against 9 s); heyoka double, one code for every top, is 4.5 × as fast (2 s); "
        "to compile, at most: heyoka double 500 ms, heyoka:constants 250 ms"
    )
    assert lead.short == "At 1e-10 heyoka:constants is 9.0 ×, heyoka double 4.5 × as fast as cyrk:DOP853"


def test_constants_that_are_no_gain_or_alone_or_too_coarse_change_no_claim() -> None:
    slower, alone, coarse = (
        leads([*ours, *CYRK])[0]
        for ours in ([*OURS, compiled_in(3.0)], [OURS[0], compiled_in(1.0)], [*OURS, compiled_in(1.0, -9.0)])
    )
    assert (slower.name, slower.ratio, slower.general) == ("heyoka double", pytest.approx(4.5), None)
    assert (alone.name, alone.general) == ("heyoka:constants", ("heyoka double", None))
    assert "heyoka double, one code for every top, does not reach it" in alone.text
    assert alone.short.endswith("cyrk:DOP853")
    assert (coarse.name, coarse.ratio) == ("heyoka double", pytest.approx(4.5))


@pytest.mark.parametrize(("theirs", "cell"), [(1.92, "1.0"), (1.88, "slower, 0.9"), (2.08, "1.0"), (2.12, "1.1")])
def test_a_lead_is_called_slower_where_its_printed_digits_are(theirs: float, cell: str) -> None:
    section = work_precision([("", report(*OURS, row("fast:x tolerance=1", -11, theirs)))])
    assert section is not None
    assert section.answers is not None
    ((*_, times, _, _),) = section.answers.rows
    assert times == f"{cell}\N{NO-BREAK SPACE}×"


def test_no_two_of_many_curves_look_alike() -> None:
    rows = [row(f"x{n} tolerance=1", -8 - n / 2, 0.1 + n) for n in range(17)]
    with quiet_style():
        section = work_precision([("", report(*rows))])
    assert section is not None
    curves = [line for line in section.pictures[0].axes.get_lines() if str(line.get_label()).startswith("x")]
    looks = {(line.get_color(), line.get_marker(), str(line._dash_pattern)) for line in curves}
    assert len(looks) == len(curves) == 17


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (OURS + SPLITTING, "takes 2 s; no other reaches it"),
        (OURS + FAILED, "no other reaches it"),
        (
            [OURS[0], row("multiword tolerance=eps", -15, 0.5)],
            "top/T=9: heyoka double at error 1e-10: not reached; the fastest that reaches it is multiword (500 ms)",
        ),
        (OURS[:1] + CYRK, "not reached; the fastest that reaches it is cyrk:DOP853 (9 s)"),
        (
            [*OURS, row("fast:x tolerance=1", -11, 0.5)],
            "the fastest at error 1e-10 is fast:x (500 ms); heyoka double is 0.25 × as fast (2 s)",
        ),
    ],
)
def test_a_lead_that_is_none_is_not_claimed(rows: list, words: str) -> None:
    (lead,) = leads(rows)
    assert words in lead.text


def test_formats_beyond_extended_are_compared_where_double_ends() -> None:
    wide = [row("mpmath:odefun tolerance=eps", -33, 100.0, precision="real:113")]
    wide += [row("heyoka tolerance=eps", -33, s, precision=name) for name, s in (("quad", 4.0), ("real:113", 2.0))]
    both = leads(ALL + wide)
    assert [(lead.log10, lead.name, lead.other) for lead in both] == [
        (-10, "heyoka double", "cyrk:DOP853"),
        (-30, "heyoka real:113", "mpmath:odefun real:113"),
    ]
    assert both[1].ratio == pytest.approx(50)
    assert leads(OURS + wide) == both[1:]


@pytest.mark.parametrize(
    ("rows", "short"),
    [
        (
            [row(f"multiword tolerance=1e{n}", n, 0.25, precision="double-double") for n in (-25, -31)],
            "multiword double-double is 16.0 × as fast as heyoka quad",
        ),
        (
            [row("multiword tolerance=eps", -34, 0.5, precision="quad")],
            "multiword quad is 8.0 × as fast as heyoka quad",
        ),
    ],
)
def test_whoever_is_fastest_is_named(rows: list[Row], short: str) -> None:
    (lead,) = leads([row("heyoka tolerance=eps", -33, 4.0, precision="quad"), *rows])
    assert lead.text.startswith(f"top/T=9: the fastest at error 1e-30 is {short.partition(' is')[0]} (")
    assert lead.short == f"At 1e-30 {short}"


def test_the_summary_says_it() -> None:
    text = shown(summary(report(*ALL)), 160)
    assert "4.5 × as fast as the best other integrator, cyrk:DOP853" in text
    assert "Failed measurements" not in text
    (line,) = [line for line in text.splitlines() if "sundials:CVODE" in line]
    assert line.split() == ["sundials:CVODE", "-", "-", "-", "-", "-", "-", "1"]


def drawn(rows: list[Row]) -> Any:
    """Their picture of the page."""
    with quiet_style():
        (picture,) = work_precision([("", report(*rows))]).pictures
    return picture


def test_the_picture_shows_every_line_and_each_failure_as_a_cross_on_the_edge() -> None:
    picture = drawn(ALL)
    lines = {line.get_label(): line for line in picture.axes.get_lines() if line.get_marker() != "x"}
    assert [round(y, 5) for y in lines["heyoka double"].get_ydata()] == [round(math.log10(4), 5), 0.0]
    assert "sundials:CVODE" not in lines
    (cross,) = [line for line in picture.axes.get_lines() if line.get_marker() == "x"]
    assert (list(cross.get_xdata()), list(cross.get_ydata())) == ([1.0], [pytest.approx(-1)])
    looks = [(line.get_color(), line.get_marker()) for line in lines.values()]
    assert len(set(looks)) == len(looks)
    assert picture.svg == drawn(ALL).svg
    for name in ("heyoka double", "cyrk:DOP853", "sundials:CVODE, × aborted"):
        assert f">{name}</text>" in picture.svg


def test_a_case_without_any_error_is_drawn_empty() -> None:
    for rows in ([row("heyoka tolerance=1", None, 1.0)], FAILED):
        assert drawn(rows).svg


def test_who_is_fastest_at_1e_10_opens_the_page() -> None:
    assert fastest(ALL) == Headline(
        "heyoka double is the fastest at error 1e-10 on top/T=9: 4.5 times as fast as cyrk:DOP853.",
    )
    slow = [*OURS, row("fast:x tolerance=1", -11, 0.5)]
    assert fastest(slow) == Headline(
        "fast:x is the fastest at error 1e-10 on top/T=9: 4.0 times as fast as heyoka double.",
    )
    # each is named with the motions that it wins, and is compared with the next of these alone
    other = [row(f"{name} tolerance=1", -11, seconds, case="b") for name, seconds in (("heyoka", 1.0), ("fast:x", 3.0))]
    third = [row(f"{name} tolerance=1", -11, seconds, case="c") for name, seconds in (("heyoka", 6.0), ("fast:x", 3.0))]
    said = "heyoka double is the fastest at error 1e-10 on 2 of 3 motions: 3.0 to 4.5 times as fast"
    assert fastest(ALL + other + third) == Headline(f"{said} as the best other than heyoka; fast:x on 1.")
    least = "The smallest error is 1e-11: cyrk:DOP853 on top/T=9, in 27 s."
    assert fastest(OURS[:1] + CYRK) == Headline(least)
    assert fastest([]) is None


@pytest.mark.slow
def test_every_picture_is_a_file_as_svg_and_as_pdf(tmp_path: Path) -> None:
    growth = [row(f"{name} tolerance=1e-5", -5, 1.0) for name in ("heyoka", "cyrk:DOP853")] + SPLITTING
    files = draw_report(report(*growth), tmp_path / "new", KINDS)
    names = [file.name for file in files]
    assert names == [f"{stem}.{kind}" for stem in ("work-0", "method-growth-0", "method-growth-1") for kind in KIND]
    for file in files:
        text = file.read_bytes()
        assert text.startswith(b"%PDF" if file.suffix == ".pdf" else b"<?xml")
        assert len(text) > 4000
    assert "Energy drift over time" in files[2].read_text("utf-8")
    assert "cyrk:DOP853 tolerance=1e-5" in files[2].read_text("utf-8")
    again = draw_report(report(*growth), tmp_path / "again", KINDS)
    assert [file.read_bytes() for file in again] == [file.read_bytes() for file in files]
    with pytest.raises(InputError, match="no rows to draw"):
        draw_report(report(), tmp_path / "none", KINDS)
    assert not (tmp_path / "none").exists()


def test_one_beside_heyoka_is_a_table_with_a_line_a_rung() -> None:
    mine = [row("mine:rk4 step=1/10", -4, 0.0123), row("mine:rk4 step=1/30", -9.7, 123.4)]
    mine += [row("mine:rk4 step=1/30", -13, 2.0, case="b/T=1"), row("heyoka tolerance=eps", -12, 0.5, case="b/T=1")]
    table, second = said = beside_ours(OURS + LANES + mine)
    assert table.columns == ["mine:rk4, top/T=9", "error", "time", "heyoka's time"]
    assert table.rows == [
        ["step 1/10", "1.0e-04", "12 ms", "1 s"],
        ["step 1/30", "2.0e-10", "123 s", "1.8 s"],
        ["order, finest two", "11.9", "", ""],
    ]
    assert second.rows == [["step 1/30", "1.0e-13", "2 s", "not reached"]]
    # beside integrators of this program too: theirs are the plan's own curves
    assert beside_ours(ALL + mine) == said
    assert beside_ours(ALL) == []
    (alone,) = beside_ours(mine[:2])
    assert alone.columns == ["mine:rk4, top/T=9", "error", "time"]
    assert alone.rows == [
        ["step 1/10", "1.0e-04", "12 ms"],
        ["step 1/30", "2.0e-10", "123 s"],
        ["order, finest two", "11.9", ""],
    ]


def test_seconds_that_are_not_resolved_are_printed_as_that_and_compared_with_nothing() -> None:
    quick = row("mine:rk4 step=1/100", -11, 1.4e-5)
    quick = msgspec.structs.replace(quick, seconds={**quick.seconds, "unresolved": 1e-4})
    slow = row("mine:rk4 step=1/300", -12, 0.5)
    rows = [*OURS, quick, slow]
    ((unresolved, resolved, order),) = ([line[1:] for line in table.rows] for table in beside_ours(rows))
    assert unresolved == ["1.0e-11", "< 0.1 ms", "-"]
    assert resolved == ["1.0e-12", "500 ms", "4 s"]
    assert order == ["2.1", "", ""]
    assert leads(rows) == []
    assert fastest([quick]) == Headline("The smallest error is 1e-11: mine:rk4 on top/T=9, in < 0.1 ms.")
    section = work_precision([("", report(*rows))])
    assert section is not None
    assert [cells[5] for cells in section.rows] == ["1", "4", "< 0.0001", "0.5"]
    assert "1e-12 in 500 ms" in section.pictures[0].description
    assert '"unresolved":0.0001' in msgspec.json.encode(quick).decode()


def test_the_order_of_a_method_with_a_tolerance_is_seen_in_its_mean_steps() -> None:
    def at(tolerance: str, log10: float, steps: int, samples: int = 10) -> Row:
        found = row(f"mine tolerance={tolerance}", log10, 1.0)
        return msgspec.structs.replace(found, steps=steps, samples=samples, order=5)

    (line,) = panels([at("1e-6", -5, 100), at("1e-8", -7, 251), at("eps", -14.9, 5000)])["top/T=9"]
    assert line.order_text == "5.0 (declared: 5)"
    # beside a step that is nearly equal, but where the error does not fall
    for log10, order in ((-6.9, 5.0), (-7.1, None)):
        (near,) = panels([at("1e-6", -5, 100), at("1e-7.9", log10, 250), at("1e-8", -7, 251)])["top/T=9"]
        assert near.order == (None if order is None else pytest.approx(order, abs=0.01))
    # as many steps as samples ask for; rounding; heyoka and multiword, whose order follows the tolerance
    (bounded,) = panels([at("1e-4", -3, 12), at("1e-6", -5, 100), at("eps", -14.9, 5000)])["top/T=9"]
    (ours,) = panels([msgspec.structs.replace(each, order=20) for each in OURS])["top/T=9"]
    words = [msgspec.structs.replace(row(f"multiword tolerance=1e-{n}", -n, 1.0), steps=10**n, order=9) for n in (3, 5)]
    (multiword,) = panels(words)["top/T=9"]
    assert bounded.order is ours.order is multiword.order is None


def test_no_order_is_read_where_the_motion_amplifies_rounding_to_the_error() -> None:
    """The rounding of an unstable motion, from which RK4 at 1/1000 gains no more, is no second order."""

    def at(step: str, log10: float, steps: int, factor: float) -> Row:
        made = row(f"mine step={step}", log10, 1.0)
        return msgspec.structs.replace(made, steps=steps, order=4, amplification=factor)

    points = ("1/50", -5.2, 500), ("1/100", -6.4, 1000), ("1/1000", -9.3, 10_000)
    for factor, order in ((7e4, "4.0"), (60.0, "2.9")):
        (line,) = panels([at(*point, factor) for point in points])["top/T=9"]
        assert line.order_text == f"{order} (declared: 4)"
