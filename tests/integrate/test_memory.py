"""Methods that keep a memory: orders are those of whole runs, restarts are judged by their error, and faults are found.

Each as a peer and as a program, declared (``one_step = false``) and not: then too nothing false is said.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import msgspec
import numpy as np
import pytest

from heavytop.cases import CASES
from heavytop.errors import Unsupported
from heavytop.features.kinds import KINDS
from heavytop.features.local_error.kind import _said
from heavytop.features.work_precision.kind import WorkPrecisionTable
from heavytop.harness import integrator_check
from heavytop.harness.checkpoint import Saved
from heavytop.harness.rows import Task, computed, measure
from heavytop.integrate import registry
from heavytop.integrate.peers.command import Command, close_all
from heavytop.integrate.peers.double import Solved, double_peer
from heavytop.integrate.peers.runge_kutta import Tableau
from heavytop.integrate.registry import of_callable
from heavytop.precision import DOUBLE
from heavytop.records import Row, RowKey
from heavytop.top.attitude import perpendicular
from support import methods_with_memory as memory
from support.helpers import judged
from support.reports import asked, tasks_of

pytestmark = pytest.mark.slow
FOLDER = Path(__file__).parents[1] / "support"
CASE = CASES["lagrange"]
KEPT_APART = ("leapfrog", "extrapolation", "corrected", "ab4")
"""Whose single steps from a fresh start have the order of the method."""


@pytest.fixture(autouse=True)
def _programs_end():
    yield
    close_all()


def program(name: str, **declared: object) -> Command:
    line = (sys.executable, "-S", "-E", str(FOLDER / "methods_with_memory.py"), name)
    return Command(name=name, command=line, setting="step", order=memory.METHODS[name][1], **declared)


def forms(name: str):
    """A method as it comes: whether it is declared, and the integrator."""
    yield True, program(name, one_step=False)
    yield True, of_callable(getattr(memory, f"{name}_declared"))
    yield False, of_callable(getattr(memory, name))


def row(integrator, kind: str = "local_error", times=(Fraction(2),), options=None, **setting: str) -> Row:
    key = RowKey(kind, CASE.name, CASE.system.name, computed(integrator.name, **setting), "double", horizon="2")
    task = Task(key, "", integrator.name, CASE, times, times, options, source=integrator)
    return measure(KINDS[kind], task, Saved())


@pytest.mark.parametrize("name", memory.HEALTHY)
def test_the_order_of_a_method_with_a_memory_is_that_of_its_runs(name: str) -> None:
    place = list(memory.HEALTHY).index(name)
    # the declared program, or the declared peer
    for declared, integrator in [*forms(name)][place % 2 :: 2 - place % 2]:
        found = row(integrator)
        order = str(memory.METHODS[name][1])
        assert found.outcome == "success", found.reference.reason
        assert found.metrics["observed_order_runs"].value == order
        assert ("local_error_ulp_max" in found.metrics) is not declared
        said = _said(found)
        assert f"order {order} confirmed" in said
        assert "not the" not in said
        assert "wrongly" not in said
        assert ("one_step = false" in said) == (not declared and name not in KEPT_APART)


def test_an_order_that_rounding_hides_is_that_of_coarser_steps() -> None:
    assert row(program("extrapolation", one_step=False), step="1/1000").metrics["observed_order_runs"].value == "4"


@pytest.mark.parametrize("name", memory.FAULTY)
def test_a_wrong_order_is_found_whatever_is_declared(name: str) -> None:
    place, order = list(memory.FAULTY).index(name), memory.METHODS[name][1]
    found = row([*forms(name)][place % 3][1])
    assert int(found.metrics["observed_order_runs"].value) < order
    assert f", not the declared {order}" in _said(found)


@pytest.mark.parametrize("name", memory.HEALTHY)
def test_the_contract_accuses_no_method_with_a_memory(name: str) -> None:
    for declared, integrator in forms(name):
        tried = "one time", "times [0]", "restart", "rest", "steps", "between steps"
        parts = {part: judged(integrator, part) for part in tried}
        assert {each.verdict for each in parts.values()} <= {"kept", "note"}
        begins_anew = not declared and name not in ("extrapolation",)
        assert parts["restart"].verdict == ("note" if begins_anew else "kept")
        assert ("declare one_step = false" in parts["restart"].text) is begins_anew


def test_a_restart_that_its_error_does_not_explain_is_violated() -> None:
    def solve(given):
        found = memory.solver(memory.METHODS["ab4"][0])(given)
        again = given.start[0] != float(CASES["generic"].start.omega[0])
        return replace(found, states=[[a + 1e-6 * again for a in y] for y in found.states])

    found = judged(of_callable(double_peer("mine", 4, solve, "step", one_step=False)), "restart")
    assert (found.verdict, "times the error without it" in found.text) == ("violated", True)


def test_what_keeps_a_memory_under_a_tolerance_has_no_single_steps() -> None:
    solve = memory.solver(memory.METHODS["ab4"][0])
    peer = of_callable(double_peer("adaptive", 4, lambda given: solve(replace(given, setting=0.01)), one_step=False))
    found = row(peer)
    assert (found.outcome, "neither an order nor single steps" in found.reference.reason) == ("unsupported", True)


def test_work_against_precision_takes_restarts_at_samples_for_what_they_are(tmp_path: Path) -> None:
    """With a sample each step nothing but the starting method is at work, which is 50 times as right as the run: the
    finest step is then no better than one whose samples are further apart, and shows no order.
    """
    module = FOLDER / "methods_with_memory.py"
    (tmp_path / "mine.py").write_text(module.read_text("utf-8"))
    ladders = [{"integrator": "./mine.py:ab4_declared", "steps": ["1/10", "1/20", "1/40"]}]
    tasks = tasks_of(tmp_path, asked("work_precision", "lagrange", horizon="2", samples=20, ladders=ladders))
    rows = [measure(KINDS["work_precision"], task, Saved()) for task in tasks]
    assert [each.outcome for each in rows] == ["success"] * 3, [each.reference.reason for each in rows]
    text = "\n".join(str(block) for block in KINDS["work_precision"].document(rows))
    assert "step 1/40" in text
    assert "finest two" not in text


# Other declarations.


def test_the_steps_of_a_fixed_grid_divide_every_time_or_the_row_is_unsupported() -> None:
    seen = []

    def solve(given):
        seen.append((given.setting, given.times.tolist()))
        return memory.solver(memory.METHODS["ab4"][0])(given)

    peer = registry.ready(
        of_callable(double_peer("grid", 4, solve, "step", fixed_grid=True)), ("step", Fraction(1, 30))
    )
    for times in (
        [Fraction(i, 5) for i in range(1, 11)],
        [Fraction(i / 5) for i in range(1, 11)],  # as rounded to the format
        [Fraction(1, 4), Fraction(1), Fraction(3, 2)],
        [Fraction(2, 7)],
    ):
        peer(CASE.top, CASE.start, times, DOUBLE)
        step, asked = seen[-1]
        assert 1 / 60 < step <= 1 / 30 + 1e-12
        assert all(abs(time / step - round(time / step)) < 1e-9 for time in asked)
    with pytest.raises(Unsupported, match="not multiples of a step near 0"):
        peer(CASE.top, CASE.start, [Fraction("0.1234"), Fraction(1)], DOUBLE)
    with pytest.raises(Unsupported, match="not multiples"):
        registry.ready(program("ab4", fixed_grid=True))(
            CASE.top, CASE.start, [Fraction("0.12345"), Fraction(1)], DOUBLE
        )


def test_a_start_where_coordinates_are_singular_is_unsupported_and_the_check_takes_another() -> None:
    down = program("ab4", singular_at=(("0", "0", "1"), (0, 0, -1.0)))
    case = CASES["pendulum"]
    with pytest.raises(Unsupported, match="coordinates are singular at this start"):
        registry.ready(down)(case.top, replace(case.start, gamma=(Fraction(0), Fraction(0), Fraction(1))), [1], DOUBLE)
    assert integrator_check._Contract(down).axis == (0, 1, 0)
    assert judged(down, "rest").verdict == "kept"
    with pytest.raises(Exception, match="must not be zero"):
        registry.command_of({"name": "a", "command": ["b"], "singular_at": [[0, 0, 0]]}, Path(), "here")


def test_a_program_and_a_peer_that_compute_with_a_quaternion() -> None:
    mine, solve = program("classical", attitude="quaternion"), memory.solver(memory.METHODS["classical"][0])
    peer = of_callable(double_peer("q", 4, solve, "step", attitude="quaternion"))
    case = CASES["generic"]
    xi = tuple(map(Fraction, perpendicular(case.start.gamma)))
    for which in (mine, peer):
        run = registry.ready(which)(case.top, case.start, [1, 2], DOUBLE, xi=xi)
        known = registry.ready("heyoka")(case.top, case.start, [1, 2], DOUBLE, xi=xi)
        assert abs(run.to_numpy() - known.to_numpy()).max() < 1e-6
    found = {each.check: each for each in integrator_check.check(mine)}
    assert not [each for each in found.values() if each.verdict == "violated"], found
    assert found["times [0]"].text.startswith("A run to t = 0 returns the start")


def test_a_start_may_be_off_by_the_rounding_of_its_representation_and_a_run_to_0_be_refused() -> None:
    def refuses(top, start, times, precision, *, system, step=None):
        if times == (0,):
            raise ValueError("no time to go")
        return registry.ready("splitting:2")(top, start, times, precision, system=system)

    contract, refused = integrator_check._Contract(of_callable(refuses)), judged(of_callable(refuses), "times [0]")
    assert (refused.verdict, "which is allowed" in refused.text) == ("note", True)
    given = [float(value) for value in contract._problem().start.flat]
    assert contract._off_start(given) == ""
    assert "as its representation rounds it" in contract._off_start([a * (1 + 4e-16) for a in given])
    with pytest.raises(integrator_check._Violated):
        contract._off_start([a * (1 + 1e-12) for a in given])


# Steps, counts, and what lies between steps.


def dopri(between, beyond=0.0):
    """SciPy's method of order 5 with a tolerance, and an interpolant of one's own; it ends beyond the last time."""
    from scipy.integrate import RK45

    def solve(given):
        control = {"rtol": max(given.setting, 3e-14), "atol": given.setting, "t_bound": given.times[-1] + beyond}
        solver = RK45(lambda _, y: np.array(given.field(y.tolist())), 0.0, given.start, **control)
        nodes, states = [(0.0, given.start)], []
        while solver.status == "running":
            solver.step()
            nodes.append((solver.t, solver.y))
        for at in given.times.tolist():
            n = next(i for i in range(1, len(nodes)) if abs(nodes[i][0]) >= abs(at))
            states.append(between(given.field, *nodes[n - 1], *nodes[n], at))
        return Solved(states, given.times[-1], len(nodes) - 1)

    return solve


def linear(field, t0, y0, t1, y1, at):
    s = (at - t0) / (t1 - t0)
    return (1 - s) * y0 + s * y1


def nearest(field, t0, y0, t1, y1, at):
    return y0 if at - t0 < t1 - at else y1


def cubic(field, t0, y0, t1, y1, at):
    h, s = t1 - t0, (at - t0) / (t1 - t0)
    f0, f1 = (np.array(field(y.tolist())) for y in (y0, y1))
    return linear(field, t0, y0, t1, y1, at) + s * (s - 1) * ((1 - 2 * s) * (y1 - y0) + (s - 1) * h * f0 + s * h * f1)


@pytest.mark.parametrize(
    ("between", "order", "beyond", "verdict"),
    [
        (linear, 5, 0, "violated"),
        (nearest, 5, 0, "violated"),
        (linear, 2, 0, "note"),
        (cubic, 5, 0, "note"),
        (linear, 0, 0, "note"),
        (linear, 5, 0.01, "violated"),  # its steps end nowhere at a time
        (cubic, 5, 0.01, "kept"),
        (linear, 2, 0.01, "kept"),
    ],
)
def test_what_lies_between_steps_is_tried_beside_the_order(between, order, beyond, verdict) -> None:
    peer = double_peer("dense", order, dopri(between, beyond))
    found = judged(of_callable(peer), "between steps")
    assert (found.verdict, "between steps" in found.text) == (verdict, True)
    assert ("as for the nearest or the previous state" in found.text) == (between is nearest)


def test_a_tolerance_that_changes_nothing_is_said() -> None:
    deaf = double_peer("deaf", 5, lambda given: dopri(cubic)(replace(given, control=1e-7)))
    found = judged(of_callable(deaf), "between steps")
    assert (found.verdict, "perhaps the tolerance is ignored" in found.text) == ("note", True)


def test_a_count_that_explains_no_error_is_said_and_no_failure() -> None:
    """Many steps too many make single steps short: a row says so, and accuses nobody."""
    honest = double_peer("honest", 5, solve := dopri(cubic))
    many = double_peer("many", 5, lambda given: replace(found := solve(given), steps=1000 * found.steps))
    said = [_said(row(of_callable(peer), times=(Fraction(1, 4),))) for peer in (honest, many)]
    assert ["do not explain" in text for text in said] == [False, False]


def test_a_method_that_is_exact_on_a_motion_counts_no_step_too_few() -> None:
    """A Lie group method turns a body steadily without an error, in whatever steps."""
    from heavytop.integrate.heyoka.motions import propagate

    def exactly(top, start, times, precision, *, system, step=None):
        run = propagate(top, start, times, precision, system=system)
        return replace(run, order=1, steps=20, flags={})

    table, times = WorkPrecisionTable([], "2", []), tuple(Fraction(i, 5) for i in range(1, 11))
    half = Fraction(1, 2)
    rk4 = Tableau(1, ((half,), (0, half), (0, 0, 1)), [Fraction(i, 6) for i in (1, 2, 2, 1)]).peer("mine:rk4")
    for integrator, causes in (
        (exactly, ", it is exact on this motion, or it takes more steps than it counts"),
        (rk4, ""),
    ):
        found = row(of_callable(integrator), "work_precision", times, table, step="1/10")
        assert found.outcome == "success", found.reference.reason
        assert found.explained.kind == "steps"
        assert found.explained.text.endswith(f": its order is higher than declared{causes}.")


def test_a_step_that_underflows_is_a_note_that_says_what_was_asked(tmp_path: Path) -> None:
    """The motion with |Ω| = 1e150 makes the steps of a textbook method shrink for ever."""
    text, source = (FOLDER / "methods_with_memory.py").read_text("utf-8"), str(Path(__file__).parents[2] / "src")
    stuck = "            counts = [0]\n            while max(map(abs, y)) > 1e9:\n                step /= 2\n"
    assert text.count("            counts = [0]\n") == 1
    text = text.replace("            counts = [0]\n", stuck).replace(
        'str(Path(__file__).parents[2] / "src")', repr(source)
    )
    (tmp_path / "m.py").write_text(text)
    which = msgspec.structs.replace(program("ab4"), command=(sys.executable, "-S", "-E", str(tmp_path / "m.py"), "ab4"))
    assert judged(which, "one time").verdict == "kept"
    found = judged(which, integrator_check._TOO_FAST)
    assert (found.verdict, found.text) == (
        "note",
        "At |Ω| = 1e150, t = 1: no finite state (ab4 did not say done within 2 s).",
    )
