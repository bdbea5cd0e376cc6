"""The integrator that was called words is multiword wherever it is named, and reports of before are read so."""

import hashlib
import json
import shutil
from pathlib import Path

import msgspec
import pytest

import heavytop as ht
from heavytop import records
from heavytop.api.run_folder import prepare
from heavytop.errors import InputError
from heavytop.files import line, verified
from heavytop.harness.plan import former
from heavytop.integrate import registry
from heavytop.integrate.registry import command_of, named
from heavytop.report.compare.noise import Policy
from heavytop.report.store.store import DIGEST, FILE
from support import in_process
from support.helpers import START, TOP
from support.helpers import options as words
from support.reports import asked, compare, drift, plan_of, read_plan, store

pytestmark = pytest.mark.slow


def plan(folder: Path, name: str) -> str:
    work = asked("work_precision", "euler", horizon="1", ladders=[{"integrator": name, "tolerances": ["1e-9"]}])
    file = folder / f"{name}.toml"
    file.write_text(f'name = "tiny"\n{drift("euler", integrator=name)}{work}', "utf-8")
    return str(file)


def as_before(text: str) -> str:
    """A report or a checkpoint as it was written when the name was words; method, flags and numbers as they are."""
    for key in ('"integrator":"{}', '"name":"{}"', '"measured":"computed: {} in'):
        text = text.replace(key.format("multiword"), key.format("words"))
    return text


@pytest.fixture(scope="module")
def now(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs")
    prepare(plan(folder, "multiword"), folder / "now", workers=1).measure()
    return folder / "now"


@pytest.fixture
def before(now: Path, tmp_path: Path) -> Path:
    shutil.copytree(now, tmp_path / "before")
    text = as_before((now / FILE).read_text("utf-8"))
    assert "multiword" not in text.partition('"rows":')[2]
    (tmp_path / "before" / FILE).write_text(text, "utf-8")
    digest = hashlib.sha256(text.encode()).hexdigest()
    (tmp_path / "before" / DIGEST).write_text(f"{digest}  {FILE}\n")
    return tmp_path / "before"


def test_a_report_of_before_is_read_with_the_name_of_now(now: Path, before: Path) -> None:
    for read in (store.read, store.read_brief):
        old, new = (list(read(folder).rows) for folder in (before, now))
        assert old == new
        assert {row.key.subject.name for row in old} == {"multiword"}
        for pair in ((before, now), (now, before)):
            assert compare(*map(read, pair), Policy()).verdict == "same"
    assert "multiword" in str(ht.read_report(before))


def test_a_scored_file_keeps_whatever_its_writer_called_his_program(now: Path) -> None:
    row = store.read(now).rows[0]
    given = row.key.subject.__class__("given", "words")
    row = msgspec.structs.replace(row, key=msgspec.structs.replace(row.key, subject=given))
    assert records.of_row(row) is row


def test_a_plan_of_before_measures_the_same(tmp_path: Path) -> None:
    old, new = (read_plan(plan(tmp_path, name))[2] for name in ("words", "multiword"))
    assert [task.key for task in old] == [task.key for task in new]
    assert [task.label for task in old] == [task.label for task in new]
    assert former(plan(tmp_path, "words")) == {"words"}
    assert former(plan(tmp_path, "multiword")) == former("default") == former("no such file.toml") == set()
    document = {"name": "n", "measure": [{"kind": "drift", "cases": ["euler"], "runs": [], "integrator": "words"}]}
    assert plan_of(document).measure[0].integrator == "multiword"
    assert document["measure"][0]["integrator"] == "words"


def test_a_run_of_before_goes_on(now: Path, tmp_path: Path) -> None:
    folder, file = tmp_path / "run", plan(tmp_path, "multiword")
    run = prepare(file, folder, workers=1)
    with pytest.raises(KeyboardInterrupt):
        run.measure(_interrupted)
    lines = [as_before(verified(each).decode()) for each in (folder / "rows.jsonl").read_bytes().splitlines()]
    assert any('"words"' in each for each in lines)
    (folder / "rows.jsonl").write_bytes(b"".join(line(each.encode()) for each in lines))
    prepare(file, folder, workers=1, resume=True).measure()
    again, whole = ([row for row in store.read(each).rows if row.key.kind == "drift"] for each in (folder, now))
    assert [row.metrics for row in again] == [row.metrics for row in whole]
    assert records.of_identity({"plan integrator": "words", "commit": "words"}) == {
        "plan integrator": "multiword",
        "commit": "words",
    }
    assert records.of_plan({"name": "words", "integrator": "words"}) == {
        "name": "words",
        "integrator": "multiword",
    }


def _interrupted(*_: object) -> None:
    raise KeyboardInterrupt


def test_python_takes_both_names_and_says_the_one_of_now() -> None:
    one, other = (ht.propagate(TOP, START, [1], ht.DOUBLE_DOUBLE, integrator=name) for name in ("words", "multiword"))
    assert one.texts() == other.texts()
    assert one.integrator == other.integrator == "multiword"
    many = ht.ensemble(TOP, [START] * 3, [1], integrator="words")
    assert [each.integrator for each in many] == ["multiword"] * 3


def test_the_name_of_before_is_nobody_elses(tmp_path: Path) -> None:
    assert "multiword" in registry.known()
    assert "words" not in registry.known()
    assert not registry.is_third_party("words")
    assert named("words") == "multiword"
    with pytest.raises(InputError, match="built-in"):
        command_of({"name": "words", "command": ["x"], "setting": "step"}, tmp_path, "here")


def test_the_command_line_takes_it_with_one_line_of_notice(tmp_path: Path) -> None:
    found = in_process.heavytop("propagate", *words(times="1", integrator="words"), "--json")
    assert json.loads(found.stdout)["integrator"] == "multiword"
    assert found.stderr == "heavytop: note: the integrator words is called multiword now\n"
    run = in_process.heavytop("run", "--plan", plan(tmp_path, "words"), "--workers", 1, "--out", tmp_path / "out")
    assert run.returncode == 0
    assert run.stderr.count("is called multiword now") == 1
