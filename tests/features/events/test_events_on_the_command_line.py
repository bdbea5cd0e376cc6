"""`propagate --events` and `reference --events`: the keys, the texts and the errors."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli import app

TOP = ht.HeavyTop((3, 2, 1), 1, ("1/2", "1/3", "1/5"))
START = ht.State(("1/10", "2/5", "9/10"), ("3/5", 0, "4/5"))
DATA = {"inertia": "3,2,1", "weight": "1", "centre": "1/2,1/3,1/5", "omega": "1/10,2/5,9/10", "gamma": "3/5,0,4/5"}
OPTIONS = [part for name, value in (DATA | {"times": "1,10"}).items() for part in (f"--{name}", value)]


def call(*arguments: str):
    return CliRunner().invoke(app, [*arguments, *OPTIONS])


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["heyoka", "multiword"])
def test_propagate_gives_the_events_of_python(integrator: str) -> None:
    asked = "--events", "gamma3=1/2", "--events", "omega1 = 1/5", "--event-direction", "1"
    done = call("propagate", *asked, "--integrator", integrator, "--json")
    assert done.exit_code == 0, done.output
    document = json.loads(done.stdout)
    assert document["times"] == ["1", "10"]
    assert [each["function"] for each in document["events"]] == ["gamma3=1/2", "omega1 = 1/5"]
    for each in document["events"]:
        same = ht.events(TOP, START, 10, each["function"], 1, integrator=integrator)
        assert each["times"] == same.time_texts()
        assert each["states"] == same.texts()
        assert each["directions"] == [1] * len(same)
        assert (each["guarantee"], each["direction"]) == ("polynomial", 1)
    assert "events" not in json.loads(call("propagate", "--json").stdout)


@pytest.mark.slow
def test_reference_gives_balls() -> None:
    done = call("reference", "--events", "gamma3=1/2", "--digits", "20", "--json")
    document = json.loads(done.stdout)
    same = ht.events(TOP, START, 10, "gamma3=1/2", digits=20)
    (found,) = document["events"]
    assert [ball["value"] for ball in found["times"]] == same.time_texts()
    assert set(found["states"][0][0]) == {"value", "radius"}
    assert (found["guarantee"], found["until"], found["digits"]) == ("proven", "10", 20)
    text = call("reference", "--events", "gamma3=1/2", "--digits", "20").stdout
    assert "Events gamma3=1/2: 2, proven" in text
    assert "8.61080937422653829536 ± 4.27E-21, rising" in " ".join(text.split())
    assert "Events gamma2: " in call("propagate", "--events", "gamma2").stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "cause"),
    [
        (("propagate", "--events", ""), "is not a function"),
        (("propagate", "--events", "omega9"), "is not a component"),
        (("propagate", "--events", "nan"), "is not a component"),
        (("reference", "--events", "omega1=inf"), "is not a component"),
        (("propagate", "--events", "omega1", "--event-direction", "2"), "direction must be a sign; got 2"),
        (("propagate", "--events", "omega1", "--integrator", "mpmath:odefun"), "hands over no polynomial"),
        (("propagate", "--events", "gamma1**2 + gamma2**2 + gamma3**2 = 1"), "is zero along this motion"),
    ],
)
def test_bad_input_has_a_cause(arguments: tuple[str, ...], cause: str) -> None:
    done = call(*arguments)
    assert cause in str(done.exception)
    assert done.exception.exit_code == 2  # type: ignore[union-attr]


def test_a_run_that_stops_says_how_far_was_looked() -> None:
    done = call("propagate", "--events", "gamma2", "--max-steps", "5")
    assert done.exit_code == 3
    assert "Looked up to t = " in done.stdout
