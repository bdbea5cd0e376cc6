"""`propagate --events` and `reference --events`: the keys, the texts and the errors."""

import json

import pytest

import heavytop as ht
from support.helpers import DATA, START, TOP
from support.in_process import heavytop

OPTIONS = [part for name, value in (DATA | {"times": "1,10"}).items() for part in (f"--{name}", value)]


def call(*arguments: str):
    return heavytop(*arguments, *OPTIONS)


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["heyoka", "multiword"])
def test_propagate_gives_the_events_of_python(integrator: str) -> None:
    asked = "--events", "gamma3=1/2", "--events", "omega1 = 1/5", "--event-direction", "1"
    done = call("propagate", *asked, "--integrator", integrator, "--json")
    assert done.returncode == 0, done.stderr
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
        (("reference", "--events", "omega1=inf"), "is not a component"),
        (("propagate", "--event-direction", "1"), "given without --events"),
        (("propagate", "--events", "omega1", "--integrator", "scipy:Radau"), "has no dense output"),
    ],
)
def test_bad_input_has_a_cause(arguments: tuple[str, ...], cause: str) -> None:
    done = call(*arguments)
    assert (done.returncode, cause in done.stderr) == (2, True), done.stderr


def test_a_run_that_stops_says_how_far_was_looked() -> None:
    done = call("propagate", "--events", "gamma2", "--max-steps", "5")
    assert done.returncode == 3
    assert "Searched to t = " in done.stdout
