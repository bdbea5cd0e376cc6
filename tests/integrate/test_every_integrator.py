"""One contract for every integrator that `list` names: this program's two, the peers, and the planted faults' base."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from heavytop.api.faulty_integrators import FAULTS, Fault
from heavytop.cases import CASES, Case
from heavytop.errors import InputError, PeerFailed
from heavytop.exact.enclosure.run import Validated
from heavytop.integrate import registry
from heavytop.integrate.heyoka.motions import propagate
from heavytop.integrate.peers.double import count, fill, rates
from heavytop.integrate.registry import INTEGRATORS
from heavytop.integrate.trajectory import Outcome, Problem, Trajectory
from heavytop.precision import DOUBLE, DOUBLE_DOUBLE, exact, number, real
from heavytop.top.attitude import perpendicular
from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, Parameters, System
from heavytop.top.heavy_top import HeavyTop, State
from support.helpers import distance, named_peers, run_peer
from support.in_process import heavytop

F = Fraction
NAMES = [*INTEGRATORS, "planted fault"]
GENERIC = CASES["generic"]
FORWARDS_ONLY = {"mpmath:odefun"}
HANGING = HeavyTop((3, 2, 1), 1, (0, 0, F(1, 2))), State((0, 0, 0), (0, 0, 1))
ERROR = {"splitting:2": 1e-3, "splitting:4": 1e-7, "scipy:Radau": 1e-6}


def call(name: str, top: HeavyTop, start: State, times: Sequence[Fraction], system: System = HEAVY_TOP) -> Trajectory:
    """One run in double, through the very call that everything else takes."""
    fixed = name in INTEGRATORS and INTEGRATORS[name].control == "step"
    options: dict[str, Any] = {"step": F(1, 64)} if fixed else {}
    if name.startswith("scipy:Radau"):
        options = {"tolerance": F(1, 10**8)}
    which = Fault("none").integrator if name == "planted fault" else name
    return registry.propagator(which, options)(top, start, times, DOUBLE, system=system)


@pytest.mark.slow
@pytest.mark.parametrize("name", INTEGRATORS)
def test_capabilities_are_those_of_the_functions(name: str) -> None:
    """Options, the formats it takes, and what sets its error."""
    each = INTEGRATORS[name]
    if each.lacks:
        return
    taken = set(inspect.signature(registry.peer(name)).parameters)
    assert each.control in taken
    assert {"step": "tolerance", "tolerance": "step"}[each.control] not in taken
    assert each.streams == ({"observer", "step_limit", "place", "mark"} <= taken)
    assert each.attitude
    assert registry.ready(name).carries_attitude
    assert bool(each.ensemble) == each.streams
    for form in (DOUBLE, DOUBLE_DOUBLE, real(80)):
        if {form.name, form.family} & set(each.formats or ()):
            assert len(registry.propagator(name, {})(GENERIC.top, GENERIC.start, [F(0)], form).states) == 1
        else:
            with pytest.raises((InputError, PeerFailed)):
                registry.propagator(name, {})(GENERIC.top, GENERIC.start, [F(0)], form)


def test_an_integrator_added_as_the_manual_says_is_listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An entry point, and a line of the table."""
    named_peers(tmp_path, {"own": "heavytop.integrate.peers.splitting:order2"})
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registry, "_of_packages", lru_cache(registry._of_packages.__wrapped__))
    monkeypatch.setitem(INTEGRATORS, "new", replace(INTEGRATORS["splitting:2"], name="new"))
    shown = heavytop("list", "--json")
    assert shown.returncode == 0
    listed = json.loads(shown.stdout)
    assert (listed["integrators"]["mine:own"], listed["integrators"]["new"]) == ("installed", "installed")
    assert listed["capabilities"]["new"]["control"] == "step"
    assert set(listed["capabilities"]["mine:own"].values()) == {None, False}
    assert list(listed["integrators"])[:2] == ["heyoka", "multiword"]


def test_the_deliberately_faulty_ones_are_instances() -> None:
    for fault in FAULTS.values():
        assert fault.integrator.systems == ("heavy_top",)
        assert not fault.integrator.ensemble
        assert registry.peer(fault.integrator) == fault.propagate


def bits(run: Trajectory) -> list[list[str]]:
    return [[float(x).hex() for x in state] for state in run.states]


def agree(name: str, one: Sequence[Any], other: Sequence[Any]) -> None:
    np.testing.assert_allclose(np.asarray(one, float), np.asarray(other, float), rtol=0, atol=ERROR.get(name, 1e-9))


def ends_well(run: Trajectory, times: Sequence[Fraction]) -> None:
    assert run.outcome is Outcome.SUCCESS
    assert run.times == tuple(times)
    assert run.time_reached == times[-1]
    assert np.shape(run.states) == (len(times), 6)
    assert run.steps >= 0
    assert run.integrator
    assert run.seconds["run"] >= 0
    assert run.seconds["compile"] >= 0


def start_is_its_own_sample(name: str) -> None:
    for times in ([F(0)], [F(0), F(1)]):
        run = call(name, GENERIC.top, GENERIC.start, times)
        ends_well(run, times)
        assert [exact(x) for x in run.states[0]] == list(Problem.of(GENERIC.top, GENERIC.start, DOUBLE).start.flat)
    assert call(name, GENERIC.top, GENERIC.start, [F(0)]).steps == 0
    if name not in FORWARDS_ONLY:
        ends_well(call(name, GENERIC.top, GENERIC.start, [F(0), F(-1)]), [F(0), F(-1)])


def samples_are_those_of_one_motion(name: str) -> None:
    many = call(name, GENERIC.top, GENERIC.start, [F(1, 4), F(1)])
    alone = call(name, GENERIC.top, GENERIC.start, [F(1)])
    ends_well(many, [F(1, 4), F(1)])
    ends_well(alone, [F(1)])
    agree(name, many.states[-1], alone.states[-1])
    assert bits(call(name, GENERIC.top, GENERIC.start, [F(1)])) == bits(alone), "the same call gives the same bits"


def backwards_is_the_reversed_motion(name: str) -> None:
    times = [F(1, 2), F(1)]
    reversed_start = State([-w for w in GENERIC.start.omega], GENERIC.start.gamma)
    if name in FORWARDS_ONLY:
        with pytest.raises(InputError, match="only forward in time"):
            call(name, GENERIC.top, GENERIC.start, [-t for t in times])
        return
    back = call(name, GENERIC.top, GENERIC.start, [-t for t in times])
    ends_well(back, [-t for t in times])
    forth = call(name, GENERIC.top, reversed_start, times)
    agree(name, back.states, np.array([-1, -1, -1, 1, 1, 1]) * np.asarray(forth.states, float))


def rest_stays_rest(name: str) -> None:
    top, start = HANGING
    run = call(name, top, start, [F(1), F(50)])
    ends_well(run, [F(1), F(50)])
    assert [[exact(x) for x in state] for state in run.states] == [list(start.flat)] * 2


def gyrostats_are_other_systems(name: str) -> None:
    for case in ("gyrostat", "heavy-gyrostat"):
        right_as(CASES[case], name)


def right_as(case: Case, name: str) -> None:
    """The state at t = 1, and where it can at t = -1, is the enclosed one."""
    if name == "planted fault":
        with pytest.raises(InputError, match=f"got {case.system.name}"):
            call(name, case.top, case.start, [F(1)], case.system)
        return
    if name.startswith("cyrk") or (name.startswith("diffrax") and case.system is GYROSTAT):
        return  # compiled anew for each system, which takes long; cyrk's are tried below
    known = Validated(case.top, case.start, case.system)
    for time in [F(1)] if name in FORWARDS_ONLY else [F(1), F(-1)]:
        run = call(name, case.top, case.start, [time], case.system)
        ends_well(run, [time])
        agree(name, run.states, [[float(ball.mid()) for ball in known.state(time, 64)]])


def what_is_not_finite_is_no_success(name: str) -> None:
    """Ω of 1e200 overflows double in Ω × Ω: whatever an integrator makes of it, no NaN passes as a success."""
    size = F(10) ** 200
    wild = State([size] * 3, GENERIC.start.gamma)
    if name == "mpmath:odefun":
        return  # its exponents have no end and its first step one length for all rates: it would not return
    if name in ("multiword", "heyoka", "heyoka:constants", "planted fault"):
        # these scale the time: nothing overflows, and time 1 would take 1e200 steps
        run = call(name, GENERIC.top, wild, [1 / size])
        ends_well(run, [exact(number(1 / size, DOUBLE))])
        assert np.isfinite(run.states).all()
        # the weight does nothing in so short a time
        other = "heyoka" if name == "multiword" else "multiword"
        free = call(other, HeavyTop(GENERIC.top.inertia, 0, (0, 0, 0)), State([1] * 3, wild.gamma), [F(1)])
        agree(name, run.states / np.repeat([1e200, 1], 3), free.states)
        return
    run = call(name, GENERIC.top, wild, [F(1)])
    assert np.isfinite(np.asarray(run.states, float)).all()
    if name.startswith("splitting"):  # steps of one length, each a rotation: nothing overflows
        ends_well(run, [F(1)])
        return
    assert run.outcome in (Outcome.NON_FINITE, Outcome.STEP_TOO_SMALL, Outcome.STEP_LIMIT)
    assert abs(run.time_reached) < 1
    assert len(run.states) == len(run.times) == 0


def a_run_that_stops_early_says_so(name: str) -> None:
    """A step limit is an outcome of those that have one; the others refuse it, as every option that they lack."""
    if name == "planted fault":
        return
    with pytest.raises(InputError, match=f"{name} does not support nonsense"):
        registry.propagator(name, {"nonsense": 1})
    if not INTEGRATORS[name].streams:
        with pytest.raises(InputError, match=f"{name} does not support step_limit"):
            registry.propagator(name, {"step_limit": 3})
        return
    limited = registry.propagator(name, {"step_limit": 3})
    run = limited(GENERIC.top, GENERIC.start, [F(1, 128), F(1000)], DOUBLE)
    assert run.outcome is Outcome.STEP_LIMIT
    assert run.times == (F(1, 128),)
    assert run.steps == 3
    assert F(1, 128) < run.time_reached < 1000
    assert np.isfinite(np.asarray(run.states, float)).all()


def whoever_watches_sees_every_state(name: str) -> None:
    """Also of an integrator that hands over its states at the end."""
    if name == "planted fault":
        return
    times, seen = [F(1, 4), F(1, 2)], list[Any]()
    watched = registry.watched(name, {}, lambda time, state: seen.append((time, [float(x).hex() for x in state])))
    run = watched(GENERIC.top, GENERIC.start, times, DOUBLE, system=HEAVY_TOP)
    assert run.outcome is Outcome.SUCCESS
    alone = registry.propagator(name, {})(GENERIC.top, GENERIC.start, times, DOUBLE, system=HEAVY_TOP)
    assert seen == list(zip(times, bits(alone), strict=True))


def bad_times_are_refused(name: str) -> None:
    for times in ([], [F(1), F(1)], [F(2), F(1)], [F(-1), F(1)]):
        with pytest.raises(InputError):
            call(name, GENERIC.top, GENERIC.start, times)


def threads_do_not_mix(name: str) -> None:
    starts = [State((F(k, 10), F(2, 5), F(9, 10)), GENERIC.start.gamma) for k in range(6)]
    in_order = [bits(call(name, GENERIC.top, start, [F(1, 2), F(1)])) for start in starts]
    with ThreadPoolExecutor(3) as pool:
        at_once = list(pool.map(lambda start: bits(call(name, GENERIC.top, start, [F(1, 2), F(1)])), starts))
    assert at_once == in_order


def the_attitude_rides_along(name: str) -> None:
    """ξ, a vector fixed in space as γ is, beside the same Ω and γ; without it none has nine numbers."""
    if name in ("planted fault", "heyoka", "multiword", "scipy:LSODA", "scipy:Radau", "splitting:2", "splitting:8"):
        return  # others of the same adapter are tried here, heyoka and multiword elsewhere
    if name.startswith(("cyrk", "diffrax")):
        return  # these compile it for seconds; their field is that of scipy and of mpmath
    xi, times = perpendicular(GENERIC.start.gamma), [F(1, 2), F(1)]
    run = registry.propagator(name, {"xi": xi})(GENERIC.top, GENERIC.start, times)
    known = Validated(GENERIC.top, GENERIC.start, xi=xi)
    assert np.shape(run.states) == (2, 9)
    agree(name, run.states, [[float(ball.mid()) for ball in known.with_attitude(time, 64)] for time in times])


CONTRACT: tuple[Callable[[str], None], ...] = (
    start_is_its_own_sample,
    samples_are_those_of_one_motion,
    backwards_is_the_reversed_motion,
    rest_stays_rest,
    gyrostats_are_other_systems,
    what_is_not_finite_is_no_success,
    a_run_that_stops_early_says_so,
    whoever_watches_sees_every_state,
    the_attitude_rides_along,
    bad_times_are_refused,
    threads_do_not_mix,
)


def need(name: str) -> None:
    """Skip where the peer's package is not there; a broken adapter fails."""
    module = {"cyrk": "CyRK", "sundials": "sksundae", "diffrax": "diffrax"}.get(name.partition(":")[0])
    if module:
        pytest.importorskip(module)


@pytest.fixture(autouse=True)
def everything_in_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    """The guard stands before the integrators: here they are tried themselves."""
    monkeypatch.setattr(registry, "MOST_STEPS", 10**400)


@pytest.mark.slow
@pytest.mark.parametrize("clause", CONTRACT, ids=lambda clause: clause.__name__)
@pytest.mark.parametrize("name", NAMES)
def test_every_integrator_keeps_the_contract(name: str, clause: Callable[[str], None]) -> None:
    need(name)
    clause(name)


# Peers and heyoka to the tolerance, here because what they compile is compiled once.


TIMES = [F(2), F(5)]
PEERS = [name for name in INTEGRATORS if name not in ("heyoka", "mpmath:odefun")]


def setting_of(name: str) -> tuple[str, Fraction]:
    if INTEGRATORS[name].control == "step":
        return "step", F(1, 1 << {"splitting:2": 17, "splitting:8": 5}.get(name, 9))
    return "tolerance", F(1, 10**8) if name == "scipy:Radau" else F(1, 10**12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "case"),
    [(name, "generic") for name in PEERS]
    + [("cyrk:DOP853", name) for name in ("gyrostat", "heavy-gyrostat")],  # of the others the contract has them
)
def test_every_peer_and_heyoka_agree_to_the_tolerance(name: str, case: str) -> None:
    need(name)
    given = CASES[case]
    ours = propagate(given.top, given.start, TIMES, DOUBLE, system=given.system)
    options = {"system": given.system, "setting": setting_of(name)}
    many, alone = (run_peer(name, given.top, given.start, times, DOUBLE, **options) for times in (TIMES, TIMES[-1:]))
    assert many.outcome is alone.outcome is Outcome.SUCCESS
    assert many.integrator == name
    assert distance(many, ours) < (F(1, 10**7) if name == "scipy:Radau" else F(1, 10**9))
    np.testing.assert_allclose(many.states[-1], alone.states[-1], rtol=0, atol=1e-9)
    assert alone.steps > (3 if name == "multiword" else 5)
    assert alone.seconds["run"] > 0
    assert alone.seconds["compile"] >= 0


@pytest.mark.slow
@pytest.mark.parametrize("system", [HEAVY_TOP, GYROSTAT, HEAVY_GYROSTAT], ids=lambda s: s.name)
def test_the_compiled_field_is_the_field(system) -> None:
    generator = np.random.default_rng(7)
    for _ in range(20):
        numbers, y = generator.uniform(0.5, 2, count(system)), generator.normal(size=6)
        rotor = F(numbers[6]) if system is not HEAVY_GYROSTAT else tuple(map(Fraction, numbers[6:]))
        exactly = Parameters(*(tuple(map(Fraction, part)) for part in (numbers[:3], numbers[3:6])), rotor)
        expected = [float(v) for v in system.field(exactly, [F(v) for v in y])]
        np.testing.assert_allclose(rates(system)(0.0, y, numbers), expected, rtol=1e-13, atol=1e-15)


@pytest.mark.slow
def test_the_compiled_field_of_nine_numbers_turns_xi_as_the_body_turns() -> None:
    """Of the gyrostat: with Ω and the rotor."""
    numbers, y, found = np.arange(1.0, 8.0), np.arange(2.0, 11.0), np.empty(9)
    fill(GYROSTAT, 9)(found, 0.0, y, numbers)
    exactly = Parameters(*(tuple(map(Fraction, part)) for part in (numbers[:3], numbers[3:6])), F(7))
    np.testing.assert_allclose(
        found, [float(v) for v in GYROSTAT.with_attitude(exactly, [F(v) for v in y])], rtol=1e-15
    )


@pytest.mark.slow
@pytest.mark.parametrize(("order", "step"), [(2, 64), (4, 8), (8, 2)])
@pytest.mark.parametrize("name", ["lagrange", "gyrostat", "heavy-gyrostat"])
def test_half_the_step_of_a_splitting_has_its_order(order: int, step: int, name: str) -> None:
    case = CASES[name]
    ours = propagate(case.top, case.start, [F(8)], DOUBLE, system=case.system)
    given = f"splitting:{order}", case.top, case.start, [F(8)]
    runs = [run_peer(*given, system=case.system, setting=("step", F(1, step * n))) for n in (1, 2)]
    assert 0.8 * 2**order < distance(runs[0], ours) / distance(runs[1], ours) < 1.6 * 2**order


@pytest.mark.slow
def test_a_splitting_keeps_the_casimirs_and_bounds_the_energy() -> None:
    case = CASES["generic"]
    times = [F(i) for i in range(1, 301)]
    problem = Problem.of(case.top, case.start, DOUBLE)
    inertia, moment = (np.array([float(v) for v in part]) for part in problem.parameters[:2])
    worst = {}
    for step in (F(1, 4), F(1, 8)):
        run = run_peer("splitting:4", case.top, case.start, times, setting=("step", step))
        y = np.array([[float(v) for v in problem.start.flat], *run.states])
        omega, gamma = y[:, :3], y[:, 3:]
        momentum = inertia * omega
        for casimir in ((gamma**2).sum(axis=1), (momentum * gamma).sum(axis=1)):
            assert np.abs(casimir - casimir[0]).max() < 2e-13
        energy = (omega * momentum).sum(axis=1) / 2 + gamma @ moment
        drift = np.abs(energy - energy[0])
        first, last = (np.sqrt(np.mean(part**2)) for part in (drift[:100], drift[-100:]))
        assert 0.5 < last / first < 2, "it does not grow"
        worst[step] = drift.max()
    assert 10 < worst[F(1, 4)] / worst[F(1, 8)] < 25
