"""The committed table of certified states: readable without the package, remade by it, and true."""

import json
from fractions import Fraction
from pathlib import Path

import msgspec
import pytest

from reference_table import CertifiedMotion, cases, motion, write

TABLE = Path(__file__).parents[2] / "results" / "reference" / "states.json"
MOTIONS = json.loads(TABLE.read_text(encoding="utf-8"))
FAR = Fraction(10**6)


def of(name):
    return next(m for m in MOTIONS if m["case"] == name)


def test_the_table_holds_every_case_once():
    assert [m["case"] for m in MOTIONS] == [case.name for case in cases()]
    assert len({m["case"] for m in MOTIONS}) == len(MOTIONS)


@pytest.mark.parametrize("entry", MOTIONS, ids=lambda m: m["case"])
def test_values_are_narrow_certified_and_keep_the_integrals_of_the_start(entry):
    inertia, centre = ([Fraction(x) for x in entry[key]] for key in ("inertia", "centre"))
    start = [Fraction(x) for x in entry["omega"] + entry["gamma"]]

    def area(y):
        return sum(i * w * g for i, w, g in zip(inertia, y[:3], y[3:], strict=True))

    def energy(y):
        kinetic = sum(i * w * w for i, w in zip(inertia, y[:3], strict=True)) / 2
        if entry["system"] == "gyrostat":
            return kinetic + Fraction(entry["rotor"]) * inertia[1] * y[1]
        return kinetic + Fraction(entry["weight"]) * sum(r * g for r, g in zip(centre, y[3:], strict=True))

    def length(y):
        return sum(g * g for g in y[3:])

    for state in entry["states"]:
        digits = entry["digits"]
        assert state["certificate"]["agreed_digits"] >= digits >= 30
        y = [Fraction(ball["value"]) for ball in state["state"]]
        for ball in state["state"]:
            assert Fraction(ball["radius"]) <= Fraction(1, 10**digits) * max(1, abs(Fraction(ball["value"])))
        for integral in (area, energy, length):
            assert abs(integral(y) - integral(start)) < Fraction(10**4, 10**digits)


def test_closed_forms_reach_a_million():
    far = {m["case"] for m in MOTIONS if any(Fraction(s["time"]) == FAR for s in m["states"])}
    near = {m["case"] for m in MOTIONS if m["method"].startswith("validated")}
    assert near == {
        "generic asymmetric",
        "generic asymmetric, far",
        "generic asymmetric, farthest",
        "paper data, I1/I3 = 6",
        "beside goryachev",
        "beside kowalewski",
        "beside chaplygin",
    }
    assert far == {m["case"] for m in MOTIONS} - near


def test_the_homoclinic_motion_of_the_table_has_come_back_to_its_saddle():
    far = next(s for s in of("delone, homoclinic")["states"] if Fraction(s["time"]) == FAR)
    for ball, saddle in zip(far["state"], (0, 1, 0, 0, 1, 0), strict=True):
        assert abs(Fraction(ball["value"]) - saddle) <= Fraction(ball["radius"])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["grioli", "pendulum, separatrix"])
def test_the_committed_entries_are_what_the_command_makes(name):
    made = motion(next(case for case in cases() if case.name == name), 100)
    assert json.loads(msgspec.json.encode(made)) == of(name)


@pytest.mark.slow
def test_the_command_writes_a_table_that_reads_back(tmp_path, monkeypatch):
    few = [case for case in cases() if case.name in ("staude", "lagrange, sleeping")]
    monkeypatch.setattr("reference_table.cases", lambda: iter(few))
    made = msgspec.json.decode(write(tmp_path / "new", 20).read_bytes(), type=list[CertifiedMotion])
    assert [m.case for m in made] == [case.name for case in few]
    assert all(entry.certificate.agreed_digits >= 20 for m in made for entry in m.states)
