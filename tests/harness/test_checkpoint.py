"""What a run keeps on disk: taken up again to the same bytes, refused where it does not belong, never half written."""

import io
import json
import random
import resource
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import msgspec
import pytest

from heavytop.api.run_folder import prepare
from heavytop.errors import InputError
from heavytop.features.kinds import KINDS
from heavytop.files import line
from heavytop.harness import rows as one_row
from heavytop.harness.checkpoint import Checkpoint, Saved, locked
from heavytop.records import SCHEMA, Report
from support import in_process, small_reports
from support.helpers import python, wait_until
from support.reports import Row, drift, measure, plan_file, replace, store, tasks_of

pytestmark = pytest.mark.slow

VALIDATION = Path(__file__).parents[2] / "validation"
IDENTITY = {"plan name": "tiny", "heavytop": "0.1.0"}


def row(name: str) -> Row:
    return small_reports.row(case=name)


def checkpoint(folder: Path, identity: dict[str, str] | None = None) -> Checkpoint:
    return Checkpoint(folder, identity or IDENTITY, lambda: None)


def killed(folder: Path, rows: int) -> Path:
    """The file of a run that was killed behind that many rows."""
    with suppress(KeyboardInterrupt), checkpoint(folder) as kept:
        for index in range(rows):
            kept.add(index, row(f"case {index}"))
        raise KeyboardInterrupt
    return folder / "rows.jsonl"


class Notes(Saved):
    """Saved places in memory, as text."""

    def __init__(self, before: bytes | None, every: int) -> None:
        super().__init__()
        self.before, self.every_sample, self.count, self.notes = before, every, 0, []

    def load(self):
        return None if self.before is None else msgspec.json.decode(self.before)

    def due(self) -> bool:
        self.count += 1
        return self.count % self.every_sample == 0

    def save(self, content) -> None:
        del content["run"]["seconds"]
        self.notes.append(msgspec.json.encode(content))


@pytest.fixture(scope="module")
def tasks(tmp_path_factory: pytest.TempPathFactory):
    short = drift("kovalevskaya", "gyrostat", runs=[("extended", "4", 12)])
    long = drift("euler", "lagrange", runs=[("double", "60", 60), ("quad", "2", 12)])
    return tasks_of(tmp_path_factory.mktemp("plan"), long + short)


@pytest.mark.parametrize("index", range(6))
def test_a_row_taken_up_anywhere_ends_with_the_same_bytes(tasks, index: int) -> None:
    def measured(notes: Notes) -> bytes:
        return msgspec.json.encode(msgspec.structs.replace(measure(tasks[index], notes), seconds={}))

    every = len(tasks[index].times) // 2
    whole = Notes(None, every)
    result = measured(whole)
    assert len(whole.notes) == 2
    for place, note in enumerate(whole.notes):
        content = msgspec.json.decode(note)
        content["run"]["seconds"] = 1.0
        again = Notes(msgspec.json.encode(content), every)
        assert measured(again) == result
        # and what it saves on its own way is the same to the last digit of every ball
        assert again.notes == whole.notes[place + 1 :]


def test_a_place_reached_with_other_flags_is_refused_by_name(tasks) -> None:
    whole = Notes(None, 30)
    measure(tasks[0], whole)
    content = msgspec.json.decode(whole.notes[0])
    content["run"] |= {"seconds": 1.0, "flags": content["run"]["flags"] | {"high_accuracy": "true"}}
    with pytest.raises(InputError, match=r"high_accuracy = true \(now false\)"):
        measure(tasks[0], Notes(msgspec.json.encode(content), 30))


def test_what_was_saved_comes_back_and_what_was_damaged_does_not(tmp_path: Path) -> None:
    saved = Saved(tmp_path / "row-0.partial", "this plan", 0)
    assert saved.load() is None
    saved.save({"x": ["1e-30"], "n": 2**70})
    assert saved.load() == {"x": ["1e-30"], "n": 2**70}
    assert Saved(saved.path, "another plan").load() is None
    whole = saved.path.read_bytes()
    for damaged in (whole[:-20], whole.replace(b"1e-30", b"1e-31"), b""):
        saved.path.write_bytes(damaged)
        assert saved.load() is None
    assert [path.name for path in tmp_path.iterdir()] == ["row-0.partial"]
    assert not Saved().due()


def test_the_place_of_one_row_is_none_of_another(tmp_path: Path) -> None:
    with suppress(KeyboardInterrupt), checkpoint(tmp_path / "out") as kept:
        kept.saved(1).save({"x": ["1"]})
        one, two = (tmp_path / "out" / f"row-{index}.partial" for index in (1, 2))
        two.write_bytes(one.read_bytes())
        assert [kept.saved(index).load() for index in (1, 2)] == [{"x": ["1"]}, None]
        raise KeyboardInterrupt


def test_rows_come_back_but_for_those_that_were_cut_short_or_damaged(tmp_path: Path) -> None:
    file = killed(tmp_path / "out", 3)
    lines = file.read_bytes().splitlines(keepends=True)
    lines[2] = lines[2].replace(b"case 1", b"case 7")
    file.write_bytes(b"".join(lines) + lines[1][:40])
    with checkpoint(tmp_path / "out") as kept:
        assert sorted(kept.offsets) == [0, 2]
        kept.add(1, row("case 1"))
        assert [each.case for each in kept.rows(range(3))] == ["case 0", "case 1", "case 2"]
    assert not (tmp_path / "out").exists()


def test_an_empty_file_of_rows_is_begun_anew(tmp_path: Path) -> None:
    file = killed(tmp_path / "out", 1)
    file.write_bytes(b"")
    with checkpoint(tmp_path / "out") as kept:
        assert not kept.offsets
        kept.add(0, row("case 0"))
        assert [each.case for each in kept.rows([0])] == ["case 0"]


@pytest.mark.parametrize("forged", [b"[1]", b'["1", {}]', b"{", b'[1, {"case": 1}]'])
def test_a_forged_line_with_its_checksum_is_measured_again_or_refused(tmp_path: Path, forged: bytes) -> None:
    file = killed(tmp_path / "out", 3)
    lines = file.read_bytes().splitlines(keepends=True)
    lines[2] = line(forged)
    file.write_bytes(b"".join(lines))
    with suppress(KeyboardInterrupt), checkpoint(tmp_path / "out") as kept:
        if 1 in kept.offsets:
            with pytest.raises(InputError, match=r"Each line of .* must be a row"):
                list(kept.rows(range(3)))
        assert [each.case for each in kept.rows([0, 2])] == ["case 0", "case 2"]
        raise KeyboardInterrupt
    file.write_bytes(line(forged) + b"".join(lines[1:]))
    with pytest.raises(InputError, match="damaged in its first line"), checkpoint(tmp_path / "out"):
        pass


def spots(content: object, path: tuple = ()) -> list[tuple]:
    """Where anything stands in a document: a path of keys and places each."""
    inner = content.items() if isinstance(content, dict) else enumerate(content) if isinstance(content, list) else ()
    return [path] * bool(path) + [found for key, value in inner for found in spots(value, (*path, key))]


def forged(content: object, path: tuple, value: object) -> object:
    """The document with another value at that place; without it where that is ``...``."""
    copy = json.loads(json.dumps(content))
    inner = copy
    for key in path[:-1]:
        inner = inner[key]
    if value is ...:
        del inner[path[-1]]
    else:
        inner[path[-1]] = value
    return copy


@pytest.mark.parametrize("which", ["heyoka", "multiword"])
def test_a_forged_place_with_its_checksum_is_measured_from_the_beginning(tmp_path: Path, which: str) -> None:
    (task,) = tasks_of(tmp_path, drift("euler", integrator=which, runs=[("double", "6", 4)]))
    notes = Notes(None, 2)
    expected = measured_again(task, notes)
    place = msgspec.json.decode(notes.notes[0])
    place["run"]["seconds"] = 1.0
    source = random.Random(which)
    everywhere = [(path, value) for path in spots(place) for value in (..., None, "x", [], {"": 0}, -1)]
    # another number in the place of a number may be what was saved
    wrong = [(path, value) for path, value in everywhere if not (value == -1 and path[-1] not in ("samples", "steps"))]
    wrong = [(path, value) for path, value in wrong if "flags" not in path and path != ("run", "words", 0)]
    counts = ("samples", "count")
    wrong = source.sample(wrong, 6) + [(path, n) for path in spots(place) for n in (1, 3, 999) if path[-1] in counts]
    saved = tmp_path / "row-0.partial"
    taken = 0
    for path, value in wrong:
        content = forged(place, path, value)
        if content == place or (path == ("run", "words") and which == "heyoka"):
            continue
        saved.write_bytes(line(msgspec.json.encode(("this", content))))
        found = measured_again(task, Saved(saved, "this", 1e9))
        assert found == expected, (path, value)
        taken += 1
    assert taken > 6


def measured_again(task, saved: Saved) -> bytes:
    found = one_row.measure(KINDS[task.key.kind], task, saved)
    return msgspec.json.encode(msgspec.structs.replace(found, seconds={}))


def test_a_forged_row_with_its_checksum_is_refused_before_anything_is_measured(tmp_path: Path) -> None:
    file = plan_file(tmp_path, drift("euler", "lagrange", "gyrostat"))
    out, heard = tmp_path / "out", []

    def stop(task: object) -> None:
        heard.append(task)
        if len(heard) == 2:
            raise KeyboardInterrupt

    def run(progress, resume: bool = False):
        return prepare(file, out, workers=1, resume=resume).measure(progress)

    with pytest.raises(KeyboardInterrupt):
        run(stop)
    whole = (out / "rows.jsonl").read_bytes().splitlines(keepends=True)
    kept = [json.loads(each.split(b" ", 1)[1]) for each in whole[1:]]
    assert len(kept) == 2
    (first, one), (second, other) = kept
    wrong = [[number, one] for number in (-1, 3, 10**30)] + [[first, other], [second, one]]
    wrong += [[first, forged(one, path, value)] for path, value in [
        (("outcome",), "fine"), (("horizon",), "x"), (("key", "case"), "lagrange2"), (("key",), None),
        (("metrics", "drift_energy_max", "value"), "x"), (("metrics", "drift_energy_max", "log10"), 7.0),
        (("time_reached",), "1"), (("finite",), "yes"), (("metrics",), []),
    ]]  # fmt: skip
    for each in wrong:
        (out / "rows.jsonl").write_bytes(whole[0] + line(json.dumps(each).encode()))
        measured = []
        if each[0] == 10**30:  # no index at all: it is as if the line were not there
            continue
        with suppress(InputError):
            run(measured.append, resume=True)
            pytest.fail(f"taken: {str(each)[:200]}")
        assert not measured
    (out / "rows.jsonl").write_bytes(b"".join(whole))
    assert run(lambda task: None, resume=True).good


def test_what_was_cut_short_is_gone_before_a_shorter_row_is_added(tmp_path: Path) -> None:
    file, longer = killed(tmp_path / "out", 2), tmp_path / "longer"
    with suppress(KeyboardInterrupt), checkpoint(longer) as kept:
        kept.add(2, row("x" * 4000))
        raise KeyboardInterrupt
    cut = (longer / "rows.jsonl").read_bytes().splitlines(keepends=True)[1][:-300]
    whole = file.read_bytes()
    file.write_bytes(whole + cut)
    with suppress(KeyboardInterrupt), checkpoint(tmp_path / "out") as kept:
        assert file.read_bytes() == whole
        kept.add(2, row("case 2"))
        raise KeyboardInterrupt
    assert file.read_bytes() == killed(tmp_path / "other", 3).read_bytes()


@pytest.mark.parametrize("changed", [{"heavytop": "0.2.0"}, {"plan name": "other"}, {"simd": "8"}])
def test_a_checkpoint_of_another_run_is_refused_with_what_differs(tmp_path: Path, changed: dict[str, str]) -> None:
    file = killed(tmp_path / "out", 2)
    before = file.read_bytes()
    (key, value), = changed.items()  # fmt: skip
    with (
        pytest.raises(InputError, match=f"{key} is {IDENTITY.get(key)} there and {value} now"),
        checkpoint(tmp_path / "out", IDENTITY | changed),
    ):
        pass
    assert file.read_bytes() == before
    assert not (tmp_path / "out" / ".lock").exists()


def test_a_second_run_into_one_folder_is_refused(tmp_path: Path) -> None:
    with checkpoint(tmp_path / "out") as kept:
        kept.add(0, row("first"))
        with pytest.raises(InputError, match="Another run writes"), checkpoint(tmp_path / "out"):
            pass
        kept.add(1, row("second"))


def test_a_run_that_is_refused_or_interrupted_at_its_start_holds_no_lock(tmp_path: Path) -> None:
    for stop in (InputError("Not fit."), KeyboardInterrupt()):

        def check(stop: BaseException = stop) -> None:
            raise stop

        with pytest.raises(type(stop)), Checkpoint(tmp_path / "out", IDENTITY, check):
            pass
        assert not (tmp_path / "out").exists()
    with checkpoint(tmp_path / "out") as kept:
        kept.add(0, row("first"))


def test_a_lock_whose_name_is_gone_locks_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run opens the lock file just before another, at its end, removes the name."""
    import fcntl

    names: list[object] = []

    def slow(file: int, how: int) -> None:
        names.append(file)
        if len(names) == 1:
            (tmp_path / ".lock").unlink()
            other = locked(tmp_path)
            names.append(other)
            other.release()
        real(file, how)

    real = fcntl.flock
    monkeypatch.setattr(fcntl, "flock", slow)
    with locked(tmp_path):
        assert len(names) > 2
        with pytest.raises(InputError, match="Another run writes"):
            locked(tmp_path)


def test_a_streamed_report_is_the_one_written_at_once_a_row_a_line(tmp_path: Path) -> None:
    rows = [row(f'a "quoted"\n{{line}} {index}') for index in range(3)]
    for some in ([], rows[:1], rows):
        report = Report(SCHEMA, {"name": "x"}, {"formats": {}, "list": []}, some)
        path = store.write(replace(report, rows=[]), tmp_path, iter(some))
        assert json.loads(path.read_bytes()) == msgspec.to_builtins(report)
        assert path.read_bytes().count(b"\n") == 1 + max(1, len(some)) + 1
        assert path.read_bytes() == store.write(report, tmp_path).read_bytes()
        assert store.read(tmp_path) == report


def test_a_kill_at_every_call_that_changes_the_disk_changes_nothing(tmp_path: Path) -> None:
    plan = plan_file(tmp_path, drift("euler", "lagrange", runs=[("double", "2", 2)]))
    done = python(VALIDATION / "killed_everywhere.py", plan, tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 15


def command(folder: Path, out: Path, *options: str) -> list[str]:
    return ["run", "--plan", str(folder / "plan.toml"), "--workers", "1", "--out", str(out), *options]


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("quick")
    plan_file(folder, drift("euler", runs=[("double", "20", 40), ("quad", "2", 40)]))
    in_process.printed(*command(folder, folder / "whole"))
    return folder


def resumed(quick: Path, out: Path) -> str:
    return in_process.printed(*command(quick, out, "--resume"))


def rows_of(folder: Path) -> list[dict]:
    return [each | {"seconds": None} for each in json.loads((folder / "report.json").read_bytes())["rows"]]


@pytest.mark.parametrize("limit", [300, 5000])
def test_a_full_disk_is_said_with_exit_2_and_the_run_goes_on_once_there_is_space(quick: Path, limit: int) -> None:
    out, (soft, hard) = quick / f"full{limit}", resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
    try:
        said = in_process.refused(*command(quick, out, "--save-every", "0"))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert "cannot be written" in said
    assert not (out / "report.json").exists()
    resumed(quick, out)
    assert rows_of(out) == rows_of(quick / "whole")


def test_sigterm_ends_a_run_with_exit_143_and_it_goes_on(quick: Path) -> None:
    out = quick / "terminated"
    line = [sys.executable, "-m", "heavytop", *command(quick, out, "--save-every", "0")]
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    wait_until(lambda: process.poll() is not None or list(out.glob("row-*.partial")), 60, nap=0.001)
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 143
    assert "--resume continues" in errors
    assert "Traceback" not in errors
    assert (out / "rows.jsonl").exists()
    resumed(quick, out)
    assert rows_of(out) == rows_of(quick / "whole")
    assert "(already finished)" in resumed(quick, out)


def test_each_row_of_a_finished_run_is_read_from_the_disk_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    escapes = '[[measure]]\nkind = "homoclinic"\ncases = ["delone"]\nprecisions = ["double", "extended"]\nsamples = 2\n'
    plan = plan_file(tmp_path, escapes + drift("euler"))
    read: list[int] = []
    rows = Checkpoint.rows
    monkeypatch.setattr(Checkpoint, "rows", lambda self, indices: (read.extend(indices), rows(self, indices))[1])
    monkeypatch.setattr("heavytop.report.render.page.write_report", lambda report, path, kinds: path.touch())
    opened: list[str] = []
    opens = io.open

    def counted(file: object, *given: object, **more: object) -> object:
        opened.append(str(file))
        return opens(file, *given, **more)

    monkeypatch.setattr(io, "open", counted)
    run = prepare(plan, tmp_path / "out", workers=1)
    assert run.measure().good
    assert opened.count(str(tmp_path / "out" / "rows.jsonl")) == 2  # one adds rows, the other reads them
    assert str(tmp_path / "out" / "report.json") not in opened
    assert read == list(range(len(run.tasks)))
    laws = [each for each in store.read(tmp_path / "out").rows if each.key.kind == "break_away_law"]
    assert [law.precision for law in laws] == ["double,extended", "double,extended"]
