"""Other integrators behind the same call: they agree with heyoka, from whose code they take nothing."""

import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from heavytop import DOUBLE, HEAVY_TOP, QUAD, InputError, Outcome, real
from heavytop.cases import CASES
from heavytop.errors import MissingExtra
from heavytop.integrate import registry
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.peers import scipy_ivp
from heavytop.integrate.peers.double import Request, Solved, double_peer
from heavytop.integrate.peers.mpmath_taylor import odefun
from support.helpers import distance, named_peers, run_peer

TIMES = [Fraction(1, 3), Fraction(2), Fraction(5)]
FINE = Fraction(1, 10**12)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "precision"), [("kovalevskaya", QUAD), ("gyrostat", real(160))])
def test_odefun_and_heyoka_agree_to_the_format(name: str, precision) -> None:
    case = CASES[name]
    times = [Fraction(1, 2), Fraction(2)]
    peer = odefun(case.top, case.start, times, precision, system=case.system)
    ours = propagate(case.top, case.start, times, precision, system=case.system)
    assert distance(peer, ours) < 1000 * precision.eps
    assert peer.evaluations


@pytest.mark.slow
def test_a_run_that_gives_up_before_its_only_time_has_no_state(capfd) -> None:
    pytest.importorskip("sksundae")
    case, finer = CASES["lagrange"], ("tolerance", Fraction(1, 10**16))
    run = run_peer("sundials:CVODE", case.top, case.start, [Fraction(20)], setting=finer)
    assert (run.outcome, len(run.states)) == (Outcome.STEP_TOO_SMALL, 0)
    assert 5 < run.time_reached < 10
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(("name", "step"), [("splitting:4", True), ("sundials:CVODE", False)])
def test_more_times_add_no_steps(name: str, step: bool) -> None:
    """Rounding of the spans between the times shortens no fixed step; CVODE counts steps at any number of times."""
    pytest.importorskip("sksundae")
    case, times = CASES["lagrange"], [Fraction(i, 5) for i in range(1, 101)]
    setting = ("step", Fraction(1, 100)) if step else ("tolerance", Fraction(1, 10**6))
    many, alone = (run_peer(name, case.top, case.start, samples, setting=setting) for samples in (times, times[-1:]))
    assert many.steps == alone.steps == (2000 if step else 241)


@pytest.mark.parametrize(
    ("states", "outcome", "count"),
    [
        ([[0.0] * 6, [float("nan")] * 6, [0.0] * 6], Outcome.NON_FINITE, 1),
        ([[0.0] * 6, [float("inf")] * 6], Outcome.NON_FINITE, 1),
        ([[float("nan")] * 6], Outcome.NON_FINITE, 0),
        ([[0.0] * 6], Outcome.STEP_LIMIT, 1),
        ([], Outcome.STEP_LIMIT, 0),
        ([[0.0] * 6] * 3, Outcome.SUCCESS, 3),
    ],
)
def test_what_a_library_gives_back_is_judged(states, outcome: Outcome, count: int) -> None:
    fake = double_peer("fake", 1, lambda given: Solved(states, 0.5, 1, outcome=Outcome.STEP_LIMIT))
    run = fake(CASES["euler"].top, CASES["euler"].start, TIMES, DOUBLE)
    assert run.outcome is outcome
    assert len(run.states) == len(run.times) == count
    reached = 5 if outcome is Outcome.SUCCESS else 0 if count < len(states) == 1 else Fraction(1, 2)
    assert run.time_reached == reached


def test_fewer_states_without_an_outcome_are_incomplete() -> None:
    fake = double_peer("fake", 1, lambda given: Solved([[0.0] * 6], 0.5, 1))
    assert fake(CASES["euler"].top, CASES["euler"].start, TIMES, DOUBLE).outcome is Outcome.INCOMPLETE


def test_the_tolerance_in_force_is_the_one_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    """SciPy's relative ones end at 100 eps; its field is the program's, in Python here."""
    asked = Request(HEAVY_TOP, np.linspace(0.1, 0.6, 6), np.ones(1), np.array([3.0, 2, 1, 0, 0, 0, 0]), 1e-15)
    monkeypatch.setattr(scipy_ivp, "rates", lambda *_: lambda time, y, numbers: np.array(asked.field(y)))
    texts = [scipy_ivp._solver("DOP853")(replace(asked, control=control)).tolerance for control in (1e-15, 1e-9)]
    assert texts == ["relative 2.22e-14, absolute 1e-15", ""]


@pytest.mark.parametrize(
    ("name", "control", "size", "message"),
    [
        ("heyoka", "step", FINE, "heyoka does not support step"),
        ("splitting:2", "tolerance", FINE, "does not support tolerance"),
        ("scipy:LSODA", "tolerance", Fraction(0), "above 0, up to 1"),
    ],
)
def test_what_does_not_control_a_peer_is_refused(name: str, control: str, size: Fraction, message: str) -> None:
    with pytest.raises(InputError, match=message):
        run_peer(name, CASES["euler"].top, CASES["euler"].start, TIMES, DOUBLE, setting=(control, size))


EXAMPLE = (Path(__file__).parents[2] / "examples" / "mine" / "mine.py").read_text("utf-8")


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another package with the peer of the example, and with bad ones."""
    (tmp_path / "adapter_of_docs.py").write_text(EXAMPLE + "\nnot_callable = 3\n")
    (tmp_path / "broken.py").write_text("raise RuntimeError('no licence')")
    peers = {"rk4": "adapter_of_docs:rk4", "broken": "broken:x", "absent": "nowhere:x"}
    named_peers(tmp_path, peers | {"three": "adapter_of_docs:not_callable"}, "heyoka = adapter_of_docs:rk4")
    monkeypatch.syspath_prepend(tmp_path)


@pytest.mark.usefixtures("package")
def test_another_package_adds_peers_and_replaces_none() -> None:
    case = CASES["generic"]
    coarse, fine = (
        run_peer("mine:rk4", case.top, case.start, TIMES, setting=("step", Fraction(1, n))) for n in (50, 100)
    )
    ours = run_peer("heyoka", case.top, case.start, TIMES, DOUBLE)
    assert ours.integrator == "heyoka"
    assert 14 < distance(coarse, ours) / distance(fine, ours) < 18


@pytest.mark.usefixtures("package")
def test_a_broken_peer_is_an_error_in_words() -> None:
    reasons = registry.available()  # a process for each
    assert reasons["mine:rk4"] is None
    for name, cause in {
        "broken": "is broken: RuntimeError: no licence",
        "absent": "is not available: No module named 'nowhere'",
        "three": "is not callable",
    }.items():
        with pytest.raises(InputError, match=cause) as caught:
            registry.peer(f"mine:{name}")
        assert "repair or remove that package" in caught.value.remedy
        assert cause in str(reasons[f"mine:{name}"])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "seconds", "said"),
    [("os._exit(7)", 60, "ends the process that"), ("time.sleep(99)", 3, "is not imported within 3 s")],
)
def test_a_package_that_ends_or_holds_its_process_is_listed_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, seconds: int, said: str
) -> None:
    (tmp_path / "harmful.py").write_text(f"import os, time\n{module}\n")
    named_peers(tmp_path, {"harmful": "harmful:x"})
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registry, "_PATIENCE", seconds)
    assert said in str(registry.available()["mine:harmful"])
    assert registry.available()["heyoka"] is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "names"),
    [
        ("scipy", {"scipy:DOP853", "scipy:LSODA", "scipy:Radau"}),
        ("CyRK", {"cyrk:DOP853", "cyrk:Vern8"}),
        ("numba", {"cyrk:DOP853", "cyrk:Vern8"}),
        ("sksundae", {"sundials:CVODE"}),
        ("diffrax", {"diffrax:Dopri8"}),
    ],
)
def test_a_peer_that_is_not_installed_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, module: str, names: set[str]
) -> None:
    before = {name for name, reason in registry.available().items() if reason is None}
    monkeypatch.setitem(sys.modules, module, None)
    after = {name for name, reason in registry.available().items() if reason is None}
    assert before - after == names
    for name in names:
        with pytest.raises(MissingExtra, match=f"{name} needs the extra peers: pip install 'heavytop.peers.'"):
            registry.require(name)
        assert "pip install 'heavytop[peers]'" in str(registry.available()[name])


@pytest.mark.slow
def test_without_numba_the_field_is_evaluated_in_python() -> None:
    code = """
import sys
sys.modules["numba"] = None
from fractions import Fraction
from heavytop.integrate import registry
from heavytop.cases import CASES
case = CASES["generic"]
for name, control, size in (("scipy:DOP853", "tolerance", 10**10), ("splitting:4", "step", 512)):
    run = registry.ready(name, (control, Fraction(1, size)))(case.top, case.start, [Fraction(2)])
    print(run.flags["field"], *run.states[-1])
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    case = CASES["generic"]
    ours = propagate(case.top, case.start, [Fraction(2)], DOUBLE)
    lines = [line.split() for line in result.stdout.splitlines()]
    assert [line[0] for line in lines] == ["python", "python"]
    for line in lines:
        np.testing.assert_allclose([float(text) for text in line[1:]], ours.states[-1], rtol=0, atol=1e-8)


@pytest.mark.slow
def test_nothing_is_imported_before_it_is_used() -> None:
    code = (
        "import sys, heavytop.features.kinds, heavytop.integrate.registry as p; p.known();"
        "print([m for m in ('numba', 'jax', 'scipy', 'CyRK', 'sksundae', 'heyoka', 'sympy') if m in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout == "[]\n"
