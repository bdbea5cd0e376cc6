"""The Python interface as its page describes it: arrays in and out, one answer on every surface, tables."""

import re
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import heavytop as ht
from heavytop.precision import exact
from support import in_process
from support.helpers import python
from support.reports import drift, plan_file

ROOT = Path(__file__).parents[2]
TOP = ht.HeavyTop((2, 2, 1), 1, (0, 0, "1/2"))
START = ht.State(("1/5", "-1/3", "7/4"), ("2/7", "3/7", "6/7"))
TIMES = [1, Fraction(5, 2)]


@pytest.mark.slow
def test_importing_loads_nothing_heavy_and_every_name_is_there() -> None:
    script = (
        "import sys, heavytop\n"
        "assert not {'numpy', 'heyoka', 'flint', 'msgspec', 'rich'} & set(sys.modules), sys.modules.keys()\n"
        "assert set(dir(heavytop)) == set(heavytop.__all__)\n"
        "for name in heavytop.__all__: getattr(heavytop, name)\n"
        "try: heavytop.nonsense\n"
        "except AttributeError as error: print(error)\n"
    )
    done = python("-c", script)
    assert done.stdout == "module 'heavytop' has no attribute 'nonsense'\n"


@pytest.mark.slow
@pytest.mark.parametrize("precision", [ht.DOUBLE, ht.EXTENDED, ht.QUAD, ht.real(100)], ids=lambda p: p.name)
def test_a_run_is_an_array_of_the_formats_numbers(precision: ht.Precision) -> None:
    run = ht.propagate(TOP, START, TIMES, precision)
    assert run.states.shape == run.to_numpy().shape == (2, 6)
    assert run.to_numpy().dtype == np.float64
    for state, texts, doubles in zip(run.states, run.texts(), run.to_numpy(), strict=True):
        for value, text, double in zip(state, texts, doubles, strict=True):
            assert abs(exact(value) - exact(text)) <= abs(exact(value)) * precision.eps
            assert double == float(exact(value))
    assert ht.propagate(TOP, START, TIMES, precision.name).texts() == run.texts()
    stopped = ht.propagate(TOP, START, TIMES, precision, step_limit=1)
    assert (stopped.states.shape, stopped.texts(), stopped.to_numpy().shape) == ((0, 6), [], (0, 6))
    riding = ht.propagate(TOP, START, TIMES, precision, xi=(Fraction(3, 7), Fraction(-6, 7), Fraction(2, 7)))
    assert riding.states.shape == (2, 9)
    assert {"xi_squared", "xi_dot_gamma"} <= ht.drift(riding).keys()


def test_times_and_vectors_come_as_arrays_of_any_format() -> None:
    plain = ht.propagate(TOP, START, [1, 2]).texts()
    for times in (np.array([1, 2]), np.array([1.0, 2.0]), np.longdouble([1, 2]), (Decimal(1), "2"), range(1, 3)):
        assert ht.propagate(TOP, START, times).texts() == plain
    omega = np.array([0.25, -0.5, 1.75])
    top = ht.HeavyTop(np.array([2.0, 2.0, 1.0]), np.float64(1), np.longdouble([0, 0, 0.5]))
    assert top == TOP
    assert ht.State(omega, (0, 0, 1)).omega == (Fraction(1, 4), Fraction(-1, 2), Fraction(7, 4))
    off = ht.State(omega, np.array([0.6, 0.0, 0.8]))
    assert ht.propagate(top, off, times=[1]).outcome is ht.Outcome.SUCCESS


@pytest.mark.slow
def test_an_ensemble_is_its_motions_and_every_integrator_has_the_same_call() -> None:
    tops = [TOP, ht.HeavyTop((3, 2, 1), 1, (0, 1, 0))]
    runs = ht.ensemble(tops, START, TIMES, threads=2)
    for top, run in zip(tops, runs, strict=True):
        for integrator in ("heyoka", "multiword", "scipy:DOP853"):
            alone = ht.propagate(top, START, TIMES, integrator=integrator)
            np.testing.assert_allclose(run.to_numpy(), alone.to_numpy(), rtol=0, atol=1e-9)
    seen = []
    observed = ht.ensemble(tops, START, TIMES, observer=lambda *sample: seen.append(sample))
    assert [len(run.states) for run in observed] == [0, 0]
    assert sorted((index, time) for index, time, _ in seen) == [(i, t) for i in (0, 1) for t in (1, Fraction(5, 2))]
    with pytest.raises(ht.InputError, match="passed to its observer"):
        ht.drift(observed[0])


def test_a_reference_is_balls_as_text_and_as_arrays() -> None:
    known = ht.reference(TOP, START, TIMES, digits=400)
    assert known.texts()[1][2] == known.states[1][2].value
    assert known.to_numpy().shape == known.radii().shape == (2, 6)
    for values, radii, balls in zip(known.to_numpy(), known.radii(), known.states, strict=True):
        for value, radius, ball in zip(values, radii, balls, strict=True):
            assert value == float(Fraction(ball.value))
            assert Fraction(float(radius)) >= Fraction(ball.radius)
            assert radius or ball.radius == "0", "too small for a double, and still a bound"


@pytest.mark.slow
def test_arrays_of_any_numbers_are_scored_alike() -> None:
    run = ht.propagate(TOP, START, TIMES, ht.EXTENDED)
    score = ht.score(TIMES, run.states, top=TOP, start=START)
    assert score.row.precision == "extended"
    assert score.digits_kept > 17
    assert {name: each.max.value for name, each in score.drift.items()}.items() <= {
        name: each.max.value for name, each in ht.drift(run).items()
    }.items()
    for states in (run.texts(), [list(map(exact, state)) for state in run.states], run.states.tolist()):
        same = ht.score(TIMES, states, top=TOP, start=START, precision="extended")
        assert (same.digits_kept, same.drift) == (score.digits_kept, score.drift)


def test_what_holds_is_decided_by_the_exact_top_and_not_by_its_rounding() -> None:
    top = ht.HeavyTop(("2/3", "2/3", "1/3"), 1, ("1/7", 0, 0))
    run = ht.propagate(top, START, [1])
    assert "kovalevskaya" in ht.drift(run)
    assert ht.drift(run).keys() == ht.score([1], run.states, top=top, start=START).drift.keys()


@pytest.mark.slow
def test_everything_prints_as_a_small_table() -> None:
    run = ht.propagate(TOP, START, np.linspace(0, 1, 500))
    shown = [
        run,
        ht.reference(TOP, START, TIMES, digits=20),
        ht.score(TIMES, ht.propagate(TOP, START, TIMES).states, top=TOP, start=START),
        ht.drift(run),
        ht.read_report(ROOT / "results" / "default"),
    ]
    assert "shown to 15 digits" in repr(ht.propagate(TOP, START, TIMES, ht.QUAD))
    assert "shown to" not in repr(run)
    for each in shown:
        assert 2 < len(repr(each).splitlines()) < 20
        html = each._repr_html_()
        assert html.count("<table>") == html.count("</table>") == 1
    assert "490 more" in repr(run)
    assert repr(TOP) == "HeavyTop(inertia=(2, 2, 1), weight=1, centre=(0, 0, '1/2'))"
    assert eval(repr(START), {"State": ht.State}) == START
    assert "<script>" not in ht.score(TIMES, run.states[1:3], top=TOP, start=START, name="<script>")._repr_html_()


SCRIPT = """import threading
import heavytop as ht

print("began", flush=True)
found = []
thread = threading.Thread(target=lambda: found.append(ht.run("plan.toml", out="out", workers=2)))
thread.start()
thread.join()
print(found[0].verdict, ht.compare("out", found[0]).verdict)
"""


@pytest.mark.slow
def test_a_plain_script_needs_no_main_guard(tmp_path: Path) -> None:
    plan_file(tmp_path, drift("lagrange", "gyrostat", runs=[("double", "5", 5)]))
    (tmp_path / "script.py").write_text(SCRIPT)
    done = python("script.py", cwd=tmp_path)
    assert (done.stdout, done.stderr) == ("began\ncomplete same\n", "")


@pytest.mark.slow
def test_children_of_others_still_know_the_script(tmp_path: Path) -> None:
    """What keeps our children from importing the script is undone for everyone else."""
    (tmp_path / "script.py").write_text(
        "from multiprocessing import get_context\n"
        "from heavytop.processes import ChildContext\n"
        "def where(): print(__name__, flush=True)\n"
        "if __name__ == '__main__':\n"
        "    for context, target in ((ChildContext(), print), (get_context('spawn'), where)):\n"
        "        child = context.Process(target=target)\n"
        "        child.start()\n"
        "        child.join()\n"
    )
    done = python("script.py", cwd=tmp_path)
    assert (done.stdout, done.stderr) == ("\n__mp_main__\n", "")


@pytest.mark.slow
def test_a_finished_run_is_read_again_and_a_plan_of_odd_moments_warns(tmp_path: Path) -> None:
    top = '[[top]]\nname = "flat"\ninertia = [3, 2, 7]\nweight = 1\ncentre = [0, 0, 1]\nomega = [0, 0, 1]\n'
    plan = plan_file(tmp_path, f"{top}gamma = [0, 0, 1]\n{drift('flat')}")
    warned = "top flat: I3 = 7 exceeds the sum 5"
    with pytest.warns(UserWarning, match=warned):
        report = ht.run(plan, out=tmp_path / "out", workers=1)
    with pytest.warns(UserWarning, match=warned):
        assert ht.run(plan, out=tmp_path / "out", workers=1, resume=True).rows == report.rows
    done = in_process.heavytop("run", "--plan", plan, "--out", tmp_path / "again", "--workers", 1)
    assert done.returncode == 0
    assert done.stderr.startswith(f"heavytop: warning: {warned}")


@pytest.mark.slow
def test_an_error_below_what_a_float_holds_is_not_printed_as_0() -> None:
    form = ht.real(1400)
    top = ht.HeavyTop(("5/2", "5/2", "3/2"), 2, (0, 0, "3/4"))
    start = ht.State(("1/4", "-3/8", "7/4"), ("3/5", 0, "4/5"))
    run = ht.propagate(top, start, ["1/8"], form)
    text = str(ht.score(["1/8"], run.states, top=top, start=start, precision=form))
    lines = {re.split(r"\s{2,}", line.strip())[0]: line.split()[-3:] for line in text.splitlines()}
    for label in ("error of Ω", "error of γ", "drift of energy"):
        assert all(re.fullmatch(r"\d\.\d\de-42\d", value) for value in lines[label]), lines


def test_an_ensemble_of_a_peer_is_refused_as_one_motion_at_a_time() -> None:
    with pytest.raises(ht.InputError, match="splitting:4 does not support ensembles"):
        ht.ensemble(TOP, START, [1], integrator="splitting:4")


@pytest.mark.parametrize("ask", [ht.propagate, ht.reference])
def test_moments_that_no_body_has_are_warned_of_in_the_line_that_asks(ask):
    top = ht.HeavyTop((5, 1, 1), 1, ("0.1", 0, "0.2"))
    with pytest.warns(UserWarning, match="I1 = 5 exceeds the sum 2 of the other two") as warnings:
        ask(top, ht.State((1, 2, 3), (0, 0, 1)), times=[0, 1])
    assert [each.filename for each in warnings] == [__file__]
