"""Several files at once: a line each, and the order of those that differ in their step alone."""

import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from heavytop.errors import ExitCode
from heavytop.features.score.diagnose.search import Diagnosis
from heavytop.features.score.several import ScoredFile, _scored_file, exit_code, orders, text
from heavytop.features.score.text import cause
from support.in_process import heavytop

HEAD = "# name: slow\n# integrator: {}\n# step: {}\n# inertia: 2, 2, 1\n# weight: 1\n# centre: 0, 0, 1/2\n"
ROWS = "# omega: 0, 0, 1\n# gamma: 0, 0, 1\nt,w1,w2,w3,gamma1,gamma2,gamma3\n1,{0},0,1,0,0,1\n2,{0},0,1,0,0,1\n"


def scored(path: str, step: str, error: float | None, method: str = "rk4", code: int = 0) -> ScoredFile:
    return ScoredFile(path, {}, code, "5.0", "", (method,), Fraction(step), error)


def test_the_order_is_that_of_the_two_finest_steps_above_rounding() -> None:
    files = [scored("a", "1/10", 1e-3), scored("c", "1/40", 1e-15), scored("b", "1/20", 1e-3 / 16)]
    files.append(scored("coarse", "1/5", 2e-3))
    (found,) = orders([*files, scored("other", "1/20", 1.0, "euler"), scored("unsaid", "0", 1e-2)])
    assert (found.paths, round(found.order, 9)) == (("coarse", "a", "b", "c"), 4)
    assert "order 4.0 over 4 steps: coarse to c" in text(files)


def test_an_explanation_is_its_name_and_words_and_says_where_the_names_are() -> None:
    words = cause(Diagnosis("one_state", {"t": "3", "state": "3 of 9"}, 1.0, 1e-12), "heavy_top")
    assert words == "Only the state at t = 3 is wrong (state 3 of 9)"
    assert cause(Diagnosis("gamma_down", {"of": "columns"}), "heavy_top").startswith("γ points down")
    lines = text([scored("a", "1", 1.0), replace(scored("b", "1", 1.0), explained=f"one_state: {words}")]).splitlines()
    assert lines[2].endswith(f"5.0  one_state: {words}")
    assert lines[3].startswith("`heavytop docs score` explains")


@pytest.mark.parametrize(
    ("second", "third"), [(None, 1e-4), (1e-3, None)], ids=["the first unresolved", "the second unresolved"]
)
def test_one_resolved_error_gives_no_order(second: float | None, third: float | None) -> None:
    assert list(orders([scored("b", "1/20", second), scored("c", "1/40", third)])) == []


def test_the_order_is_of_steps_with_which_the_error_falls_and_of_errors_of_the_method() -> None:
    """Of two methods without a name, of a run in degrees, of one that ended early, and of rounding in single."""
    euler, rk4 = [("e1", "1/100", 0.05), ("e2", "1/200", 0.025)], [("a", "1/20", 4e-5), ("b", "1/40", 2.5e-6)]
    (found,) = orders([scored(*file) for file in (*euler, *rk4)])
    assert (found.paths, round(found.order, 9)) == (("e1", "e2"), 1)
    fine = scored("fine", "1/80", 0.5)
    for wrong in (
        fine,
        replace(fine, error=1e-9, explained="omega_in_degrees: ..."),
        replace(fine, error=1e-9, exit_code=3),
    ):
        found_here = list(orders([*(scored(*file) for file in rk4), wrong]))
        assert [order.paths for order in found_here] == [("a", "b")] * (wrong is not fine)
    single = [replace(scored(name, step, 1e-6), eps=Fraction(1, 2**23)) for name, step in (("a", "1"), ("b", "1/2"))]
    assert list(orders(single)) == []


@pytest.mark.parametrize(("codes", "whole"), [((0, 0), 0), ((0, 3), 3), ((1, 3), 1), ((2, 1), 2)])
def test_the_exit_code_is_the_gravest(codes: tuple[int, ...], whole: int) -> None:
    assert exit_code([scored("a", "1", 1.0, code=code) for code in codes]) == whole


@pytest.mark.slow
def test_files_are_scored_in_parallel_and_a_bad_one_does_not_stop_the_others(tmp_path: Path) -> None:
    for name, step, off in (("coarse", "1/10", 1e-4), ("fine", "1/20", 2.5e-5)):
        (tmp_path / f"{name}.csv").write_text(HEAD.format("mine", step) + ROWS.format(off))
    (tmp_path / "bad.csv").write_text("none\n")
    paths = [str(tmp_path / f"{name}.csv") for name in ("coarse", "bad", "fine")]
    required = [_scored_file(path, None, "4.3", False) for path in (paths[0], paths[2])]
    assert exit_code(required) == ExitCode.FINDING
    coarse, fine = text(required).splitlines()[-2:]
    assert coarse.endswith("coarse.csv: 4.3 digits required: only 4 are right.")
    assert fine.endswith("fine.csv: 4.3 digits required: satisfied.")
    done = heavytop("score", *paths, "--require", "4.3", "--json")
    assert done.returncode == ExitCode.BAD_INPUT
    document = json.loads(done.stdout)
    assert [each["file"] for each in document["files"]] == paths
    assert [each.get("passed") for each in document["files"]] == [False, None, True]
    assert document["files"][0]["digits_right"] == pytest.approx(4, abs=0.1)
    assert "no rows below its header" in document["files"][1]["error"]
    (order,) = document["orders"]
    assert order["order"] == pytest.approx(2, abs=0.01)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("b.csv", "--html", "page.html"), "single trajectory; got 2"),
        (("-",), "Standard input must be the only trajectory"),
    ],
)
def test_a_page_and_standard_input_are_of_one_trajectory(words: tuple[str, ...], said: str) -> None:
    done = heavytop("score", "a.csv", *words)
    assert done.returncode == ExitCode.BAD_INPUT
    assert said in done.stderr
