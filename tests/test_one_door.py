"""Command line and Python are one: the same input gives the same numbers, or the same error with the same remedy."""

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import msgspec
import pytest
from typer.testing import CliRunner, Result

import heavytop as ht
from heavytop.api.integrators import case_document, check_integrator, listing, new_integrator
from heavytop.api.pages import page
from heavytop.cases import CASES, case
from heavytop.cli import app
from heavytop.errors import HeavyTopError, options_named
from heavytop.features.score.api import read_trajectory, scored
from support.helpers import DATA

FIXED = f"{Path(__file__).parent / 'support' / 'methods_with_memory.py'}:ab4"
GOOD: Mapping[str, dict[str, str]] = {
    "plain": {"times": "1,2.5"},
    "backward": {"times": "-1,-2"},
    "zero first": {"times": "0,1"},
    "quad": {"times": "1", "precision": "quad"},
    "tolerance": {"times": "4", "tolerance": "1e-9"},
    "step limit": {"times": "1,40", "max-steps": "7"},
    "multiword": {"times": "3", "integrator": "multiword", "precision": "double-double"},
    "multiword in 300 bits, backward": {"times": "-1,-2", "integrator": "multiword", "precision": "real:300"},
    "fixed steps": {"times": "1,2.5", "step": "1/3", "integrator": FIXED},
    "rotor": {"times": "1", "rotor": "0,0,1/3"},
    "gyrostat": {"times": "1", "system": "gyrostat", "gamma": "0,1,0", "omega": "0,1,0", "centre": "0,1,0"},
    "gamma of decimals": {"times": "1", "gamma": "0.5773502691896257,0.5773502691896257,0.5773502691896257"},
}
BAD: Mapping[str, tuple[dict[str, str], str]] = {
    "no time": ({"times": ""}, "times: '' is not a finite number"),
    "time not a number": ({"times": "1,x"}, "times: 'x' is not a finite number"),
    "time infinite": ({"times": "inf"}, "times: 'inf' is not"),
    "times of both signs": ({"times": "-1,1"}, "different signs"),
    "times not in order": ({"times": "2,1"}, "must move strictly away from 0"),
    "a time twice": ({"times": "1,1"}, "must move strictly away from 0"),
    "out of reach": ({"times": "1e16"}, ""),
    "moment 0": ({"inertia": "3,0,1", "times": "1"}, "I2 must be positive; got 0"),
    "two moments": ({"inertia": "3,2", "times": "1"}, "inertia must have 3 numbers; got 2"),
    "moment not a number": ({"inertia": "3,nan,1", "times": "1"}, "'nan' is not a finite number"),
    "weight infinite": ({"weight": "inf", "times": "1"}, "weight: 'inf' is not"),
    "gamma not on the sphere": ({"gamma": "3/5,0,4", "times": "1"}, "gamma is not a unit vector"),
    "gamma 0": ({"gamma": "0,0,0", "times": "1"}, ""),
    "four components": ({"omega": "1,2,3,4", "times": "1"}, "omega must have 3 numbers; got 4"),
    "precision unknown": ({"precision": "triple", "times": "1"}, "Unknown precision 'triple'"),
    "precision too fine": ({"precision": "real:99999", "times": "1"}, "24 to 20000"),
    "integrator unknown": ({"integrator": "nobody", "times": "1"}, "`heavytop list`"),
    "no such file": ({"integrator": "nowhere.toml", "times": "1"}, ""),
    "format not of heyoka": ({"precision": "double-double", "times": "1"}, "multiword"),
    "tolerance 0": ({"tolerance": "0", "times": "1"}, "got 0"),
    "tolerance above 1": ({"tolerance": "2", "times": "1"}, ""),
    "tolerance of an integrator without": ({"tolerance": "1e-9", "integrator": "splitting2", "times": "1"}, ""),
    "no step": ({"max-steps": "0", "times": "1"}, "step_limit must be at least 1; got 0"),
    "step 0": ({"step": "0", "integrator": FIXED, "times": "1"}, ""),
    "step of an integrator without": ({"step": "1/9", "times": "1"}, "Leave it out"),
    "system unknown": ({"system": "kite", "times": "1"}, "Unknown system 'kite'"),
    "rotor of a heavy top": ({"rotor": "0,0,1", "system": "heavy_top", "times": "1"}, ""),
    "gyrostat with Mγ = 0": ({"system": "gyrostat", "omega": "0,0,0", "times": "1"}, ""),
    "too large": ({"omega": "1e200,0,0", "times": "1"}, "too large"),
}
REFERENCES: Mapping[str, dict[str, str]] = {
    "plain": {"times": "1,2.5"},
    "any order, both signs": {"times": "2,-1,0,2", "digits": "20"},
    "beyond the doubles": {"inertia": "3e160,2e160,1e160", "weight": "1e160", "times": "1", "digits": "20"},
    "attitude": {"times": "1", "attitude": ""},
    "derivatives": {"times": "1", "digits": "20", "derivatives": "start"},
    "no time": {"times": ""},
    "time not a number": {"times": "1,x"},
    "no digits": {"times": "1", "digits": "0"},
    "too many digits": {"times": "1", "digits": "20001"},
    "derivatives unknown": {"times": "1", "derivatives": "end"},
    "system unknown": {"times": "1", "system": "kite"},
    "gamma not on the sphere": {"gamma": "3/5,0,4", "times": "1"},
    "moment negative": {"inertia": "3,-2,1", "times": "1"},
}
_RENAMED = {"max-steps": "step_limit"}


def body_and_start(given: dict[str, str]) -> tuple[ht.HeavyTop, ht.State, dict[str, Any]]:
    """The Python arguments of the same words; what is left over is by name."""

    def vector(text: str) -> list[str]:
        return text.split(",")

    left = {_RENAMED.get(key, key): value for key, value in given.items()}
    data = {key: left.pop(key) for key in ("inertia", "weight", "centre", "omega", "gamma")}
    rotor = left.pop("rotor", None)
    top = ht.HeavyTop(
        vector(data["inertia"]), data["weight"], vector(data["centre"]), None if rotor is None else vector(rotor)
    )
    start = ht.State(vector(data["omega"]), vector(data["gamma"]))
    options: dict[str, Any] = {"times": [time.strip() for time in left.pop("times").split(",")]} | left
    for name in ("step_limit", "digits"):
        if name in options:
            options[name] = int(options[name])
    if "attitude" in options:
        options["attitude"] = True
    return top, start, options


def of_python(call: Callable[..., Any], given: dict[str, str], **more: Any) -> Any:
    top, start, options = body_and_start(given)
    return call(top, start, **options, **more)


def invoked(*words: str) -> Result:
    """The command of these words, whose errors are raised."""
    return CliRunner().invoke(app, list(words), catch_exceptions=False, standalone_mode=False)


def of_command(command: str, given: dict[str, str]) -> Any:
    words = [part for key, value in given.items() for part in (f"--{key}", *([value] if key != "attitude" else []))]
    return json.loads(invoked(command, *words, "--json").stdout)


def outcome(call: Callable[[], Any]) -> Any:
    """What it gives, or its error in words, with options of the command line by the names of Python's arguments."""
    try:
        return call()
    except HeavyTopError as error:
        return type(error), _in_python(error.cause), _in_python(error.remedy)


def _in_python(text: str) -> str:
    text = text.replace("--max-steps", "step_limit")
    return re.sub(r"--([a-z][a-z-]*)", lambda option: option[1].replace("-", "_"), text)


@pytest.mark.slow
@pytest.mark.parametrize("name", GOOD)
def test_good_input_propagates_to_the_same_numbers(name: str) -> None:
    given = DATA | GOOD[name]
    printed, run = of_command("propagate", given), of_python(ht.propagate, given)
    assert printed["states"] == run.texts()
    assert (printed["outcome"], printed["steps"]) == (run.outcome.value, run.steps)
    assert "step" not in given or run.steps == 3 + 5
    assert (printed["system"], printed["integrator"]) == (run.problem.system.name, run.integrator)
    assert (printed["precision"], printed["bits"]) == (run.problem.precision.name, run.problem.precision.bits)
    assert run.integrator != "multiword" or {"words", "bits", "step_rule", "tolerance"} <= printed["flags"].keys()
    metrics = {name: number["value"] for name, number in printed["metrics"].items()}
    drifts = {name: (each.max, each.rms, each.final) for name, each in ht.drift(run).items()}
    assert {name: tuple(metrics[f"drift_{name}_{which}"] for which in ("max", "rms", "final")) for name in drifts} == {
        name: tuple(metric.value for metric in each) for name, each in drifts.items()
    }


@pytest.mark.slow
@pytest.mark.parametrize("name", BAD)
def test_bad_input_of_a_propagation_is_the_same_error(name: str) -> None:
    changes, message = BAD[name]
    said = outcome(lambda: of_command("propagate", DATA | changes))
    assert isinstance(said, tuple)
    assert message in f"{said[1]} {said[2]}"
    assert said == outcome(lambda: of_python(ht.propagate, DATA | changes))


@pytest.mark.slow
@pytest.mark.parametrize("name", REFERENCES)
def test_a_reference_is_the_same_or_the_same_error(name: str) -> None:
    given = DATA | REFERENCES[name]
    printed = outcome(lambda: of_command("reference", given))
    known = outcome(lambda: of_python(ht.reference, given))
    if isinstance(known, tuple):
        assert printed == known
    else:
        document = known.document()
        assert {key: printed[key] for key in document} == document


@pytest.mark.slow
def test_angles_are_of_both() -> None:
    given = DATA | {"times": "1,2", "attitude": ""}
    printed, run = of_command("propagate", given), of_python(ht.propagate, given, angles=True)
    assert run.angles().tolist() == [[float(value) for value in line] for line in printed["angles"]]


EVENTS = {
    "omega1": {"times": "9"},
    "gamma3 = 1/2": {"times": "1,-9"},
    "omega1*gamma2": {"times": "9", "event-direction": "-1"},
    "nothing": {"times": "9"},
    "1/0": {"times": "9"},
    "omega3": {"times": "0"},
    "gamma1": {"times": "9", "event-direction": "2"},
}


@pytest.mark.slow
@pytest.mark.parametrize("function", EVENTS)
def test_events_are_the_same_or_the_same_error(function: str) -> None:
    given = DATA | EVENTS[function]
    printed = outcome(lambda: of_command("reference", given | {"events": function, "digits": "20"}))
    top, start, options = body_and_start(given)
    direction, until = int(options.get("event-direction", 0)), max(options["times"], key=lambda text: abs(float(text)))
    with options_named({"until": "the last of times", "direction": "event_direction"}):
        known = outcome(lambda: ht.events(top, start, until, function, direction, digits=20))
    if isinstance(known, tuple):
        assert printed == known
    else:
        (found,) = printed["events"]
        assert found["times"] == [{"value": ball.value, "radius": ball.radius} for ball in known.times]


COMMANDS: Mapping[str, tuple[str, Callable[[], Any]]] = {
    "audit of nothing known": ("audit nobody", lambda: ht.audit("nobody")),
    "audit of no file": ("audit nowhere.toml", lambda: ht.audit("nowhere.toml")),
    "audit of no system": ("audit ershkov-partial --system kite", lambda: ht.audit("ershkov-partial", system="kite")),
    "audit of no branch": ("audit ershkov-partial --branch third", lambda: ht.audit("ershkov-partial", branch="third")),
    "claims of no tag": ("claims --tag nothing", lambda: ht.claim_library("nothing")),
    "compare of no report": ("compare nowhere nowhere", lambda: ht.compare("nowhere", "nowhere")),
    "compare with a floor below 0": (
        "compare nowhere nowhere --floor -1",
        lambda: ht.compare("nowhere", "nowhere", floor="-1"),
    ),
    "compare with no number of bits": (
        "compare nowhere nowhere --loss x",
        lambda: ht.compare("nowhere", "nowhere", loss="x"),
    ),
    "compare by no policy": (
        "compare nowhere nowhere --policy none.toml",
        lambda: ht.compare("nowhere", "nowhere", policy="none.toml"),
    ),
    "show of no report": ("show nowhere", lambda: ht.read_report("nowhere")),
    "export of no report": ("export nowhere --to csv", lambda: ht.read_report("nowhere")),
    "history of no report": ("history nowhere nowhere", lambda: ht.history(["nowhere", "nowhere"])),
    "history of one report": ("history nowhere", lambda: ht.history(["nowhere"])),
    "figures of no report": ("figures --out new --report nowhere", lambda: ht.read_report("nowhere")),
    "run of no plan": ("run --plan nobody", lambda: ht.run("nobody")),
    "run of no file": ("run --plan nowhere.toml", lambda: ht.run("nowhere.toml")),
    "run without workers": ("run --plan smoke --workers 0", lambda: ht.run("smoke", workers=0)),
    "run of a seed too large": ("run --plan smoke --seed 2000", lambda: ht.run("smoke", seed=2000)),
    "run beside nobody": ("run --plan smoke --integrator nobody", lambda: ht.run("smoke", integrator="nobody")),
    "run in no time": ("run --plan smoke --row-timeout 0", lambda: ht.run("smoke", row_timeout="0")),
    "gate of no plan": ("gate --plan nobody --bless", lambda: ht.run("nobody")),
    "power of no fault": (
        "power --until 1 --tolerance 1e-3 --case euler --planted none",
        lambda: ht.power(case("euler").top, case("euler").start, 1, "1e-3", planted="none"),
    ),
    "selftest without workers": ("selftest --workers 0", lambda: ht.run("smoke", workers=0)),
    "hunt of nobody": ("hunt --integrator nobody", lambda: ht.hunt("nobody")),
    "hunt for no time": ("hunt --horizon 0", lambda: ht.hunt(horizon="0")),
    "hunt in no family": ("hunt --family kites", lambda: ht.hunt(family="kites")),
    "hunt beyond 0": ("hunt --limit 0", lambda: ht.hunt(limit="0")),
    "hunt on no budget": ("hunt --budget x", lambda: ht.hunt(budget="x")),
    "hunt against itself": ("hunt --against heyoka", lambda: ht.hunt(against="heyoka")),
    "hunt in no format": ("hunt --precision triple", lambda: ht.hunt(precision="triple")),
    "check of nobody": ("check-integrator nobody", lambda: check_integrator("nobody")),
    "check of no file": ("check-integrator nowhere.toml", lambda: check_integrator("nowhere.toml")),
    "new in no language": ("new new --language latin", lambda: new_integrator(Path("new"), "latin")),
    "body of no file": ("body nowhere.urdf", lambda: ht.Body.from_file("nowhere.urdf")),
    "list of no case": ("list --case nobody", lambda: case("nobody")),
    "docs of nothing": ("docs nothing", lambda: page("nothing")),
    "score to no digits": ("score nowhere.csv --require -1", lambda: read_trajectory("nowhere.csv", require="-1")),
    "score of no file": ("score nowhere.csv", lambda: read_trajectory("nowhere.csv")),
    "score of no case": ("score nowhere.csv --case none", lambda: read_trajectory("nowhere.csv", "none")),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_bad_input_of_every_other_command_is_the_same_error(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words, call = COMMANDS[name]
    said = outcome(lambda: invoked(*words.split()))
    assert isinstance(said, tuple)
    assert said == outcome(call)
    assert list(tmp_path.iterdir()) == []


RESULTS = Path(__file__).parents[1] / "results"


@pytest.mark.parametrize(
    ("words", "limits"),
    [
        ("claims claims", {}),
        ("claims claims --floor 4 --loss 1/2", {"floor": 4, "loss": "1/2"}),
        ("claims default", {}),
    ],
)
def test_a_comparison_is_the_same(words: str, limits: Mapping[str, Any], tmp_path: Path) -> None:
    old, new, *options = words.split()
    files = {kind: tmp_path / f"comparison.{kind}" for kind in ("junit", "markdown")}
    folders = [str(RESULTS / each) for each in (old, new)]
    outputs = [part for kind, file in files.items() for part in (f"--{kind}", str(file))]
    done = CliRunner().invoke(app, ["compare", *folders, *options, *outputs, "--json"], catch_exceptions=False)
    found = ht.compare(*folders, **limits)
    assert json.loads(done.stdout) == json.loads(json.dumps(found.to_json()))
    assert done.exit_code == found.exit_code
    assert files["junit"].read_text("utf-8") == found.to_junit()
    assert files["markdown"].read_text("utf-8") == found.to_markdown()
    read = [ht.read_report(folder) for folder in folders]
    assert ht.compare(*read, **limits).to_json() == found.to_json()


def test_the_page_of_a_comparison_is_the_same(tmp_path: Path) -> None:
    folders = [str(RESULTS / "claims")] * 2
    CliRunner().invoke(app, ["compare", *folders, "--html", str(tmp_path / "page.html")], catch_exceptions=False)
    assert (tmp_path / "page.html").read_text("utf-8") == ht.compare(*folders).to_html()


SCORED: Mapping[str, tuple[list[str], Mapping[str, Any]]] = {
    "as it is": ([], {}),
    "too few digits": (["--require", "15.5"], {"require": "15.5"}),
    "a case": (["--case", "generic"], {"case": "generic"}),
    "another case": (["--case", "euler"], {"case": "euler"}),
}


@pytest.fixture(scope="module")
def trajectory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the case generic whose last state has 8 digits."""
    known = CASES["generic"]
    run = ht.propagate(known.top, known.start, [1, 2], "double")
    states = run.texts()
    states[-1] = [f"{float(value):.8g}" for value in states[-1]]
    file = tmp_path_factory.mktemp("scored") / "mine.json"
    vectors = {name: getattr(known.top, name) for name in ("inertia", "centre")}
    vectors |= {name: getattr(known.start, name) for name in ("omega", "gamma")}
    data = {"weight": str(known.top.weight)} | {name: list(map(str, value)) for name, value in vectors.items()}
    document = {"precision": "double", **data, "times": ["1", "2"], "states": states}
    file.write_text(json.dumps(document), "utf-8")
    return file


@pytest.mark.parametrize("name", SCORED)
def test_a_score_is_the_same_or_the_same_error(name: str, trajectory: Path, request: pytest.FixtureRequest) -> None:
    words, options = SCORED[name]
    if words:  # as it is, with its diagnosis
        request.getfixturevalue("undiagnosed")

    def printed() -> Any:
        done = invoked("score", str(trajectory), *words, "--json")
        return json.loads(done.stdout), done.return_value

    def computed() -> Any:
        found = scored(*read_trajectory(trajectory, **options))
        return json.loads(json.dumps(found.to_json())), found.exit_code

    said, known = outcome(printed), outcome(computed)
    assert said == known
    assert len(known) == (3 if name == "another case" else 2)
    if name == "as it is":
        top, start = CASES["generic"].top, CASES["generic"].start
        given = json.loads(trajectory.read_text("utf-8"))
        arrays = ht.score(given["times"], given["states"], top=top, start=start, precision="double")
        assert arrays.to_json()["metrics"] == known[0]["metrics"]
        assert arrays.digits_right == known[0]["digits_right"]


@pytest.mark.usefixtures("undiagnosed")
def test_the_report_and_the_page_of_a_score_are_the_same(trajectory: Path, tmp_path: Path) -> None:
    words = ["score", str(trajectory), "--out", str(tmp_path / "new"), "--html", str(tmp_path / "page.html")]
    CliRunner().invoke(app, words, catch_exceptions=False)
    found = scored(*read_trajectory(trajectory))
    assert (tmp_path / "page.html").read_text("utf-8") == found.to_html()
    assert ht.compare(tmp_path / "new", ht.Report(*msgspec.structs.astuple(found.report()))).verdict == "same"


def test_every_command_is_in_a_table() -> None:
    tried = {words.split()[0] for words, _ in COMMANDS.values()} | {"propagate", "reference"}
    assert {command.name for command in app.registered_commands} == tried


def test_what_there_is_is_listed_by_both() -> None:
    printed = json.loads(CliRunner().invoke(app, ["list", "--json"]).stdout)
    assert printed == json.loads(json.dumps(listing()))
    shown = json.loads(CliRunner().invoke(app, ["list", "--case", "euler", "--json"]).stdout)
    assert shown == {key: value for key, value in case_document("euler").items() if key != "json"}
    with pytest.raises(HeavyTopError, match="nothing"):
        case_document("nothing")
