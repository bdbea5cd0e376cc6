"""Edits of a report, each weakening something: `python validation/edited_reports.py [EDITS] [SEED] [REPORT ...]`.

Reports are `results/default`, `results/growth` and `results/peers` where none is given, with as many edits each.  How
often is an edited report the same as the report, or better?  Exit code 1 where it ever is.
"""

from __future__ import annotations

import gzip
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from copy import deepcopy
from fractions import Fraction
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import msgspec

from heavytop.errors import InputError
from heavytop.precision import decimal_text, exact, log10
from heavytop.records import Against
from heavytop.report.compare.noise import Policy

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from support.reports import compare, store  # noqa: E402

Document = dict[str, Any]
Edit = Callable[[Document, Random], bool]
"""Edits a row; whether there was something in it to edit."""
LARGER = Fraction(10) ** 6
"""More than noise near a saddle explains."""


def _set(metric: Document, value: Fraction) -> None:
    text = decimal_text(value, 8)
    metric |= {"value": text, "log10": log10(exact(text))}


def _pick(row: Document, random: Random, wanted: Callable[[str, Document], Any]) -> Document | None:
    found = [metric for name, metric in row["metrics"].items() if wanted(name, metric)]
    return random.choice(found) if found else None


def _numbers(kind: str) -> Callable[[str, Document], bool]:
    return lambda _, metric: metric["kind"] == kind and metric["log10"] is not None


def error_larger(row: Document, random: Random) -> bool:
    metric = _pick(row, random, _numbers("error"))
    if metric:
        eps = Fraction(2) ** (1 - row["bits"]) * max(row["steps"], 1)
        _set(metric, max(exact(metric["value"]), eps) * LARGER)
    return bool(metric)


def error_excused_by_a_band(row: Document, random: Random) -> bool:
    metric = _pick(row, random, _numbers("error"))
    if metric:
        _set(metric, exact(metric["value"]) * 10**12)
        metric["band"] = random.choice([4.0, 20.0, 100.0])
    return bool(metric)


def all_errors_excused_by_bands(row: Document, random: Random) -> bool:
    metrics = [metric for name, metric in row["metrics"].items() if _numbers("error")(name, metric)]
    factor = 10 ** random.randint(3, 12)
    for metric in metrics:
        _set(metric, exact(metric["value"]) * factor)
        metric["band"] = 20.0
    return bool(metrics)


def error_excused_by_a_bound(row: Document, random: Random) -> bool:
    metric = _pick(row, random, _numbers("error"))
    if metric:
        metric["bound"] = metric["value"]
        _set(metric, exact(metric["value"]) * LARGER)
    return bool(metric)


def band_wider(row: Document, random: Random) -> bool:
    metric = _pick(row, random, lambda _, metric: metric["band"])
    if metric:
        metric["band"] = min(100.0, max(metric["band"], 0.05) * random.uniform(10, 50))
    return bool(metric)


def band_removed(row: Document, random: Random) -> bool:
    metric = _pick(row, random, lambda _, metric: metric["band"] and metric["log10"] is not None)
    if metric:
        metric["band"] = None
    return bool(metric)


def band_where_none_is_measured(row: Document, random: Random) -> bool:
    if row["measure"] in ("drift", "homoclinic", "growth", "break_away_law"):
        return False
    metric = _pick(row, random, _numbers("error"))
    if metric:
        metric["band"] = random.choice([0.5, 20.0])
    return bool(metric)


def unresolved(row: Document, random: Random) -> bool:
    metric = _pick(row, random, _numbers("error"))
    if metric:
        bound = max(exact(metric["value"]), Fraction(2) ** (1 - row["bits"]) * max(row["steps"], 1)) * LARGER
        metric |= {"value": "unresolved", "log10": None, "bound": decimal_text(bound, 3)}
    return bool(metric)


def no_number(row: Document, random: Random) -> bool:
    metric = _pick(row, random, _numbers("error"))
    if metric:
        metric |= {"value": random.choice(["nan", "missing"]), "log10": None}
        row["finite"] = random.random() < 0.5
    return bool(metric)


def kind_flipped(row: Document, random: Random) -> bool:
    metric = _pick(row, random, lambda *_: True)
    if metric:
        metric["kind"] = random.choice([kind for kind in ("error", "duration", "value") if kind != metric["kind"]])
    return bool(metric)


def log10_alone(row: Document, random: Random) -> bool:
    metric = _pick(row, random, lambda _, metric: metric["log10"] is not None)
    if metric:
        metric["log10"] += random.choice([-3.0, -0.01, 0.001, 2.0])
    return bool(metric)


def duration_shorter(row: Document, random: Random) -> bool:
    metric = _pick(row, random, _numbers("duration"))
    if metric:
        _set(metric, exact(metric["value"]) / random.choice([3, 10, 1000]))
    return bool(metric)


def value_changed(row: Document, random: Random) -> bool:
    metric = _pick(row, random, lambda name, metric: _numbers("value")(name, metric) and metric["value"] != "0")
    if metric:
        _set(metric, exact(metric["value"]) * random.choice([Fraction(1, 2), Fraction(3, 2), Fraction(101, 1)]))
    return bool(metric)


def verdict_turned(row: Document, random: Random) -> bool:
    if row["measure"] != "audit":
        return False
    metric = _pick(row, random, lambda *_: True)
    if metric:
        _set(metric, 1 - exact(metric["value"]))
    return bool(metric)


def metric_dropped(row: Document, random: Random) -> bool:
    return bool(row["metrics"]) and row["metrics"].pop(random.choice(list(row["metrics"]))) is not None


def series_dropped(row: Document, random: Random) -> bool:
    return bool(row["series"]) and row["series"].pop(random.choice(list(row["series"]))) is not None


def law_dropped(row: Document, random: Random) -> bool:
    return bool(row["laws"]) and row["laws"].pop(random.choice(list(row["laws"]))) is not None


def _one_series(row: Document, random: Random) -> Document | None:
    return random.choice(list(row["series"].values())) if row["series"] else None


def series_shorter(row: Document, random: Random) -> bool:
    series = _one_series(row, random)
    if series and len(series["times"]) > 1:
        at = random.randrange(len(series["times"]))
        del series["times"][at], series["values"][at]
        return True
    return False


def series_larger(row: Document, random: Random) -> bool:
    series = _one_series(row, random)
    if series is None:
        return False
    floor = Fraction(2) ** (1 - row["bits"]) * max(row["steps"], 1)
    series["values"] = [
        value if value in ("nan", "missing", "unresolved") else str(float(max(exact(value), floor) * LARGER))
        for value in series["values"]
    ]
    return any(value not in ("nan", "missing", "unresolved") for value in series["values"])


def series_without_its_end(row: Document, random: Random) -> bool:
    series = _one_series(row, random)
    if series is None:
        return False
    series["values"] = [*series["values"][:-1], random.choice(["nan", "missing"])]
    return row["finite"]


def not_finite_hidden(row: Document, random: Random) -> bool:
    hidden = [(name, series) for name, series in row["series"].items() if "nan" in series["values"]]
    for name, series in hidden:
        series["values"] = [value if value != "nan" else "1E-16" for value in series["values"]]
        if random.random() < 0.5:
            quantity = name.removeprefix("claim_evaluation_error_")
            row["metrics"][f"claim_evaluation_{quantity}_samples_not_finite"] |= {"value": "0", "log10": None}
    row["finite"] = True
    return bool(hidden)


def outcome(row: Document, random: Random) -> bool:
    row["outcome"] = random.choice(["step_limit", "time_limit", "non_finite", "incomplete", "fine"])
    return True


def not_finite(row: Document, _: Random) -> bool:
    was, row["finite"] = row["finite"], False
    return bool(was)


def horizon_shorter(row: Document, random: Random) -> bool:
    horizon = exact(row["horizon"]) / random.choice([2, 10])
    row["horizon"] = row["time_reached"] = decimal_text(horizon, 15)
    return horizon != 0


def reached_less(row: Document, _: Random) -> bool:
    row["time_reached"] = decimal_text(exact(row["horizon"]) / 2, 15)
    return row["horizon"] != "0"


def no_steps(row: Document, _: Random) -> bool:
    was, row["steps"] = row["steps"], 0
    return bool(was)


def more_steps(row: Document, random: Random) -> bool:
    row["steps"] *= random.choice([3, 100])
    return bool(row["steps"])


def more_evaluations(row: Document, random: Random) -> bool:
    was, row["evaluations"] = row["evaluations"], random.choice([None, (row["evaluations"] or 0) * 100])
    return bool(was)


def bits(row: Document, random: Random) -> bool:
    row["bits"] = random.choice([each for each in (24, 53, 64, 113) if each != row["bits"]])
    return True


def precision(row: Document, random: Random) -> bool:
    row["precision"] = random.choice([each for each in ("double", "quad", "real:90") if each != row["precision"]])
    return True


def starts_fewer(row: Document, _: Random) -> bool:
    was, row["starts"] = row["starts"], max(1, row["starts"] // 2)
    return bool(was > 1)


def samples_fewer(row: Document, random: Random) -> bool:
    was = row.get("samples", 0)
    held = max((len(series["times"]) for series in row["series"].values()), default=0)
    row["samples"] = random.choice([0, 1, was // 3, was - 1])
    # what the series hold is known, and samples that are steps may be fewer as these may
    return row["measure"] != "local_error" and was > max(1, held)


def start_failed(row: Document, random: Random) -> bool:
    metric = row["metrics"].get("starts_failed")
    if metric:
        _set(metric, Fraction(random.randint(1, 9)))
    return bool(metric)


def _reference(change: Callable[[Document], Any]) -> Edit:
    """Edits what a row was compared with, and the words that follow from it."""

    def edit(row: Document, _: Random) -> bool:
        was = deepcopy(row["reference"])
        change(row["reference"])
        row["against"] = msgspec.convert(row["reference"], Against).text
        return bool(was != row["reference"])

    return edit


def _certificates(**changes: Any) -> Edit:
    def change(reference: Document) -> None:
        for each in reference.get("certificates", []):
            each |= {name: value for name, value in changes.items() if each.get(name) is not None}

    return _reference(change)


def _computed(change: Callable[[Document], Document]) -> Edit:
    """Edits what is said of two computed runs that are the reference."""
    return _reference(lambda it: it.update(change(it)) if it["how"] == "computed" and it.get("until") else None)


def _radius(change: Callable[[str], str]) -> Edit:
    return _reference(
        lambda reference: reference.update(radius=change(reference["radius"])) if reference.get("radius") else None
    )


def _not_proven(reference: Document) -> None:
    for each in reference.get("certificates", []):
        each["proven"] = "computed"


def words_about_the_reference(row: Document, random: Random) -> bool:
    row["against"] = random.choice(["known: somebody", "nothing", row["against"][:-1]])
    return True


def flags(row: Document, random: Random) -> bool:
    name = random.choice(list(row["flags"])) if row["flags"] else None
    if name and random.random() < 0.5:
        del row["flags"][name]
    elif name:
        row["flags"][name] = "true" if row["flags"][name] == "false" else "1e-9"
    return name is not None


def order(row: Document, _: Random) -> bool:
    was, row["order"] = row["order"], 2
    return was not in (None, 2)


def rounding(row: Document, random: Random) -> bool:
    row["input_rounding"], was = random.choice([None, "1E-3"]), row["input_rounding"]
    return was is not None


def subject(row: Document, _: Random) -> bool:
    was, row["measured"] = row["measured"], "known: closed form"
    return bool(was)


def data_number(row: Document, random: Random) -> bool:
    """Another top or start under the same name: by a lot, or in a place that no format holds."""
    data = row["data"]
    if data is None:
        return False
    name = random.choice([name for name in ("inertia", "weight", "centre", "omega", "gamma") if data.get(name)])
    factor = random.choice([Fraction(2), Fraction(-1), 1 + Fraction(1, 10**40)])
    numbers = [data[name]] if name == "weight" else data[name]
    at = random.choice([place for place, text in enumerate(numbers) if exact(text) != 0] or [0])
    changed = [str(exact(text) * factor or 1) if place == at else text for place, text in enumerate(numbers)]
    data[name] = changed[0] if name == "weight" else changed
    return True


def data_permuted(row: Document, random: Random) -> bool:
    """The axes renamed in one of them alone."""
    data = row["data"] or {}
    name = random.choice([name for name in ("inertia", "centre", "omega", "gamma") if data.get(name)] or [""])
    if name:
        before, data[name] = data[name], [*data[name][1:], data[name][0]]
        return bool(before != data[name])
    return False


def data_dropped(row: Document, random: Random) -> bool:
    was, row["data"] = row["data"], None
    return was is not None


def data_without_a_start(row: Document, random: Random) -> bool:
    data = row["data"] or {}
    return bool([data.pop(name) for name in ("omega", "gamma") if data.get(name)])


def data_not_numbers(row: Document, random: Random) -> bool:
    if row["data"] is not None:
        row["data"]["inertia"][random.randrange(3)] = random.choice(["nan", "", "one", "1/0", "-2", "0"])
    return row["data"] is not None


def quantity_of_a_series(row: Document, random: Random) -> bool:
    series = _one_series(row, random)
    if series and series["quantity"]:
        series["quantity"]["name"] += "_of_another"
    return bool(series and series["quantity"])


def quantity_of_a_law(row: Document, random: Random) -> bool:
    law = random.choice(list(row["laws"].values())) if row["laws"] else None
    if law and law["quantity"]:
        law["quantity"]["component"] = "another"
    return bool(law and law["quantity"])


def _seconds(*names: str, factors: tuple[float, ...]) -> Edit:
    """Seconds of runs that were repeated for a comparison, times a factor; dropped for 0."""

    def edit(row: Document, random: Random) -> bool:
        factor, repeated = random.choice(factors), "band" in row["seconds"]
        for name in names if repeated else ():
            seconds = row["seconds"].pop(name)
            if factor:
                row["seconds"][name] = seconds * factor
        return repeated

    return edit


def _law(change: Callable[[Document, Random], Any]) -> Edit:
    def edit(row: Document, random: Random) -> bool:
        laws = [law for law in row["laws"].values() if law["low"] is not None]
        if not laws:
            return False
        law = random.choice(laws)
        before = dict(law)
        change(law, random)
        return law != before

    return edit


def _scaled(name: str, *factors: float) -> Callable[[Document, Random], None]:
    def change(law: Document, random: Random) -> None:
        if law[name] is not None:
            law[name] = f"{float(law[name]) * random.choice(factors):.3g}"

    return change


def _interval_by_itself(law: Document, random: Random) -> None:
    side = random.choice(["low", "high", "both"])
    # one side alone makes the whole more than 5 times as wide, more than a rerun ever is by chance
    part = random.choice([12, 40, 1000])
    if side in ("low", "both"):
        law["low"] -= part * (law["high"] - law["exponent"] + 0.01)
    if side in ("high", "both"):
        law["high"] += part * (law["exponent"] - law["low"] + 0.01)


def _next_class(law: Document, random: Random) -> None:
    names = ["bounded", "t^0.5", "t", "t^1.5", "t^2", "exponential"]
    at = names.index(law["growth"]) if law["growth"] in names else 5
    if at < 5:
        law["growth"] = names[random.randint(at + 1, 5)]
        if random.random() < 0.5:
            place = names.index(law["growth"]) / 2
            law |= {"exponent": place, "low": place - 0.1, "high": place + 0.1}


EDITS: dict[str, Edit] = {
    edit.__name__.replace("_", " "): edit
    for edit in (
        error_larger, error_excused_by_a_band, all_errors_excused_by_bands, error_excused_by_a_bound, band_wider,
        band_removed, band_where_none_is_measured, unresolved, no_number, kind_flipped, log10_alone, duration_shorter,
        value_changed, verdict_turned, metric_dropped, series_dropped, law_dropped, series_shorter, series_larger,
        series_without_its_end, not_finite_hidden, outcome, not_finite, horizon_shorter, reached_less, no_steps,
        more_steps, more_evaluations, bits, precision, starts_fewer, samples_fewer, start_failed, flags, order,
        rounding, subject, words_about_the_reference, data_number, data_permuted, data_dropped, data_without_a_start,
        data_not_numbers, quantity_of_a_series, quantity_of_a_law,
    )
} | {
    "slower": _seconds("run", "least", factors=(2.0, 5.0, 100.0, 1e6)),
    "median slower": _seconds("run", factors=(2.0, 100.0)),
    "fastest run slower": _seconds("least", factors=(2.0, 100.0)),
    "seconds dropped": _seconds("run", "least", "band", factors=(0.0,)),
    "scatter of the runs dropped": _seconds("band", factors=(0.0,)),
    "scatter of the runs wider": _seconds("band", factors=(30.0, 1000.0)),
    "reference computed": _reference(lambda it: it.update(how="computed") if it["how"] == "proven" else None),
    "reference not proven": _reference(_not_proven),
    "radius larger": _radius(lambda radius: f"{10**9 * float(radius)}"),
    "no radius": _radius(lambda _: ""),
    "digits fewer": _certificates(digits=5),
    "no certificate": _reference(lambda it: it.pop("certificates", None)),
    "certified at an earlier time": _certificates(time="1/99"),
    "starts not certified": _certificates(starts=3),
    "computed reference agrees less": _computed(lambda it: {"radius": f"{1e4 * float(it['radius'])}"}),
    "computed reference ends earlier": _computed(lambda it: {"until": f"{0.3 * float(it['until'])}"}),
    "computed reference is none": _computed(lambda it: dict.fromkeys(it, "") | {"how": "none", "reason": "lost"}),
    "exponent larger in a wide interval": _law(
        lambda law, _: law.update(exponent=law["exponent"] + 5, low=-50.0, high=50.0)
    ),
    "exponent larger": _law(lambda law, _: law.update({k: law[k] + 0.2 for k in ("exponent", "low", "high")})),
    "interval wider": _law(_interval_by_itself),
    "interval removed": _law(lambda law, _: law.update(exponent=None, low=None, high=None)),
    "class loosened": _law(_next_class),
    "class unresolved": _law(lambda law, _: law.update(growth="unresolved")),
    "law of fewer starts": _law(lambda law, random: law.update(starts=random.randint(0, law["starts"] - 1))),
    "detects less": _law(_scaled("detects", 100, 1e6, 1e15)),
    "detects unknown": _law(lambda law, _: law.update(detects=None)),
    "lost earlier": _law(_scaled("lost_at", 1e-3, 1e-6)),
    "span ends earlier": _law(_scaled("last", 1e-1, 1e-2)),
    "span begins later": _law(_scaled("first", 10, 1e6)),
}  # fmt: skip


def drop_row(document: Document, random: Random) -> None:
    document["rows"].pop(random.randrange(len(document["rows"])))


def repeat_row(document: Document, random: Random) -> None:
    document["rows"].append(deepcopy(random.choice(document["rows"])))


def edited(document: Document, random: Random) -> tuple[str, Document]:
    """The name of an edit, and the document with it."""
    names = [*EDITS, "row dropped", "row twice"]
    while True:
        name = random.choice(names)
        changed = {**document, "rows": list(document["rows"])}
        if name.startswith("row "):
            (drop_row if name == "row dropped" else repeat_row)(changed, random)
            return name, changed
        at = random.randrange(len(changed["rows"]))
        changed["rows"][at] = deepcopy(changed["rows"][at])
        if EDITS[name](changed["rows"][at], random):
            assert changed["rows"][at] != document["rows"][at], f"{name} edits nothing"
            return name, changed


def verdict(baseline: Path, folder: Path, changed: Document) -> str:
    """What a comparison says of the edited report, ``refused`` where it cannot be read."""
    (folder / store.FILE).write_bytes(msgspec.json.encode(changed))
    try:
        return compare(store.read_brief(baseline), store.read_brief(folder), Policy(), list_same=False).verdict
    except InputError:
        return "refused"


def document_of(baseline: Path) -> Document:
    """The report at ``baseline``, with seconds as of a plan with ``timings = true``."""
    packed = baseline / f"{store.FILE}.gz"
    content = gzip.decompress(packed.read_bytes()) if packed.exists() else (baseline / store.FILE).read_bytes()
    document: Document = msgspec.json.decode(content)
    for row in document["rows"]:
        if row["measure"] == "work_precision" and row["seconds"].get("run"):
            row["seconds"]["band"] = 0.03
    return document


def trials(baseline: Path, folder: Path, seed: int, count: int) -> Iterator[tuple[str, str]]:
    """``count`` edits, each of three rows of the report at ``baseline``, and what a comparison says of each."""
    random, document = Random(seed), document_of(baseline)
    kept = [row for row in document["rows"] if row["outcome"] == "success"]
    start = folder / "baseline"
    start.mkdir()
    for _ in range(count):
        few = {**document, "rows": random.sample(kept, min(3, len(kept)))}
        (start / store.FILE).write_bytes(msgspec.json.encode(few))
        assert verdict(start, folder, few) == "same"
        name, changed = edited(few, random)
        yield name, verdict(start, folder, changed)


def main(count: int, seed: int, reports: list[Path]) -> int:
    passed = Counter()
    for report in reports:
        seen = Counter()
        with TemporaryDirectory() as folder:
            for name, verdict in trials(report, Path(folder), seed, count):
                seen[verdict] += 1
                if verdict in ("same", "better"):
                    passed[name] += 1
        print(f"{report.name}: {dict(seen)}", flush=True)
    print(f"passed: {sum(passed.values())} of {count * len(reports)} {dict(passed) or ''}")
    return int(bool(passed))


if __name__ == "__main__":
    count, seed = (int(text) for text in (sys.argv[1:3] + ["500", "1"][len(sys.argv) - 1 :])[:2])
    chosen = [Path(text) for text in sys.argv[3:]]
    sys.exit(main(count, seed, chosen or [ROOT / "results" / name for name in ("default", "growth", "peers")]))
