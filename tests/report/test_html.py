"""The page of a report and of a comparison, read as text; test_page.py looks at it in a browser."""

import math
import re
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import pytest

from heavytop.errors import InputError
from heavytop.features.kinds import KINDS
from heavytop.integrate.registry import is_third_party
from heavytop.measure.scalar import RELATIVE
from heavytop.records import SCHEMA, Against, Law, Metric, Report, Row, Series
from heavytop.report.compare.noise import Policy
from heavytop.report.document.document import MOST_PLOTS, Card, Headline, In, Section, Word, points
from heavytop.report.document.kind import document
from heavytop.report.document.svg import apart, decades, finish, new_axes
from heavytop.report.render import plots
from heavytop.report.render.page import MOST_ROWS, digits_headline, digits_until, laws_headlines
from support.report_helpers import HOSTILE, TIMES, claim_rows, error, full_report, power, row, work
from support.reports import compare, html, replace, store

pytestmark = [pytest.mark.slow, pytest.mark.pictures]

RESULTS = Path(__file__).parents[2] / "results" / "default"


class Page(HTMLParser):
    """Tags with their attributes, in order, and the text outside of <style>."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self._in: list[str] = []
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self._in.append(tag)

    def handle_endtag(self, tag):
        if tag in self._in:
            del self._in[len(self._in) - 1 - self._in[::-1].index(tag) :]

    def handle_data(self, data):
        if "style" not in self._in:
            self.text += data

    def all(self, name: str) -> list[dict[str, str | None]]:
        return [attributes for tag, attributes in self.tags if tag == name]


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Page]:
    folder = tmp_path_factory.mktemp("pages")
    baseline, candidate = full_report(), full_report(HOSTILE)
    candidate.rows[5].metrics["solution_error_relative_max"] = error("1e-7")
    html.write_report(candidate, folder / "report.html")
    results = store.read(RESULTS)
    looked_at = [results.rows[4], results.rows[-10]]
    html.write_report(replace(results, rows=[*results.rows[::6], *looked_at]), folder / "results.html")
    two = [replace(r, rows=[o for o in r.rows if not is_third_party(o.integrator)]) for r in (baseline, candidate)]
    (folder / "comparison.html").write_text(html.comparison_page(*two, compare(*two, Policy())), "utf-8")
    return {path.stem: Page(path) for path in folder.glob("*.html")}


NAMES = pytest.mark.parametrize("name", ["report", "results", "comparison"])


@NAMES
def test_the_page_stands_alone(pages: dict[str, Page], name: str) -> None:
    page = pages[name]
    assert not page.all("script")
    links = [value for _, tags in page.tags for key, value in tags.items() if key in ("href", "src", "xlink:href")]
    assert links
    assert all(value and value.startswith(("#", "data:,")) for value in links)
    assert not [key for _, tags in page.tags for key in tags if key.startswith("on")]


@NAMES
def test_ids_are_unique_and_whatever_is_referred_to_exists(pages: dict[str, Page], name: str) -> None:
    page = pages[name]
    ids = [tags["id"] for _, tags in page.tags if "id" in tags]
    assert len(ids) == len(set(ids))
    wanted = {value[1:] for _, tags in page.tags for k, value in tags.items() if k == "href" and value[0] == "#"}
    for _, tags in page.tags:
        wanted |= set((tags.get("aria-labelledby") or "").split())
        wanted |= set(re.findall(r"url\(#([^)]+)\)", " ".join(value or "" for value in tags.values())))
    assert wanted <= set(ids)


@NAMES
def test_headings_are_in_order_and_tables_have_headers(pages: dict[str, Page], name: str) -> None:
    levels = [int(tag[1]) for tag, _ in pages[name].tags if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert all(b <= a + 1 for a, b in pairwise(levels))
    assert all(tags.get("scope") in ("col", "row") for tags in pages[name].all("th"))
    assert {"main", "header", "nav", "footer"} <= {tag for tag, _ in pages[name].tags}


def section_of(name: str, report: Report) -> Section | None:
    return next((section for section in html.sections([("", report)]) if section.id == name), None)


def test_the_verdict_comes_first_then_the_sections_in_their_order(pages: dict[str, Page]) -> None:
    sections = "verdict digits claim-error growth break-away work-precision method-growth rows environment reproduce"
    assert [tags["id"] for tags in pages["report"].all("section")] == sections.split()


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        ("refuted", "motion of the heavy top (γ ∥ M); it holds for the gyrostat."),
        ("holds", "every equation is proven."),
        ("undecided", "not refuted, but not every equation is proven."),
    ],
)
def test_the_headline_says_what_the_audit_found(tmp_path: Path, verdict: str, words: str) -> None:
    report = replace(full_report(), rows=claim_rows(verdict))
    rows = [row for row in report.rows if row.measure == "audit"]
    headline, *_, card = KINDS["audit"].document(rows)
    assert headline.word == card.lines[1].word == Word(verdict)
    assert card.lines[1].text.endswith(", 1 refuted: (1.2)" if verdict == "refuted" else "equations proven")
    assert words in headline.text
    if verdict == "refuted":
        html.write_report(report, tmp_path / "page.html")
        assert words in Page(tmp_path / "page.html").text


def test_no_claim_no_verdict_on_one() -> None:
    assert list(KINDS["audit"].document([])) == []
    page = html.report_page(Report("", {}, {}, [row()]))
    said = "heyoka in double: 10.0 of 16 digits right to T = 1000 (euler)."
    assert f'<h2 id="verdict-heading">{said}</h2>' in page
    assert "claim" not in page[page.index("<main") : page.index("</main")]


def test_how_wrong_and_from_when_on(pages: dict[str, Page]) -> None:
    rows = [row for row in full_report().rows if row.measure == "claim_model"]
    (card,) = (block for block in KINDS["claim_model"].document(rows) if isinstance(block, Card))
    assert card.title == "c-2, smooth branch: wrong from"
    assert card.lines[0].text == "|t| = 0.24"
    assert card.lines[1].text.endswith("up to |t| = 8 is 0.25.")
    assert card.table.rows == [("0.1", "0.0025", "0.05"), ("1", "0.17", "0.34")]
    assert "|t| = 0.24" in pages["report"].text


@pytest.mark.usefixtures("undrawn")
def test_a_run_that_failed_is_a_verdict_and_no_number(pages: dict[str, Page]) -> None:
    assert "15 of 17 measurements succeeded" in pages["report"].text
    assert "Failed measurements" in pages["report"].text
    section = section_of("digits", full_report())
    right = section.columns.index("digits right")
    said = {(line[0], line[1]): line[right] for line in section.rows}
    assert said["lagrange", "double"] == "time_limit"
    assert said["euler", "quad"] == "30.0"
    double = section.pictures[0]
    assert double.title == "Digits right in double"
    assert "lagrange: time_limit." in double.description


def test_hostile_names_are_text_cut_where_they_are_long(pages: dict[str, Page]) -> None:
    for name in ("report", "comparison"):
        assert "<script>window.hacked" in pages[name].text
        assert "x" * 200 not in pages[name].text
        assert "characters)" in pages[name].text
        assert "\x00" not in pages[name].text


def test_the_same_report_gives_the_same_bytes(tmp_path: Path) -> None:
    report = full_report()
    for name in ("a", "b"):
        html.write_report(replace(report, rows=report.rows[::3]), tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.usefixtures("undrawn")
def test_of_many_rows_the_first_and_the_worst_are_shown() -> None:
    rows = [row(case=f"case {number}") for number in range(MOST_ROWS + 100)]
    rows[MOST_ROWS + 20] = row(case="late failure", outcome="time_limit")
    rows[MOST_ROWS + 50] = row(case="fewest digits", metrics={"solution_error_relative_max": error("1e-3")})
    shown, left_out = html.detailed(rows)
    assert len(shown) + left_out == len(rows)
    assert [each.case for each in shown[MOST_ROWS:]][:2] == ["late failure", "fewest digits"]
    assert html.detailed(rows[:10]) == (rows[:10], 0)


@pytest.mark.usefixtures("undrawn")
def test_what_is_not_drawn_is_said() -> None:
    report = Report("", {}, {}, [row(case=f"case {number}") for number in range(50)])
    section = html.sections([("", report)])
    assert [each.id for each in section] == ["digits", "growth"]
    assert section[0].notes == ["10 more runs in the numbers alone."]
    assert len(section[1].pictures) == 3 * MOST_PLOTS
    assert f"{50 - MOST_PLOTS} more cases not drawn" in section[1].notes[0]


@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.5])
def test_a_law_lies_on_the_samples_that_follow_it(exponent: float) -> None:
    x, y = points(power(exponent, 1e-16))
    line = plots.through(Law("t", 8, exponent), exponent, list(zip(x, y, strict=True)), x)
    assert line == pytest.approx(y, abs=1e-5)


def test_an_exponential_law_is_one_in_time_and_not_in_its_logarithm() -> None:
    rate = 0.25
    x = [math.log10(float(time)) for time in TIMES]
    y = [-16 + rate * float(time) * math.log10(math.e) for time in TIMES]
    line = plots.through(Law("exponential", 8, rate), rate, list(zip(x, y, strict=True)), x)
    assert line == pytest.approx(y)


def test_a_law_is_in_the_legend_and_in_the_numbers() -> None:
    section = section_of("growth", full_report())
    assert "fitted law" in section.legend
    along, drift = section.pictures[1], section.pictures[0]
    assert ">t^1.5 (1.50)</text>" in along.svg
    assert "double: t^1.5, exponent 1.50 [1.40, 1.60]." in along.description
    assert "(1.50)" not in drift.svg
    lines = {tuple(line[:3]): line[6:8] for line in section.rows}
    assert lines["euler", "double", "error along"] == ["t^1.5", "1.50 [1.40, 1.60]"]
    assert lines["euler", "double", "drift of energy"] == ["", ""]


def test_work_and_precision_says_what_is_faster_and_what_failed(pages: dict[str, Page]) -> None:
    section = section_of("work-precision", full_report())
    (lead,) = section.answers.rows
    assert lead[:-3] == ["euler/T=1000", "1e-10", "heyoka double", "2 ms", "peer:A", "6 ms"]
    assert lead[-3:] == ["3.0\N{NO-BREAK SPACE}×", "", ""]
    assert "peer:A" in pages["report"].text
    assert not section.legend
    euler, lagrange = section.pictures
    assert all(f">{name}</text>" in euler.svg for name in ("heyoka double", "peer:A", "peer:B, × aborted"))
    assert all(f">{name}</text>" in lagrange.svg for name in ("cyrk:DOP853", "splitting:4"))
    assert "peer:B: aborted (1)." in euler.description
    assert section_of("work-precision", Report("", {}, {}, [row()])) is None
    assert "1 run of work against precision aborted" in pages["report"].text


@pytest.mark.usefixtures("undrawn")
def test_rows_without_a_number_anywhere_make_a_page_all_the_same(tmp_path: Path) -> None:
    words = ("nan", "0", "unresolved", "missing")
    rows = []
    for word in words:
        for each in full_report().rows:
            series = {name: Series(held.times, [word] * len(held.times)) for name, held in each.series.items()}
            metrics = {
                name: Metric(word, None) if metric.kind == "error" and "break" not in name else metric
                for name, metric in each.metrics.items()
            }
            rows.append(replace(each, case=f"{each.case} {word}", series=series, metrics=metrics))
    rows += [row(case="empty", series={"drift_energy": Series([], [])}, metrics={}, horizon="0")]
    html.write_report(Report(SCHEMA, {}, {}, rows), tmp_path / "page.html")
    assert len(Page(tmp_path / "page.html").all("section")) > 3


def test_a_comparison_draws_both_and_lists_the_worst_first(pages: dict[str, Page]) -> None:
    text = pages["comparison"].text
    assert "double, baseline" in text
    assert "double, candidate" in text
    assert "Not everything could be compared" not in text
    assert "Something is worse than in the baseline." in text
    table = text[text.index("worst first") :]
    assert "digits right 10.0 → 7.0" in table
    assert "bits lost" in table
    assert text.index("Digits right 10.0 → 7.0 on euler up to T = 1000 (heyoka, double)") < text.index("worst first")


@pytest.mark.usefixtures("undrawn")
def test_a_comparison_of_a_report_with_itself_says_so() -> None:
    report = full_report()
    report = replace(report, rows=[each for each in report.rows if each.outcome == "success"])
    page = html.comparison_page(report, report, compare(report, report, Policy()))
    assert "Every metric of every row is the same." in page


def test_how_to_reproduce_names_the_plan_only_where_it_is_built_in() -> None:
    report = full_report("smoke")
    assert "--plan smoke " in html.commands(report)[3]
    assert "--plan FILE.toml " in html.commands(full_report(HOSTILE))[3]
    assert "--plan 'my plan.toml' " in html.commands(replace(report, plan={"name": "x", "file": "my plan.toml"}))[3]
    assert html.commands(report)[0] == f"git checkout {'0' * 40}"
    unknown = replace(report, environment={"packages": {"heavytop": "0.1.0"}, "commit": None})
    assert html.commands(unknown)[0] == "# heavytop 0.1.0"


@pytest.mark.usefixtures("undrawn")
def test_a_page_that_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        html.write_report(full_report(), tmp_path / "none" / "page.html")
    assert not list(tmp_path.iterdir())


def test_every_number_of_the_results_is_in_the_page(pages: dict[str, Page]) -> None:
    report = store.read(RESULTS)
    for each in (report.rows[4], report.rows[-10]):
        for metric in each.metrics.values():
            assert metric.value in pages["results"].text


def test_every_rung_has_its_marker_and_one_alone_is_seen() -> None:
    rungs = [work("heyoka tolerance=1e-8", f"{n}e-9", 0.001) for n in range(10, 20)]
    alone = work("mpmath:odefun tolerance=eps", "1e-60", 6.0, precision="real:237", bits=237)
    (picture,) = section_of("work-precision", Report("", {}, {}, [*rungs, alone])).pictures
    data = picture.svg.replace("><", ">\n<")
    # markers are used shapes; the ticks of the axes are too, and black
    assert len(re.findall(r"<use [^>]*fill: var\(--c0\)", data)) == len(rungs)
    assert len(re.findall(r"<use [^>]*fill: var\(--c1\)", data)) == 1


@pytest.mark.parametrize(
    ("low", "high", "words"), [(-20, 0, {"10⁻¹⁵", "1"}), (-4.4, -3.9, {"10⁻⁵", "10⁻⁴"}), (-1000, -990, {"10⁻⁹⁹⁶"})]
)
def test_ticks_of_long_and_short_logarithmic_axes(low: float, high: float, words: set[str]) -> None:
    axes = new_axes("x", "y")
    decades(axes.xaxis)
    axes.set_xlim(low, high)
    finish(axes, "title", "description", "name")
    found = [tick.get_text() for tick in axes.get_xticklabels()]
    assert words <= set(found)
    assert len(set(found)) == len(found)


def test_the_digits_of_an_integrator_stand_beside_those_of_heyoka() -> None:
    mine = row(integrator="mine:rk", metrics={RELATIVE.text: error("1e-4")})
    alone = row(case="far", horizon="9000", integrator="mine:rk", metrics={RELATIVE.text: error("1e-2")})
    said = "mine:rk in double: 4.0 of 16 digits right to T = 1000 (euler); heyoka: 10.0."
    assert digits_headline([row(), mine, alone]).text == said
    only = {"solution_error_omega_max": error("1e-5"), "solution_error_gamma_max": error("1e-3")}
    for rows, said in (
        ([row(horizon="10"), row()], "10.0 of 16 digits right to T = 1000 (euler)."),
        ([row(), row(case="b")], "10.0 of 16 digits right to T = 1000 (euler, worst of 2)."),
        ([row(metrics=only)], "at least 3.0 of 16 digits right to T = 1000 (euler)."),
    ):
        assert digits_headline(rows).text == f"heyoka in double: {said}"
    assert digits_headline([row(outcome="time_limit")]) is None


@pytest.mark.parametrize(
    ("until", "named"), [("700", "), none on chaos."), ("1000", "), none on chaos."), ("1001", ").")]
)
def test_a_headline_names_a_motion_that_has_lost_all_digits_by_its_horizon(until: str, named: str) -> None:
    lost = row(case="chaos", horizon="2000", reference=Against("proven", until=until))
    said = "heyoka in double: 10.0 of 16 digits right to T = 1000 (euler"
    assert digits_headline([row(), lost]).text == said + named


@pytest.mark.parametrize(
    ("omega", "gamma", "text"),
    [
        (["1e-9", "1e-5", "0.9", "2", "0.1"], ["1e-8", "unresolved", "0.99", "1.2", "1.9"], "lost 300–400"),
        (["1e-9", "1.5", "2", "2", "0.1"], ["1e-8", "1e-4", "0.3", "nan", "0.9"], "lost 100–400"),
        (["1e-9", "1e-5", "0.1", "0.1", "0.1"], ["0", "1e-4", "0.1", "0.1", "0.1"], "lost 500–700"),
        (["9"] * 5, ["1"] * 5, "lost 100"),
        ([], [], "lost 700"),
    ],
)
def test_digits_are_lost_between_the_last_small_error_and_the_first_of_gamma_that_is_1(omega, gamma, text) -> None:
    errors = {"solution_error_omega": omega, "solution_error_gamma": gamma}
    times = [str(-100 * number) for number in range(1, 6)]
    series = {name: Series(times[: len(values)], values) for name, values in errors.items()}
    metrics = {RELATIVE.text: error("2")}
    assert digits_until(row(reference=Against("computed", until="-700"), metrics=metrics, series=series)) == text


@pytest.mark.parametrize(("law", "told"), [("t", 1), ("t^1.5", 0)])
def test_whether_planted_faults_are_told_opens_the_page_of_growth(law: str, told: int) -> None:
    healthy = row(measure="growth", starts=32)
    faulty = row(measure="growth", starts=32, laws={"solution_error_along": Law(law, 32, 1.0, 0.9, 1.1)})
    subject = replace(faulty.key.subject, bias="1e-12")
    faulty = replace(faulty, key=replace(faulty.key, subject=subject))
    assert (
        laws_headlines([healthy, faulty])[-1].text
        == f"Errors along the flow grow like t^1.5; {told} of 1 with I1 off by 1e-12 show another law."
    )
    mine = replace(faulty, key=replace(healthy.key, subject=replace(healthy.key.subject, name="mine:rk")))
    assert laws_headlines([healthy, mine]) == [Headline(f"Errors of mine:rk along the flow grow like {law}.")]


def test_regular_and_unstable_motions_stand_side_by_side_at_the_head_of_the_page_of_growth() -> None:
    regular = row(measure="growth", starts=32)
    unstable = row(measure="growth", starts=32, laws={"solution_error_along": Law("exponential", 32, 0.5, 0.4, 0.6)})
    for rows, said in (
        ([unstable, unstable, regular], "like t^1.5 (1 of 3 ensembles) or exponentially (2)."),
        ([unstable, regular, regular, regular], "like t^1.5 (3 of 4 ensembles)."),
    ):
        assert laws_headlines(rows)[0].text == f"Errors along the flow grow {said}"


def headline_of(kind: str, rows: list[Row]) -> str:
    return next(block.text for block in KINDS[kind].document(rows) if isinstance(block, Headline))


ALONE = {
    "claim_model": "The claimed Ω is off by 1 % of α = Ω3(0) I3/I1 from |t| = 0.002 on (ershkov-partial-6/forward, "
    "printed).",
    "claim_evaluation": "In double the printed form is off by up to 1.11e-7 in Ω "
    "(ershkov-partial-6/backward) while Ω is finite, before |t| = 142, "
    "ψ not finite from |t| = 7.4; the stable form is off by up to 1.03e-15 in Ω "
    "(ershkov-partial-6/forward), finite throughout.",
    "homoclinic": "heyoka stays on a homoclinic motion up to |t| = 12.3 to 63 in double, 62.8 to 321 in real:237.",
    "break_away_law": "Each bit of the format delays the escape by 0.27 to 1.4 time units: "
    "ln 2 / growth rate at the saddle, within 19 %.",
}


@pytest.fixture(scope="module")
def default() -> Report:
    return store.read(RESULTS)


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("kind", ALONE)
def test_rows_of_one_kind_alone_open_their_page_with_their_answer(default: Report, kind: str) -> None:
    rows = [each for each in default.rows if each.key.kind == kind]
    assert headline_of(kind, rows) == ALONE[kind]
    page = re.sub("<span.*?>|</span>", "", html.report_page(Report("", {}, {}, rows)))
    assert f"{ALONE[kind]}</h2>" in page
    none = [replace(each, metrics={}, outcome="failed") for each in rows]
    assert document(Report("", {}, {}, none), KINDS, In.PAGE) == {}


@pytest.mark.usefixtures("undrawn")
def test_kinds_that_are_mixed_answer_in_order(default: Report) -> None:
    page = re.sub("<span.*?>|</span>", "", html.report_page(Report("", {}, {}, default.rows[::-1])))
    opened, *others = re.findall(
        r'<h2 id="verdict-heading"[^>]*>([^<]+)</h2>|<p>([^<]+)</p>', page.partition('<div class="cards">')[0]
    )
    assert opened[0] == "heyoka in double: 8.7 of 16 digits right to T = 1e5 (lagrange), none on generic."
    said = [other[1].strip() for other in others]
    assert said[0].endswith("it holds for the gyrostat.")
    kinds = ("claim_model", "homoclinic", "break_away_law", "claim_evaluation")
    assert said[1:] == [ALONE[kind] for kind in kinds]


def test_homoclinic_motions_of_others_stand_beside_those_of_heyoka(default: Report) -> None:
    ours = [each for each in default.rows if each.key.kind == "homoclinic" and each.key.case == "delone"]
    theirs = replace(ours[0], key=replace(ours[0].key, subject=replace(ours[0].key.subject, name="mine:x")))
    never = replace(theirs.metrics["break_away_time"], value="never", log10=None)
    found = headline_of("homoclinic", [*ours, replace(theirs, metrics={"break_away_time": never})])
    stays = f"mine:x stays on delone up to |t| = {float(theirs.horizon):.3g} in double"
    assert found == f"{stays}; heyoka to 33.6 in double, 179 in real:237."


def test_local_errors_alone_open_and_fill_their_page() -> None:
    metrics = {f"local_error_ulp_{part}": error(size) for part, size in (("max", "3.25"), ("rms", "1"))}
    metrics["observed_order"] = Metric("4", 0.6)
    mine = replace(row(measure="local_error", integrator="mine:rk", metrics=metrics), order=5)
    ours = row(measure="local_error", metrics={"local_error_ulp_max": error("9")})
    page = html.report_page(Report("", {}, {}, [ours, mine]))
    said = "euler mine:rk in double: one step errs by at most 7.2e-16; order 4 in single steps."
    assert f">{said}</h2>" in re.sub("<span.*?>|</span>", "", page)
    assert all(f">{cell}</td>" in page for cell in ("3.25", "4", "5"))


def test_work_without_heyoka_opens_with_the_least_error() -> None:
    rows = [
        row(measure="work_precision", integrator="mine:rk", metrics={"error_max": error(size)})
        for size in ("1e-3", "2e-6")
    ]
    rows = [replace(each, seconds={"least": 0.25}) for each in rows]
    assert headline_of("work_precision", rows) == "The smallest error is 2e-6: mine:rk on euler, in 250 ms."


def test_one_chart_a_case_and_quantity_has_all_variants_with_their_laws() -> None:
    healthy = row(measure="growth")
    slow = replace(healthy, laws={"solution_error_along": Law("t^2", 32, 2.0, 1.9, 2.1)})
    slow = replace(slow, key=replace(slow.key, subject=replace(slow.key.subject, tolerance="1e-9")))
    section = section_of("growth", Report("", {}, {}, [healthy, slow]))
    assert [picture.title.partition(":")[0] for picture in section.pictures] == ["euler"] * 3
    assert all(f">{law}</text>" in section.pictures[1].svg for law in ("t^1.5 (1.50)", "t^2 (2.00)"))
    assert list(section.legend) == ["double", "double, tolerance 1e-9", "fitted law"]


@pytest.mark.parametrize("heights", [[0.0, 0.1, 0.2, 5.0], [9.9, 10.0, 10.0], [0.0] * 5, [3.0]])
def test_names_beside_curves_are_apart_and_on_the_axes(heights: list[float]) -> None:
    placed = apart(heights, 1.0, 0.0, 10.0)
    assert all(b - a >= 1 - 1e-9 for a, b in pairwise(placed))
    assert placed[0] >= 0
    assert placed[-1] <= 10
    assert apart([1.0, 3.0], 1.0, 0.0, 10.0) == [1.0, 3.0]


@pytest.mark.slow
def test_a_chart_of_drift_names_the_integral_and_says_how_many_samples_it_shows() -> None:
    whole = store.read(RESULTS)
    rows = [drift for drift in whole.rows if drift.key.kind == "drift" and drift.outcome == "success"][:1]
    (errors,) = (part for part in html.sections([("", replace(whole, rows=rows))]) if part.id == "growth")
    assert errors.pictures[0].title.startswith(f"{rows[0].case}: drift of ")
    assert errors.pictures[0].title.rpartition("drift of ")[2] in {"energy", "M·γ", "|γ|²", "|M|²", "Ω3", "Ω1", "Ω2"}
    kept = len(next(iter(rows[0].series.values())).times)
    said = f"Curves show {kept} of {rows[0].samples} samples, evenly in log |t|: a larger error"
    assert any(note.startswith(said) for note in errors.notes)
