"""Sweeps: what they expand to, that nothing is made before its turn, what is refused."""

import re
import tracemalloc
from fractions import Fraction
from pathlib import Path

import pytest

from heavytop.errors import InputError
from heavytop.exact.catalogue import find
from heavytop.features.kinds import KINDS
from heavytop.harness.sweeps import Random
from heavytop.precision import dot
from support.reports import drift, rows, tasks_of

GRID = """[[sweep]]
kind = "grid"
name = "g"
inertia = [["3", "2", "2"], ["3", "5/2", "3/2"]]
weight = "3/2"
centre = ["1/2", "1/3", "1/5"]
omega = [["1/10", "2/5", "9/10"], ["1", "2", "3"], ["0", "0", "1"]]
gamma = ["3/5", "0", "4/5"]
"""
RANDOM = '[[sweep]]\nkind = "random"\nname = "r"\nseed = 1\ncount = 3\n'
RUNS = [("double", "2", 2), ("quad", "1", 1)]
MEASURE = drift("euler", "sweep:g", "sweep:r", runs=RUNS)


def test_a_grid_is_the_cartesian_product_with_places_for_names(tmp_path: Path) -> None:
    tasks = tasks_of(tmp_path, GRID + RANDOM + MEASURE)
    grid = [f"g[{i},{j}]" for i in range(2) for j in range(3)]
    names = ["euler", *grid, "r[0]", "r[1]", "r[2]"]
    assert [(t.title, t.key.precision) for t in tasks] == [(n, p) for n in names for p in ("double", "quad")]
    assert all(task.case.name == task.title for task in tasks)
    assert len(tasks) == 20
    place = tasks[2 * 5]
    assert place.title == "g[1,1]"
    assert place.case.top.inertia == (3, Fraction(5, 2), Fraction(3, 2))
    assert place.case.start.omega == (1, 2, 3)
    assert [task.label for task in tasks[-2:]] == ["drift r[2] double", "drift r[2] quad"]
    with pytest.raises(IndexError):
        tasks[20]


def test_names_that_say_more_than_the_case_keep_what_they_say(tmp_path: Path) -> None:
    work = 'kind = "work_precision"\nhorizon = "5"\nladders = [{ integrator = "heyoka", tolerances = ["1e-6"] }]\n'
    tasks = tasks_of(tmp_path, RANDOM + '[[measure]]\ncases = ["sweep:r", "euler"]\n' + work)
    assert [task.title for task in tasks] == ["r[0]/T=5", "r[1]/T=5", "r[2]/T=5", "euler/T=5"]
    assert [task.case.name for task in tasks] == ["r[0]", "r[1]", "r[2]", "euler"]


def test_the_plan_in_the_documentation_is_one_and_every_kind_is_there(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "plans.md").read_text("utf-8")
    (example,) = re.findall(r"```toml\n(.*?)```", text, re.S)
    tasks = tasks_of(tmp_path, example)
    assert len(tasks) == 2 * (1 + 2 + 6 + 100)
    assert {"mine", "faster[1,2]", "many[99]"} <= {task.title for task in tasks}
    kinds = {kind.name for kind in KINDS.values() if kind.table is not None}
    assert kinds == set(re.findall(r"^\| `(\w+)` \|", text, re.M))


def test_weights_are_an_axis_too(tmp_path: Path) -> None:
    grid = GRID.replace('"3/2"\n', '["1", "2", "4"]\n')
    task = tasks_of(tmp_path, grid + drift("sweep:g"))[1 * 9 + 2 * 3 + 1]
    assert (task.title, task.case.top.weight) == ("g[1,2,1]", 4)


@pytest.mark.parametrize("family", ["any", "euler", "lagrange", "kovalevskaya"])
def test_random_tops_are_bodies_of_their_family_with_unit_gamma(family: str) -> None:
    cases = Random("r", seed=7, count=200, family=family).cases()
    for case in cases:
        assert not case.top.warnings()
        assert dot(case.start.gamma, case.start.gamma) == 1
        assert all(-1 <= each <= 1 for each in (*case.top.centre, *case.start.omega))
    first, second, third = cases[0].top.inertia
    if family == "kovalevskaya":
        assert first == second == 2 * third
        assert cases[0].top.centre[2] == 0
    if family in ("euler", "lagrange"):
        assert find(cases[0].top, cases[0].start).method.startswith(f"closed form: {family.title()}")
    # uniform on the sphere: each coordinate has mean 0 and mean square 1/3, within four standard deviations
    for k in range(3):
        values = [float(case.start.gamma[k]) for case in cases]
        assert abs(sum(values) / 200) < 4 * (1 / 3 / 200) ** 0.5
        assert abs(sum(v * v for v in values) / 200 - 1 / 3) < 4 * (4 / 45 / 200) ** 0.5


def test_random_tops_depend_on_seed_and_index_alone() -> None:
    one, more, other = (Random("r", seed=s, count=n).cases() for s, n in ((1, 3), (1, 10**6), (2, 3)))
    assert list(one) == more[:3]
    assert one[0].top != other[0].top
    assert len({case.start for case in more[:100]}) == 100
    # the same on every machine: these stand in reports
    assert one[0].top.inertia == (Fraction(1321, 500), Fraction(923, 250), Fraction(447, 125))
    assert one[0].start.gamma == (Fraction(31266, 176071), Fraction(167523, 176071), Fraction(-44266, 176071))


def test_a_million_rows_are_planned_without_making_them(tmp_path: Path) -> None:
    plan = RANDOM.replace("count = 3", "count = 1_000_000") + drift("euler", "sweep:r", runs=RUNS)
    tracemalloc.start()
    try:
        tasks = tasks_of(tmp_path, plan)
        assert len(tasks) == 2_000_002
        assert tasks[-1].title == "r[999999]"
        assert tracemalloc.get_traced_memory()[1] < 2**20
    finally:
        tracemalloc.stop()


@pytest.mark.slow
def test_swept_tasks_share_their_times_and_are_measured_under_their_names(tmp_path: Path) -> None:
    tasks = tasks_of(tmp_path, RANDOM + drift("sweep:r", runs=RUNS))
    assert tasks[0].times is tasks[2].times
    found = dict(rows(tasks[:2], 1, None))
    assert [found[i].identity[1:] for i in range(2)] == [("r[0]", "heyoka", ())] * 2
    assert [(found[i].measure, found[i].precision) for i in range(2)] == [("drift", "double"), ("drift", "quad")]
    assert all(row.outcome == "success" for row in found.values())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('["3", "2", "2"]', '["3", "1", "1"]', "g[0,0]: I1 = 3 exceeds the sum"),
        ('["3", "5/2", "3/2"]', '["3", "5/2", "9"]', "g[1,0]: I3 = 9 exceeds the sum"),
        ('["3", "5/2", "3/2"]', '["3", "5/2", "-1"]', "g[1,0]: The principal moment I3"),
        ('["0", "0", "1"]', '["0", "0", "1e200"]', "g[0,2]: omega"),
        ('gamma = ["3/5", "0", "4/5"]', 'gamma = ["1", "1", "1"]', "g[0,0]: gamma is not a unit vector"),
        ('["0", "0", "1"]', '["0", "0"]', "The sweep g: omega must have 3 numbers; got 2"),
        ('["0", "0", "1"]', '"0"', "omega mixes numbers and lists"),
        ('weight = "3/2"', 'weight = "x"', "The sweep g: 'x' is not"),
        ('weight = "3/2"', "weight = []", "The sweep g must have 1 to 1000000 tops; got 0"),
        ('weight = "3/2"', f"weight = {['1'] * 200_000}", "The sweep g must have 1 to 1000000 tops; got 1200000"),
        ("count = 3", "count = 1_000_001", "The sweep r must have 1 to 1000000 tops; got 1000001"),
        ("count = 3", "count = 0", "The sweep r must have 1 to 1000000 tops; got 0"),
        ("count = 3", "count = 3\nspare = 1", "unknown field `spare`"),
        ('name = "r"', 'name = "g"', "two sweeps 'g'"),
        ('["3", "2", "2"]', '["6/2", "5/2", "3/2"]', "The sweep g has inertia 3, 5/2, 3/2 twice"),
        ('weight = "3/2"', 'weight = ["1", "1.0"]', "The sweep g has weight 1 twice"),
        (', "sweep:r"', "", "does not measure sweep:r"),
        ("[[sweep]]", RANDOM.replace('"r"', '"s"') + "[[sweep]]", "The sweeps s and r are the same"),
        ('name = "r"', 'name = "r[0]"', "letters, digits"),
        ('"euler"', '"sweep:h"', "Unknown case 'sweep:h'"),
        ('"euler"', '"sweep:g"', "measures drift g[0,0] double twice"),
        ('kind = "drift"', 'kind = "homoclinic"', "unknown field `runs`"),
        ('name = "g"', 'name = "g"\nsystem = "gyrostat"', "g[0,0]: The gyrostat needs the centre of mass on axis 2"),
    ],
)
def test_what_is_impossible_is_refused_and_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    whole = GRID + RANDOM + MEASURE
    assert old in whole
    with pytest.raises(InputError) as error:
        tasks_of(tmp_path, whole.replace(old, new, 1))
    assert message in str(error.value).replace("\n", " ")


def test_a_grid_of_one_point_and_a_sweep_where_a_claim_is_needed_are_refused(tmp_path: Path) -> None:
    data = "inertia = [3, 2, 2]\nweight = 1\ncentre = [0, 0, 1]\nomega = [0, 0, 1]\ngamma = [0, 0, 1]\n"
    one = '[[sweep]]\nkind = "grid"\nname = "r"\n' + data
    with pytest.raises(InputError, match="varies nothing"):
        tasks_of(tmp_path, one + MEASURE)
    claim = '[[measure]]\nkind = "claim_model"\ncases = ["sweep:r"]\ntimes = ["1"]\n'
    with pytest.raises(InputError, match=r"Nothing is claimed about the case r\[0\]"):
        tasks_of(tmp_path, RANDOM + claim)
    with pytest.raises(InputError, match=r"The top's name 'r\[1\]' is not letters"):
        tasks_of(tmp_path, RANDOM + '[[top]]\nname = "r[1]"\n' + data + MEASURE)
