"""`compare` and `history` on the command line: policies, output files, and what is refused."""

import json
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest
import typer

import heavytop as ht
from heavytop.cli import run_command_line
from support.reports import store
from support.small_reports import error, report, row


@pytest.fixture
def reports(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    worse = row(metrics={**row().metrics, "drift_energy_max": error("5e-12")})
    for name, made in (("old", row()), ("worse", worse), ("same", row())):
        Path(name).mkdir()
        store.write(report(made), Path(name))
    return tmp_path


@pytest.fixture
def heavytop(monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """Runs the command of these words; returns its exit code."""

    def run(*arguments: str) -> int:
        monkeypatch.setattr("sys.argv", ["heavytop", *arguments])
        try:
            return run_command_line()
        except (SystemExit, typer.Exit) as done:
            return int(getattr(done, "code", None) or getattr(done, "exit_code", 0))

    return run


@pytest.mark.slow
def test_a_policy_decides_and_options_count_before_it(reports, heavytop, capsys) -> None:
    assert heavytop("compare", "old", "worse") == 1
    (reports / "policy.toml").write_text("loss_digits = 1")
    assert heavytop("compare", "old", "worse", "--policy", "policy.toml") == 0
    assert heavytop("compare", "old", "worse", "--policy", "policy.toml", "--loss", "1") == 1
    capsys.readouterr()


def test_files_are_written_beside_the_text_and_say_the_same(reports, heavytop, capsys) -> None:
    names = ["--markdown", "out.md", "--junit", "out.xml", "--json"]
    assert heavytop("compare", "old", "worse", *names) == 1
    document = json.loads(capsys.readouterr().out)
    assert list(document) == ["verdict", "findings", "rows", "environment"]
    assert document["findings"][0].startswith("Drift of the energy 1e-12 → 5e-12 on euler")
    assert "worse | drift euler heyoka double | drift\\_energy: max" in Path("out.md").read_text()
    assert ElementTree.parse("out.xml").getroot().get("failures") == "1"
    assert {path.name for path in reports.iterdir()} == {"old", "worse", "same", "out.md", "out.xml"}


WRITTEN = {"--html": "page.html", "--markdown": "out.md", "--junit": "out.xml"}


@pytest.mark.slow
@pytest.mark.parametrize("refused", WRITTEN)
@pytest.mark.parametrize("name", ["nowhere/out", "old", "/dev/null", "same.out"])
def test_all_files_are_written_or_none(reports, heavytop, capsys, refused: str, name: str) -> None:
    given = {**WRITTEN, refused: name}
    if name == "same.out":
        given = dict.fromkeys(WRITTEN, "page.html")
    before = {path: path.read_bytes() for path in reports.rglob("*") if path.is_file()}
    assert heavytop("compare", "old", "worse", *(part for pair in given.items() for part in pair)) == 2
    assert {path: path.read_bytes() for path in reports.rglob("*") if path.is_file()} == before
    captured = capsys.readouterr()
    assert ("is named twice" if name == "same.out" else f"{name} cannot be written") in captured.err
    assert captured.out == ""


@pytest.mark.parametrize(
    "line",
    [
        "compare old worse --html worse/report.json",
        "compare old worse/report.json --junit old/../worse/report.json",
        "compare old worse --policy rules.toml --markdown rules.toml",
        "history old worse --html old/report.json",
        "show old --html old/report.json",
        "show old/report.json --markdown old/../old/report.json",
        "export old --to csv --out old/report.json",
        "score rules.toml --html rules.toml",
        "show old --markdown old/report.json.sha256",
        "score rules.toml --out scored --html scored/report.json",
        "propagate --file rules.toml --omega 1,0,0 --quaternion 1,0,0,0 --times 1 --csv rules.toml",
        "gate --plan rules.toml --markdown rules.toml",
        "gate --integrator mine.py:solve --html mine.py",
        "gate --baseline old --out old/../old",
    ],
)
def test_what_is_read_is_not_written_over(reports, heavytop, capsys, line: str) -> None:
    (reports / "rules.toml").write_text("floor = 4\n")
    before = {path: path.read_bytes() for path in reports.rglob("*") if path.is_file()}
    assert heavytop(*line.split()) == 2
    assert {path: path.read_bytes() for path in reports.rglob("*") if path.is_file()} == before
    assert f"{line.split()[-1]} is named twice" in capsys.readouterr().err


@pytest.mark.parametrize("nth", [1, 2])
def test_a_full_disk_leaves_no_file_behind(reports, heavytop, monkeypatch, capsys, nth: int) -> None:
    synced = []

    def full(descriptor: int) -> None:
        synced.append(descriptor)
        if len(synced) == nth:
            raise OSError(28, "No space left on device")

    (reports / "out.md").write_text("of before")
    before = sorted(reports.iterdir())
    monkeypatch.setattr("os.fsync", full)
    assert heavytop("compare", "old", "worse", "--junit", "out.xml", "--markdown", "out.md") == 2
    assert len(synced) == nth
    assert "No space left" in capsys.readouterr().err
    assert sorted(reports.iterdir()) == before
    assert (reports / "out.md").read_text() == "of before"


@pytest.mark.slow
def test_a_page_that_cannot_be_written_leaves_no_table(reports, heavytop, capsys) -> None:
    pytest.importorskip("pyarrow")
    for page, table in (("nowhere/page.html", "rows.parquet"), ("page.html", "nowhere/rows.parquet")):
        before = sorted(reports.iterdir())
        assert heavytop("show", "old", "--html", page, "--parquet", table) == 2
        assert "cannot be written" in capsys.readouterr().err
        assert sorted(reports.iterdir()) == before
    assert heavytop("show", "old", "--html", "page.html", "--parquet", "rows.parquet") == 0
    assert capsys.readouterr().out == "rows.parquet\npage.html\n"
    assert Path("page.html").read_text("utf-8").rstrip().endswith("</html>")


def test_nothing_is_written_where_a_report_is_wrong(reports, heavytop, capsys) -> None:
    content = (reports / "worse" / "report.json").read_text()
    (reports / "cut.json").write_text(content[:-40])
    before = sorted(reports.iterdir())
    assert heavytop("compare", "old", "cut.json", "--markdown", "out.md", "--junit", "out.xml") == 2
    assert "not a whole report" in capsys.readouterr().err
    assert sorted(reports.iterdir()) == before


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("compare old same --loss -1", "loss_bits must not be negative; got -1"),
        ("compare old same --floor x", "not a finite number"),
        ("compare old same --junit=", "cannot be written"),
        ("history old same --metric [x", "must be a glob"),
    ],
)
def test_bad_input_is_refused_in_words(reports, heavytop, capsys, line: str, message: str) -> None:
    assert heavytop(*line.split()) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert captured.out == ""


@pytest.mark.slow
def test_a_report_of_very_many_rows_is_shown_by_its_worst(reports, heavytop, monkeypatch, capsys) -> None:
    file = store.write(report(*(row(case=f"top[{i}]") for i in range(30))), reports / "old")
    for most, count in ((30, 30), (29, 1)):
        monkeypatch.setattr("heavytop.report.render.text.MOST_LISTED", most)
        assert heavytop("show", "old", "--full") == 0
        text = capsys.readouterr().out
        assert "30 measurements" in text
        assert text.count("top[") == count
    assert "--parquet" in text
    file.write_text(file.read_text().replace('"top[7]"', '"top[8]"'))
    (reports / "old" / "report.json.sha256").unlink()
    assert heavytop("show", "old") == 2
    assert "twice" in capsys.readouterr().err


@pytest.mark.slow
def test_a_history_shows_what_changed_or_what_is_asked_for(reports, heavytop, capsys) -> None:
    assert heavytop("history", "old", "same", "worse") == 0
    text = capsys.readouterr().out
    assert "drift_energy_max" in text
    assert "▲" in text
    assert "break_away_time" not in text
    assert heavytop("history", "old", "worse", "--metric", "break*", "--json", "--html", "h.html") == 0
    document = json.loads(capsys.readouterr().out)
    assert [track["metric"] for track in document["tracks"]] == ["break_away_time"]
    assert "break_away_time" in Path("h.html").read_text()
    assert heavytop("history", "old", "same") == 0
    assert "Nothing changed. --metric" in capsys.readouterr().out
    assert heavytop("history", "old", "same", "--metric", "seconds *") == 0
    assert "Nothing changed. --metric" in capsys.readouterr().out
    for option, text, known in (("case", "eulr", "euler"), ("metric", "drift_enrgy_max", "drift_energy_max")):
        assert heavytop("history", "old", "same", f"--{option}", text) == 2
        said = f"No {option} of the reports matches '{text}'.\n  Did you mean {known}? They have "
        assert said in capsys.readouterr().err


@pytest.mark.slow
def test_python_gives_what_the_commands_write(reports, heavytop, capsys) -> None:
    commands = {
        "history": ["history", "old", "same", "worse", "--html", "h.html", "--json"],
        "show": ["show", "old", "--html", "s.html", "--markdown", "s.md"],
        "export": ["export", "old", "--to", "csv"],
        "shown": ["show", "old", "--json"],
    }
    printed = {}
    for name, line in commands.items():
        heavytop(*line)
        printed[name] = capsys.readouterr().out
    over, report = ht.history(["old", "same", "worse"]), ht.read_report("old")
    assert (json.loads(printed["history"]), Path("h.html").read_text()) == (over.to_json(), over.to_html())
    assert (Path("s.html").read_text(), Path("s.md").read_text()) == (report.to_html(), report.to_markdown())
    assert (printed["export"], json.loads(printed["shown"])) == (report.export("csv"), report.to_json())
    assert [over.names[i] for track in over.tracks for i in track.steps] == ["worse"]
    assert "drift_energy_max" in repr(over)
    with pytest.raises(ht.InputError, match="at least two reports"):
        ht.history([report])
    assert ht.history([report, "worse"]).to_json()["tracks"] == ht.history(["old", "worse"]).to_json()["tracks"]
