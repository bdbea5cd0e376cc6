"""Plans: what ships expands, what is impossible is refused with its place."""

import pickle
import re
from fractions import Fraction
from pathlib import Path

import pytest

from heavytop.cases import CASES, case
from heavytop.errors import InputError
from heavytop.harness import BUILT_IN
from heavytop.harness.plan import log_spaced, warnings
from support.reports import drift, expand, load, plan_file, tasks_of
from support.reports import plan_of as plan_from
from support.reports import read_plan as read

MEASURE = '[[measure]]\nkind = "drift"\ncases = ["euler"]\nruns = [{ precision = "double", horizon = "10" }]\n'
TOP = (
    '[[top]]\nname = "mine"\ninertia = ["3", "2", "1"]\nweight = "1"\ncentre = ["0", "0", "1/3"]\n'
    'omega = ["1", "0.5", "-2/3"]\ngamma = ["3/5", "0", "4/5"]\n'
)
WORK = (
    "[[measure]]\nkind = 'work_precision'\ncases = ['euler']\nhorizon = '10'\n"
    "ladders = [{ integrator = 'heyoka', tolerances = ['1e-3', '0.001'] }]\n"
)
PROGRAM = "[[integrator]]\nname = 'a'\ncommand = ['x']\n"
PROGRAMS = "".join(PROGRAM.replace("'a'", f"'{name}'") for name in "abc")
AUDIT = "[[measure]]\nkind = 'audit'\nclaims = ['ershkov-partial']\n"
LIBRARY = AUDIT.replace("ershkov-partial", "library")
CARRIED = AUDIT.replace("ershkov-partial", "sretensky-gyrostat")
ONE = WORK.replace(", '0.001'", "")
GROWTH = (
    "[[measure]]\nkind = 'growth'\ncases = ['euler']\nruns = [\n"
    "{ precision = 'double', horizon = '10', tolerance = '1e-3' },\n"
    "{ precision = 'double', horizon = '10', tolerance = '1.0e-3' },\n]\n"
)


@pytest.mark.slow
@pytest.mark.parametrize("name", BUILT_IN)
def test_the_plans_that_ship_expand(name: str) -> None:
    plan, digest, tasks = read(name)
    assert plan.name == name
    assert len(digest) == 64
    assert len({task.label for task in tasks}) == len(tasks) > 5


@pytest.mark.slow
def test_the_default_plan_holds_what_it_promises() -> None:
    tasks = expand(load("default")[0])
    drifts = [t for t in tasks if t.key.kind == "drift"]
    horizons = {(t.case.name, t.key.precision): t.times[-1] for t in drifts if t.subject == "heyoka"}
    in_words = {(t.case.name, t.key.precision): t.times[-1] for t in drifts if t.subject == "multiword"}
    for name in ("euler", "kovalevskaya"):
        for format, horizon in (("double", 10**5), ("extended", 10**5), ("quad", 10**4), ("real:237", 10**3)):
            assert in_words[name, format] == horizon
    for name in ("euler", "lagrange", "kovalevskaya", "generic", "gyrostat"):
        assert horizons[name, "double"] == 10**5
        assert horizons[name, "extended"] == 10**4
        assert horizons[name, "quad"] == 10**3
        assert horizons[name, "real:237"] == 50
    model = [t for t in tasks if t.key.kind == "claim_model"]
    assert {t.title for t in model} == {f"ershkov-partial-{r}/{d}" for r in (2, 6) for d in ("forward", "backward")}
    assert all({Fraction(1, 10), Fraction(1), Fraction(2)} <= {abs(t) for t in task.keep} for task in model)


def test_no_parameter_of_the_five_tops_is_1_where_1_would_hide_a_factor() -> None:
    for name in ("euler", "lagrange", "kovalevskaya", "generic", "gyrostat"):
        top, start = CASES[name].top, CASES[name].start
        assert 1 not in (*top.inertia, top.weight, *top.centre, *start.omega, *start.gamma)
        start.require_unit_gamma()


@pytest.mark.parametrize("name", ["ershkov-partial-2", "ershkov-partial-6", "delone", "kovalevskaya-asymptotic"])
def test_homoclinic_cases_have_dyadic_data(name: str) -> None:
    each = case(name)
    values = (*each.top.inertia, *each.top.moment, *each.start.flat, each.system.parameters(each.top, each.start).rotor)
    assert all(Fraction(v).denominator & (Fraction(v).denominator - 1) == 0 for v in values)


def test_the_asymptotic_case_tends_to_its_saddle_at_its_rate() -> None:
    each = case("kovalevskaya-asymptotic")
    # ln 2 over it is the time gained per bit: heyoka on it gains 1.16 to 1.21 from format to format
    assert each.rate == pytest.approx(0.5757030352, rel=1e-9)
    assert each.alpha == 1
    other = pickle.loads(pickle.dumps(each))  # as it goes to a worker, after something was made for it
    assert other == each
    assert other.rate == each.rate


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("measure = []", "measures nothing"),
        (f"surprise = 1\n{MEASURE}", "unknown field `surprise`"),
        (f"{MEASURE}extra = 1\n", "unknown field `extra`"),
        (f"{AUDIT}system = 'gyrostat'", "kind = 'audit' has claims, systems"),
        (f"{AUDIT}systems = 'gyrostat'", "measure[0].systems must be a list; got text"),
        (f"{AUDIT}systems = ['wheel']", "Unknown system 'wheel'"),
        (f"{AUDIT}systems = ['heavy_gyrostat']", "The paper makes no claim about heavy_gyrostat"),
        (f"{CARRIED}systems = ['gyrostat']", "sretensky-gyrostat is about heavy_gyrostat, but systems"),
        (f"{LIBRARY}systems = ['gyrostat']", "is about heavy_top, but systems = ['gyrostat']"),
        (f"{MEASURE}[[measure]]\nkind='drift'\ncases=[]\nruns=[]", "A [[measure]] of the plan"),
        (f"{MEASURE}[[measure]]\nkind='local_error'\ncases=['euler']\nhorizon='1'\nprecisions=[]", "measures nothing"),
        (f"{MEASURE}integrator = 'a'\n{PROGRAMS}", "integrators that it does not measure: b, c."),
        ("[[measure]]\nkind = 'hunt'\nagainst = 'heyoka'", "integrator and against must differ"),
        ("[[measure]]\nkind = 'hunt'\nseed = -1", "seed must be from 0 to 1000000000; got -1.   Give, for example, 1."),
        ("[[measure]]\nkind = 'hunt'\nagainst = 'nobody'", "Unknown integrator 'nobody'"),
        (MEASURE.replace("euler", "oiler"), "Unknown case 'oiler'.   Did you mean euler?"),
        (MEASURE.replace("double", "float"), "Unknown precision 'float'"),
        (MEASURE.replace("10", "-10"), "must be positive; got -10.   Give a"),
        (MEASURE.replace("10", "nan"), "not a finite number"),
        (MEASURE.replace(" }", ", samples = 0 }"), "samples must be from 1"),
        (MEASURE.replace(" }", ", samples = 1.5 }"), "must be an integer"),
        (f"{MEASURE}{MEASURE}", "twice"),
        (f"{TOP}{TOP}{MEASURE}", "two tops 'mine'"),
        (f"{TOP}{MEASURE}", "does not measure mine"),
        (f"{TOP.replace('mine', 'my top')}{MEASURE}", "The top's name 'my top' is not letters, digits"),
        (f"{TOP.replace('3/5', '2/5')}{MEASURE}", "not a unit vector"),
        (f"{TOP.replace('mine', 'euler')}{MEASURE}", "built-in"),
        (MEASURE.replace("10", "1e-400"), "drift euler double: 1E-403 is outside the exponent range"),
        (WORK, "heyoka tolerance=0.001 double twice, also as work_precision euler/T=10 heyoka tol"),
        (f"{ONE}{ONE.replace('10', '1e1')}", "twice, also as work_precision euler/T=10 heyoka tolerance=1e-3"),
        (GROWTH, "tolerance 1.0e-3 double twice, also as growth euler heyoka tolerance 1e-3 double"),
        (ONE.replace("tolerances", "steps"), "Leave it out: tolerance sets the accuracy of heyoka"),
        (
            f"{ONE.replace('heyoka', 'a').replace('tolerances', 'steps')}{PROGRAM}",
            "The integrator a does not support step",
        ),
        ("[[measure]", "not valid"),
        (f"name = '../evil'\n{MEASURE}", "letters, digits"),
        (MEASURE.replace("10", "1e400"), "too large"),
        ("name = " + "[" * 100000, "too deeply"),
        ("[[measure]]\nkind='claim_model'\ncases=['euler']\ntimes=['1']", "Nothing is claimed"),
        ("[[measure]]\nkind='homoclinic'\ncases=['euler']\nprecisions=['double']", "not homoclinic"),
    ],
)
def test_what_is_impossible_is_refused_and_named(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        tasks_of(tmp_path, text)
    assert message in str(error.value).replace("\n", " ")


def test_claims_are_audited_as_motions_of_their_own_system_unless_others_are_named(tmp_path: Path) -> None:
    def systems(text: str) -> list[tuple[str, str]]:
        return [(task.key.case, task.key.system) for task in tasks_of(tmp_path, text)]

    own = [("sretensky-gyrostat", "heavy_gyrostat")]
    assert systems(CARRIED) == systems(f"{CARRIED}systems = ['heavy_top', 'heavy_gyrostat']") == own
    assert systems(AUDIT) == [("ershkov-partial", "heavy_top")]
    both = [("ershkov-partial", "heavy_top"), ("ershkov-partial", "gyrostat")]
    assert systems(f"{AUDIT}systems = ['heavy_top', 'gyrostat']") == both


def test_a_top_of_one_s_own_is_measured_under_its_name(tmp_path: Path) -> None:
    (task,) = tasks_of(tmp_path, f"{TOP}{drift('mine')}")
    assert task.title == "mine"
    assert task.case.start.omega[2] == Fraction(-2, 3)


def test_numbers_of_a_plan_are_those_that_it_writes_down(tmp_path: Path) -> None:
    body = """[[top]]
name = "mine"
mass = 15
gravity = 9.80665000000000000000001
centre = [0, 1, 0.5]
inertia = [1, 2, "5/2"]
about = "pivot"
omega = [0, -1, 2e-1]
quaternion = [1, 0, 0, 0]
"""
    (task,) = tasks_of(tmp_path, f"{body}{MEASURE.replace('euler', 'mine')}".replace('"10"', "10"))
    assert task.key.horizon == "10"
    assert task.case.body.mass == 15
    assert task.case.body.gravity == Fraction("9.80665000000000000000001")
    assert task.case.body.centre == (0, 1, Fraction(1, 2))
    assert task.case.given_start.omega == (0, -1, Fraction(1, 5))
    for wrong, said in (
        ("nan", "not a finite number"),
        ("true", "must be text"),
        ("[1]", "got a list"),
        ("1" * 5000, "not"),
    ):
        with pytest.raises(InputError, match=said):
            tasks_of(tmp_path, f"{body.replace('= 15', f'= {wrong}')}{drift('mine')}")


def test_unknown_plans_are_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.toml").touch()
    with pytest.raises(InputError, match="lacks the key name"):
        load(str(tmp_path / "empty.toml"))
    with pytest.raises(InputError, match=r"Unknown plan 'smoek'.*\n.*Did you mean smoke"):
        load("smoek")
    with pytest.raises(InputError, match="cannot be read"):
        load("nowhere.toml")


def test_log_spaced_indices_start_at_1_and_end_at_the_count() -> None:
    assert log_spaced(1) == [1]
    picked = log_spaced(1000)
    assert picked[0] == 1
    assert picked[-1] == 1000
    assert 20 <= len(picked) <= 26


def test_a_gamma_that_is_none_names_file_and_top_and_a_remedy_that_run_has(tmp_path: Path) -> None:
    text = TOP.replace('["3/5", "0", "4/5"]', '["1", "1", "0"]') + drift("mine")
    with pytest.raises(InputError) as caught:
        tasks_of(tmp_path, text)
    file = tmp_path / "plan.toml"
    assert caught.value.cause == f"{file}: The plan's top 'mine': gamma is not a unit vector: |gamma|^2 - 1 = 1."
    assert "--normalize" not in caught.value.remedy
    near = re.search(r"near this one is (\S+), (\S+), (\S+)\.$", caught.value.remedy)
    assert len(tasks_of(tmp_path, text.replace('["1", "1", "0"]', str([*near.groups()])))) == 1


@pytest.mark.parametrize(
    ("kind", "section", "near"),
    [("drft", "measure", "drift"), ("workprecision", "measure", "work_precision"), ("grids", "sweep", "grid")],
)
def test_an_unknown_kind_is_answered_with_those_that_are_there(
    kind: str, section: str, near: str, tmp_path: Path
) -> None:
    text = f'[[{section}]]\nkind = "{kind}"\n' + (drift("euler") if section == "sweep" else "")
    with pytest.raises(InputError, match=f"{section}.0.* must be one of .*; got '{kind}'; did you mean {near}"):
        tasks_of(tmp_path, text)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tolerance", "integrator", "refused"),
    [("1e-20", "heyoka", True), ("1e-15", "heyoka", False), ("1e-16", "sundials:CVODE", False), ("0", "heyoka", True)],
)
def test_a_tolerance_below_eps_is_refused_before_anything_runs(
    tolerance: str, integrator: str, refused: bool, tmp_path: Path
) -> None:
    pytest.importorskip("sksundae")
    schedule = ONE.replace("'heyoka'", f"'{integrator}'").replace("1e-3", tolerance)
    if refused:
        with pytest.raises(InputError, match="olerance"):
            read(plan_file(tmp_path, schedule))
    else:
        assert len(tasks_of(tmp_path, schedule)) == 1


def test_one_case_may_stand_at_several_horizons_and_each_has_a_name_of_its_own() -> None:
    runs = [{"precision": "double", "horizon": horizon, "samples": 2} for horizon in ("10", "1e2", "1000")]
    table = {"kind": "drift", "cases": ["euler"], "runs": runs}
    tasks = expand(plan_from({"name": "x", "measure": [table]}))
    assert [task.title for task in tasks] == ["euler", "euler/T=100", "euler/T=1000"]
    assert [task.key.horizon for task in tasks] == ["10", "100", "1000"]
    assert {task.key.case for task in tasks} == {"euler"}
    with pytest.raises(InputError, match="twice"):
        expand(plan_from({"name": "x", "measure": [table, {**table, "runs": [{**runs[0], "horizon": "1e1"}]}]}))


@pytest.mark.parametrize("kind", ["drift", "growth", "homoclinic", "local_error"])
def test_every_kind_that_propagates_takes_any_integrator(kind: str) -> None:
    table: dict = {"kind": kind, "cases": ["delone" if kind == "homoclinic" else "euler"], "integrator": "multiword"}
    run = {"precision": "double", "horizon": "10"}
    table |= {"runs": [run]} if kind in ("drift", "growth") else {"precisions": ["double"]}
    table |= {"horizon": "1"} if kind == "local_error" else {}
    (task, *_) = expand(plan_from({"name": "x", "measure": [table]}))
    assert task.key.subject.name == task.integrator.name == "multiword"
    with pytest.raises(InputError, match="Unknown integrator"):
        expand(plan_from({"name": "x", "measure": [table | {"integrator": "nobody"}]}))


def test_data_that_no_body_has_are_told(tmp_path: Path) -> None:
    """Of a top, and of a body whose tensor is about the other point."""
    body = 'mass = "15"\ngravity = "9.81"\ncentre = ["0", "1", "0"]\ninertia = ["0.234375", "0.46875", "0.234375"]\n'
    start = 'omega = ["0", "150", "-4.61538"]\nquaternion = ["1", "0", "0", "0"]\n'
    for table, told in (
        (TOP.replace('"2", "1"]', '"2", "7"]'), "I3 = 7 exceeds the sum 5 of the other two: no rigid body has such"),
        (
            f'[[top]]\nname = "mine"\n{body}about = "pivot"\n{start}',
            "The inertia tensor about the centre of mass, of p",
        ),
    ):
        (warning,) = warnings(load(plan_file(tmp_path, table + drift("mine")))[0])
        assert warning.startswith(f"top mine: {told}")
