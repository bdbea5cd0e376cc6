"""Rows of another top or another start are never the same, nor better; numbers written otherwise are."""

from dataclasses import replace as change
from fractions import Fraction
from operator import itemgetter
from pathlib import Path

import msgspec
import pytest

from heavytop.cases import CASES
from heavytop.errors import InputError
from heavytop.features.score.measurement import measured
from heavytop.features.score.trajectories.observed import of_arrays
from heavytop.harness.rows import data_of
from heavytop.integrate.heyoka.motions import propagate
from heavytop.precision import DOUBLE, exact
from heavytop.records import Data, Law, Quantity, Row, Series
from support.reports import asked, drift, measure, replace, rows, store, table, tasks_of
from support.small_reports import judged, report, row

DATA = Data(("3", "2", "1/3"), "3/2", ("0", "1/5", "-1"), ("1/10", "0", "9/10"), ("3/5", "0", "-4/5"))
NAMES = ("inertia", "weight", "centre", "omega", "gamma")
LAW = Law("t^0.5", 16, 0.5, 0.47, 0.53, "100", "1e5", "1e-19", "1e30")


def changes(text: str) -> set[str]:
    number = exact(text)
    return {str(number + 1), str(number * (1 + exact("1e-60"))), str(number * exact("1e100"))} - {text}


def every_change() -> list[tuple[str, Data]]:
    found = []
    for name in NAMES:
        value = getattr(DATA, name)
        for place, text in enumerate([value] if isinstance(value, str) else value):
            for other in changes(text):
                new = other if isinstance(value, str) else (*value[:place], other, *value[place + 1 :])
                found.append((name, replace(DATA, **{name: new})))
        if not isinstance(value, str):
            found.append((name, replace(DATA, **{name: value[::-1]})))
    return found


@pytest.mark.parametrize("starts", [1, 16])
def test_another_number_anywhere_is_another_motion(starts: int) -> None:
    found = every_change()
    assert len(found) > 35
    for name, other in found:
        for old, new in ((DATA, other), (other, DATA)):
            verdict, why = judged(*(row(data=each, starts=starts) for each in (old, new)))
            assert (verdict, why.startswith(f"different data: {name} ")) == ("incomparable", True), (name, other, why)


def test_a_smaller_error_of_another_top_is_not_better() -> None:
    less = {"drift_energy_max": msgspec.structs.replace(row().metrics["drift_energy_max"], value="1e-15", log10=-15.0)}
    assert judged(row(data=DATA), row(data=DATA, metrics=less))[0] == "incomparable"  # the time of escape is missing
    other = replace(DATA, weight="2")
    assert judged(row(data=DATA), row(data=other, metrics=less))[1] == "different data: weight 3/2 → 2"


def test_the_same_numbers_written_otherwise_are_the_same() -> None:
    same = Data(("3.0", "2e0", "2/6"), "1.5", ("-0", "0.2", "-10e-1"), ("0.1", "0/7", "0.90"), ("0.6", "0", " -8/10"))
    assert judged(row(data=DATA), row(data=same)) == ("same", "")
    assert judged(row(data=same), row(data=DATA)) == ("same", "")


@pytest.mark.parametrize(("old", "new"), [(None, DATA), (DATA, None)])
def test_data_in_one_report_only_are_incomparable(old: Data | None, new: Data | None) -> None:
    who = "candidate" if old is None else "baseline"
    assert judged(row(data=old), row(data=new)) == (
        "incomparable",
        f"only the {who} contains its top and start",
    )
    assert judged(row(), row())[0] == "same"


def test_a_baseline_from_before_ensembles_named_their_start_is_compared_by_its_top() -> None:
    older = replace(DATA, omega=(), gamma=())
    old, new = row(data=older, starts=16), row(data=DATA, starts=16)
    assert judged(old, new)[0] == judged(old, old)[0] == "same"
    assert judged(new, old)[1].startswith("different data: omega 1/10, 0, 9/10 → none")
    assert judged(old, row(data=replace(DATA, weight="2"), starts=16))[0] == "incomparable"


@pytest.mark.parametrize(
    ("data", "starts", "field"),
    [
        (replace(DATA, inertia=("3", "2")), 1, "2 components of inertia"),
        (replace(DATA, centre=()), 1, "0 components of centre"),
        (replace(DATA, omega=(), gamma=()), 1, "0 components of omega"),
        (replace(DATA, gamma=("1", "0")), 16, "2 components of gamma"),
        (replace(DATA, gamma=()), 16, "an incomplete start"),
        (replace(DATA, weight="much"), 1, "much"),
        (replace(DATA, weight="1/0"), 1, "divides by zero"),
        (replace(DATA, centre=("nan", "0", "0")), 16, "nan"),
        (replace(DATA, inertia=("3", "0", "1")), 1, "not positive"),
        (replace(DATA, inertia=("3", "-2", "1")), 16, "not positive"),
        (replace(DATA, inertia=(" -3", "2", "1")), 1, "not positive"),
    ],
)
def test_data_that_no_run_writes_are_refused(tmp_path: Path, data: Data, starts: int, field: str) -> None:
    bad = row(data=data, starts=starts)
    file = store.write(report(row(case="lagrange"), bad), tmp_path)
    for read in (store.read, lambda path: list(store.read_brief(path).rows)):
        with pytest.raises(InputError, match=rf"row euler .*data: .*{field}"):
            read(file)
    assert judged(bad, bad)[0] == "incomparable"


@pytest.mark.parametrize("outcome", ["success", "step_limit"])
def test_a_law_stands_on_no_more_starts_than_its_row(tmp_path: Path, outcome: str) -> None:
    more = row(starts=16, outcome=outcome, laws={"drift_energy": replace(LAW, starts=17)})
    with pytest.raises(InputError, match="a law of 17 starts in a row of 16"):
        store.read(store.write(report(more), tmp_path))


@pytest.mark.parametrize("part", ["series", "laws"])
def test_a_series_and_a_law_are_of_the_quantity_that_they_were(part: str) -> None:
    found = {"series": Series(["1", "2"], ["1e-13", "1e-12"]), "laws": LAW}[part]
    two = [
        row(starts=16, **{part: {"drift_energy": replace(found, quantity=quantity)}})
        for quantity in (Quantity("drift", "energy"), Quantity("drift", "area"))
    ]
    assert judged(two[0], two[0])[0] == "same"
    assert judged(*two) == ("incomparable", "it is declared as a different quantity")


def own_top(centre: str, omega: str) -> str:
    """A plan of the drift of one's own top."""
    data = {"centre": [0, 0, centre], "omega": ["1/10", 0, omega], "gamma": ["3/5", 0, "4/5"]}
    return table("top", name="mine", inertia=[3, 2, 1], weight=1, **data) + drift("mine")


@pytest.mark.slow
def test_two_tops_of_one_name_in_two_plans_are_two(tmp_path: Path) -> None:
    def ran(centre: str, omega: str) -> Row:
        (task,) = tasks_of(tmp_path, own_top(centre, omega))
        return msgspec.structs.replace(measure(task), data=data_of(task.case))

    mine = ran("1/2", "9/10")
    assert judged(mine, ran("0.5", "0.90"))[0] == "same"
    assert judged(mine, ran("1/3", "9/10")) == ("incomparable", "different data: centre 0, 0, 1/2 → 0, 0, 1/3")
    assert judged(mine, ran("1/2", "4/5"))[0] == "incomparable"


@pytest.mark.slow
def test_every_row_of_a_motion_has_its_data_those_of_ensembles_too(tmp_path: Path) -> None:
    run = {"precision": "double", "horizon": "1", "samples": 4, "decades": 1, "starts": 8}
    tasks = tasks_of(tmp_path, own_top("1/2", "9/10") + asked("growth", "mine", runs=[run]))
    found = [each for _, each in sorted(rows(tasks, 1), key=itemgetter(0))]
    assert [(each.starts, each.data) for each in found] == [
        (starts, Data(("3", "2", "1"), "1", ("0", "0", "1/2"), ("1/10", "0", "9/10"), ("3/5", "0", "4/5")))
        for starts in (1, 8)
    ]
    assert judged(found[1], found[1])[0] == "same"


def test_a_scored_trajectory_has_its_data(tmp_path: Path) -> None:
    case = CASES["lagrange"]
    run = propagate(case.top, case.start, [Fraction(1), Fraction(2)], DOUBLE)
    other = change(case.top, weight=case.top.weight * 2)
    two = [
        measured(of_arrays(top, case.start, case.system, list(run.times), list(run.states), DOUBLE, "mine", "rk4")).row
        for top in (case.top, other)
    ]
    assert two[0].data == data_of(case)
    assert judged(two[0], two[0])[0] == "same"
    for pair in (two, two[::-1]):
        assert judged(*pair)[1].startswith("different data: weight")
