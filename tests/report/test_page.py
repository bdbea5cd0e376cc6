"""The page in Chromium, wide and narrow, light and dark; skipped where Chromium or its driver is not installed."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any

import pytest

import heavytop as ht
from heavytop.cases import CASES
from heavytop.features.score.measurement import Assessment, assess
from heavytop.features.score.text import score_report
from heavytop.features.score.trajectories.observed import of_arrays
from heavytop.precision import DOUBLE
from heavytop.records import Report, Row
from heavytop.report.compare.noise import Policy
from heavytop.report.render.history import history_page
from support.report_helpers import HOSTILE, error, full_report
from support.reports import compare, history, html, replace, store

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
pytestmark = [
    pytest.mark.pictures,
    pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="needs chromium and chromedriver on the PATH"),
]

FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--force-color-profile=srgb",
]
LEAST = {"text": 4.5, "large": 3.0, "drawing": 3.0}
"""Contrast that WCAG 2.2 AA asks for."""
PAGES = ("report", "results", "comparison")
ALL = (*PAGES, "peers", "gate", "score", "history")
RESULTS = Path(__file__).parents[2] / "results"
WIDTHS = (1280, 390)


_LOADED = "return document.readyState === 'complete'"


class Browser:
    """A window with what it logged and what it asked the network for."""

    def __init__(self, profile: Path) -> None:
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM or ""
        for flag in (*FLAGS, f"--user-data-dir={profile}"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(DRIVER))

    def look(self, width: int, scheme: str, media: str = "screen") -> None:
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": media, "features": features})

    def open(self, page: Path, width: int, scheme: str, media: str = "screen") -> None:
        from selenium.webdriver.support.ui import WebDriverWait

        self.look(width, scheme, media)
        for log in ("browser", "performance"):
            self.driver.get_log(log)
        self.driver.get(page.as_uri())
        WebDriverWait(self.driver, 60).until(lambda driver: driver.execute_script(_LOADED))

    def ask(self, script: str) -> Any:
        return self.driver.execute_script(script)

    def requests(self) -> list[str]:
        """Addresses that the page asked for, itself left out."""
        events = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        sent = [event["params"] for event in events if event["method"] == "Network.requestWillBeSent"]
        ours = [each for each in sent if each["documentURL"].startswith("file:")]
        assert ours
        return [each["request"]["url"] for each in ours if each["request"]["url"] != each["documentURL"]]


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    found = Browser(tmp_path_factory.mktemp("profile"))
    yield found
    found.driver.quit()


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")
    baseline, candidate = full_report(), full_report(HOSTILE)
    candidate.rows[5].metrics["solution_error_relative_max"] = error("1e-7")
    html.write_report(candidate, folder / "report.html")
    read = {name: store.read(RESULTS / name) for name in ("default", "growth", "peers")}
    cases = ("lagrange/T=1000", "lagrange/T=10000", "lagrange/T=5")  # of each picture one: 334 rows take long
    read["peers"] = replace(read["peers"], rows=[each for each in read["peers"].rows if each.case in cases])
    read |= {"gate": gate(read["default"], read["growth"], read["peers"])}
    read["default"] = replace(read["default"], rows=read["default"].rows[::5])
    html.write_report(read["default"], folder / "results.html")
    for name in ("peers", "gate"):
        html.write_report(read[name], folder / f"{name}.html")
    (folder / "score.html").write_text(html.report_page(score_report(scored(), {"commit": "0" * 40})), "utf-8")
    names = ["a", "b", "c"]
    older = replace(candidate, rows=candidate.rows[:6])
    tracks = history([baseline, candidate, older], Policy())
    (folder / "history.html").write_text(history_page(names, [baseline, candidate, older], tracks), "utf-8")
    (folder / "comparison.html").write_text(
        html.comparison_page(baseline, candidate, compare(baseline, candidate, Policy())), "utf-8"
    )
    return {name: folder / f"{name}.html" for name in ALL}


def gate(default: Report, growth: Report, peers: Report) -> Report:
    """An integrator of a user beside heyoka, as plan gate has it: drift, one schedule, growth."""
    drift = [each for each in default.rows if each.key.kind == "drift" and each.precision == "double"]
    work = [each for each in peers.rows if each.case == "lagrange/T=1000" and each.key.subject.name == "heyoka"]
    rows = [*drift, *work, growth.rows[0]]
    theirs = [mine(each) for each in (drift[0], work[0], growth.rows[0])]
    return replace(default, plan={"name": "gate"}, rows=[*rows, *theirs])


def mine(row: Row) -> Row:
    subject = replace(row.key.subject, name="mine:name", tolerance="eps")
    return replace(row, key=replace(row.key, subject=subject), integrator="mine:name")


def scored() -> Assessment:
    """A motion that is off by 1e-8 across the flow."""
    case = CASES["lagrange"]
    times = [Fraction(time) for time in range(1, 9)]
    run = ht.propagate(case.top, case.start, times, DOUBLE)
    states = [[float(value) + 1e-8 * (place == 2) for place, value in enumerate(state)] for state in run.states]
    return assess(of_arrays(case.top, case.start, case.system, times, states, DOUBLE, "mine", "rk4"))


UNFOLD = "document.querySelectorAll('details').forEach(each => each.open = true);"
OVERFLOW = """
const root = document.documentElement; // the row of links scrolls
const wide = [...document.querySelectorAll('body *')].filter(each =>
  !each.closest('svg') && !each.closest('.skip') && !each.closest('nav li') &&
  each.getBoundingClientRect().right > root.clientWidth + 0.5);
return [root.scrollWidth, root.clientWidth, wide.map(each => each.outerHTML.slice(0, 80))];
"""


CLIPPED = """
const seen = [...document.querySelectorAll('main *')].filter(each => !each.closest('svg') && each.checkVisibility());
const cut = seen.filter(each => each.scrollWidth > each.clientWidth + 1 && each.clientWidth > 0 &&
  (/^(TABLE|T[DH]|FIGURE)$/.test(each.tagName) || getComputedStyle(each).overflowX !== 'visible'));
const out = seen.filter(each => each.matches('td, th, table')).filter(each => {
  const own = each.getBoundingClientRect(), room = each.closest('details, section').getBoundingClientRect();
  return own.width > 0 && (own.right > room.right + 1 || own.left < room.left - 1) && !each.closest('thead');
});
return [...cut, ...out].map(each => each.outerHTML.slice(0, 120));
"""
OVERLAPPING = """
const bad = [];
for (const svg of document.querySelectorAll('main figure svg')) {
  const box = svg.getBoundingClientRect();
  const texts = [...svg.querySelectorAll('text')].map(each => [each.textContent, each.getBoundingClientRect()]);
  texts.forEach(([name, a], index) => {
    if (a.left < box.left - 1 || a.right > box.right + 1 || a.top < box.top - 1 || a.bottom > box.bottom + 1)
      bad.push(['outside', svg.firstChild.textContent, name]);
    for (const [other, b] of texts.slice(index + 1)) {
      const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      // the box of a line is a quarter higher than its letters
      if (across > 1 && down > 0.25 * Math.min(a.height, b.height))
        bad.push(['overlap', svg.firstChild.textContent, name, other]);
    }
  });
}
return bad;
"""


@pytest.mark.slow
@pytest.mark.parametrize("page", ALL)
def test_nothing_overflows_is_clipped_overlaps_errs_or_is_loaded(
    browser: Browser, pages: dict[str, Path], page: str
) -> None:
    browser.open(pages[page], WIDTHS[0], "light")
    for unfold, width in product(("", UNFOLD), WIDTHS):
        browser.look(width, "light")
        assert unfold or browser.ask(OVERLAPPING) == [], width
        needed, there, wide = browser.ask(unfold + OVERFLOW)
        assert (wide, not unfold or needed <= there) == ([], True), width
        assert not unfold or browser.ask(CLIPPED) == [], width
    assert browser.driver.get_log("browser") == []
    assert browser.requests() == []


CUT = "const table = document.querySelector('main table'), figure = document.querySelector('main figure');"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "finds"),
    [
        ("table.style.width = '1400px'; table.style.maxWidth = 'none';", "clipped"),
        ("table.parentElement.style.overflowX = 'auto'; table.style.minWidth = '1400px';", "clipped"),
        ("const [a, b] = figure.querySelectorAll('text'); b.setAttribute('x', a.getAttribute('x'));"
         " b.setAttribute('y', a.getAttribute('y')); b.removeAttribute('transform'); a.removeAttribute('transform');",
         "overlapping"),
        ("figure.querySelector('text').setAttribute('x', -200);"
         " figure.querySelector('text').removeAttribute('transform');", "overlapping"),
    ],
)  # fmt: skip
def test_what_is_clipped_or_overlaps_is_found(browser: Browser, pages: dict[str, Path], fault: str, finds: str) -> None:
    browser.open(pages["results"], 1280, "light")
    script = {"clipped": CLIPPED, "overlapping": OVERLAPPING}[finds]
    assert browser.ask(CUT + UNFOLD + fault + script) != []


PLOTS = """
return [...document.querySelectorAll('main figure svg')].map(svg => ({
  role: svg.getAttribute('role'),
  named: svg.getAttribute('aria-labelledby').split(' ').map(id => document.getElementById(id).textContent),
  labels: [...svg.querySelectorAll('.axis-label text')].map(each => each.textContent),
  texts: [...svg.querySelectorAll('text')].map(each => each.getBoundingClientRect()).map(r => [r.left, r.right]),
  box: [svg.getBoundingClientRect().left, svg.getBoundingClientRect().right],
}));
"""
UNITS = re.compile(
    r"case|digits right, of \d+|.+ \((bits|rad|1/time unit|units of ε|units of Ω and γ|units of the energy|s"
    r"|decimal digits|time units of the data)\)"
)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_every_plot_has_a_name_and_axes_with_units(browser: Browser, pages: dict[str, Path], page: str) -> None:
    browser.open(pages[page], 390, "light")
    found = browser.ask(PLOTS)
    assert len(found) > 5
    for plot in found:
        assert (plot["role"], list(map(bool, plot["named"]))) == ("img", [True, True])
        # the other axis of dots has the names of cases
        assert len(plot["labels"]) == 2 or plot["labels"][0].startswith("digits right, of ")
        assert all(UNITS.fullmatch(label) for label in plot["labels"]), plot["labels"]
        left, right = plot["box"]
        assert all(left <= a and b <= right for a, b in plot["texts"]), plot["named"]


COLOURS = """
const background = each => {
  for (; each; each = each.parentElement) {
    const colour = getComputedStyle(each).backgroundColor;
    if (colour !== 'rgba(0, 0, 0, 0)') return colour;
  }
  return 'none';
};
const seen = new Map();
const note = (front, back, kind, text) => seen.set([front, back, kind].join('|'), [front, back, kind, text]);
for (const each of document.querySelectorAll('body *')) {
  const own = [...each.childNodes].some(node => node.nodeType === 3 && node.data.trim());
  if (!own || !each.checkVisibility() || each.closest('title, desc')) continue;
  const style = getComputedStyle(each), size = parseFloat(style.fontSize);
  const large = size >= 24 || (size >= 18.66 && style.fontWeight >= 700);
  note(each.closest('svg') ? style.fill : style.color, background(each), large ? 'large' : 'text', each.textContent);
}
for (const each of document.querySelectorAll('figure svg path[style*="var(--c"], .legend svg *')) {
  const style = getComputedStyle(each);
  if (style.stroke !== 'none') note(style.stroke, background(each), 'drawing', each.outerHTML.slice(0, 80));
}
return [...seen.values()];
"""


def luminance(colour: str) -> float:
    """Relative luminance, WCAG 2.2."""
    parts = [float(part) / 255 for part in re.findall(r"[\d.]+", colour)[:3]]
    assert len(parts) == 3, colour
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_is_that_of_the_standard() -> None:
    assert contrast("rgb(0, 0, 0)", "rgb(255, 255, 255)") == pytest.approx(21)
    assert contrast("rgb(119, 119, 119)", "rgb(255, 255, 255)") == pytest.approx(4.48, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("page", ["report", "comparison"])
def test_contrast_is_enough_in_light_and_dark(browser: Browser, pages: dict[str, Path], page: str, scheme: str) -> None:
    browser.open(pages[page], 1280, scheme)
    found = browser.ask(UNFOLD + COLOURS)
    assert {kind for _, _, kind, _ in found} == {"text", "large", "drawing"}
    poor = [(kind, text, f, b) for f, b, kind, text in found if contrast(f, b) < LEAST[kind]]
    assert not poor
    dark = luminance(browser.ask("return getComputedStyle(document.body).backgroundColor")) < 0.2
    assert dark == (scheme == "dark")


@pytest.mark.slow
@pytest.mark.parametrize("page", ["report", "comparison"])
def test_a_hostile_name_is_text(browser: Browser, pages: dict[str, Path], page: str) -> None:
    browser.open(pages[page], 1280, "light")
    assert browser.ask("return [document.scripts.length, window.hacked === undefined]") == [0, True]
    browser.ask(UNFOLD)
    assert browser.ask("return document.body.innerText.includes('<script>window.hacked')")
    named = "return [...document.querySelectorAll('svg title')].some(each => each.textContent.includes('<script>'))"
    assert browser.ask(named)


@pytest.mark.slow
def test_on_paper_the_numbers_are_unfolded(browser: Browser, pages: dict[str, Path]) -> None:
    unseen = """return [...document.querySelectorAll('details.numbers table')].filter(
      each => !each.checkVisibility({contentVisibilityAuto: true})).length"""
    browser.open(pages["results"], 800, "light", "screen")
    assert browser.ask(unseen) > 0
    browser.open(pages["results"], 800, "light", "print")
    assert browser.ask(unseen) == 0


@pytest.mark.slow
def test_the_keyboard_reaches_the_content_first(browser: Browser, pages: dict[str, Path]) -> None:
    from selenium.webdriver.common.keys import Keys

    browser.open(pages["report"], 1280, "light")
    browser.driver.find_element("tag name", "body").send_keys(Keys.TAB)
    box = "const r = document.activeElement.getBoundingClientRect(); return [document.activeElement.className, r.left]"
    name, left = browser.ask(box)
    assert name == "skip"
    assert left >= 0
    browser.driver.switch_to.active_element.send_keys(Keys.ENTER)
    assert browser.ask("return document.activeElement.id") == "content"
