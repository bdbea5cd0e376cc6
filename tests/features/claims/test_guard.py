"""The process of an audit: from a plain script and from threads, and what is said of it when it dies."""

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from importlib.resources import files

import pytest

from heavytop.errors import HeavyTopError, InputError
from heavytop.features.claims.audit import audit as auditing
from heavytop.features.claims.audit import guard
from heavytop.features.claims.audit.audit import audit

EXAMPLE = str(files("heavytop.features.claims") / "examples" / "momentum-squared.toml")


@pytest.mark.slow
def test_a_plain_script_without_a_main_guard_can_audit(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(f"from heavytop.features.claims.audit.audit import audit\nprint(audit({EXAMPLE!r}).verdict)\n")
    (tmp_path / "json.py").write_text("raise RuntimeError('a module of the working directory was imported')\n")
    done = subprocess.run([sys.executable, "-P", str(script)], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["refuted"]


@pytest.mark.slow
def test_audits_of_a_file_run_in_threads():
    with ThreadPoolExecutor(2) as pool:
        assert [report.verdict for report in pool.map(audit, [EXAMPLE, EXAMPLE])] == ["refuted", "refuted"]


@pytest.mark.parametrize(
    ("child", "said"),
    [
        ("import os; os.kill(os.getpid(), 9)", "was killed by SIGKILL"),
        ("raise RuntimeError('broken')", "exit code 1: RuntimeError: broken"),
        ("print('{}x')", "ended without an answer"),
    ],
)
def test_a_process_that_dies_is_not_one_that_took_too_long(monkeypatch, child, said):
    monkeypatch.setattr(guard, "_CHILD", child)
    with pytest.raises(HeavyTopError, match=said) as caught:
        guard.in_time(EXAMPLE, "heavy_top")
    assert caught.value.exit_code == 3
    assert "took more than" not in str(caught.value)


@pytest.mark.slow
def test_who_uses_the_processor_is_stopped_long_before_the_limit_of_the_clock(monkeypatch):
    monkeypatch.setattr(guard, "_WALL", 3000)
    limited = "from heavytop.features.claims.audit.guard import limit_process; limit_process(int(sys.argv[4]))"
    endless = f"import sys; sys.path[:] = {sys.path}; {limited}; [0 for _ in iter(int, 1)]"
    monkeypatch.setattr(guard, "_CHILD", endless)
    with pytest.raises(InputError, match=r"more than 0.1 s and was stopped"):
        guard.in_time(EXAMPLE, "heavy_top", seconds=0.1)


@pytest.mark.parametrize(("error", "cause"), [(MemoryError, "more than 3 GB"), (RecursionError, "nested too deeply")])
def test_a_process_without_memory_or_stack_says_so(monkeypatch, error, cause):
    def find(path: str) -> None:
        raise error

    monkeypatch.setattr(auditing, "find_claim", find)
    answer = auditing.answer(EXAMPLE, "")
    monkeypatch.setattr(guard, "_CHILD", f"print({json.dumps(answer)!r})")
    with pytest.raises(InputError, match=f"{EXAMPLE}: .*{cause}"):
        guard.in_time(EXAMPLE, "heavy_top")


def claim(value: str, before: str = "", where: str = "") -> str:
    top = '[top]\ninertia = ["2", "3", "4"]\nweight = "1"\ncentre = ["1", "2", "3"]\n'
    return f'name = "x"\nkind = "integral"\n{before}{top}[integral]\nvalue = "{value}"\n{where}'


HOSTILE = {
    "a sine of twelve terms": claim("sin(" + " + ".join(f"{n}*Omega1*Omega2^{n}" for n in range(1, 13)) + ")"),
    "nested sines": claim("sin(1+" * 40 + "Omega1" + ")" * 40),
    "powers of powers": claim("9^9^9"),
    "a number of 100000 digits": claim("sin(a)", 'parameters = {a = "1e99999"}\n'),
    "dotted keys": "a." * 20_000 + "b = 1\n",
    "a relation in the time": claim("Omega1", 'relations = ["t"]\n'),
    "conditions of high degree": claim(
        "Omega1",
        where="where = "
        + json.dumps(
            [f"Omega1^{n}*gamma1 + Omega2^{n} - Omega3^{n - 1}*gamma3 + Omega1*Omega2 - {n}" for n in (4, 5, 6)]
        ),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE)
def test_whatever_a_file_holds_its_audit_ends_in_time_with_a_verdict_or_a_reason(tmp_path, text):
    """Reading and parsing included: nothing of the file is looked at in the caller's process."""
    path, began = tmp_path / "claim.toml", time.monotonic()
    path.write_text(text)
    with suppress(InputError):
        assert guard.in_time(str(path), "heavy_top", seconds=0.5).verdict in ("undecided", "refuted")
    assert time.monotonic() - began < 2 * guard._WALL + 1


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_a_file_that_never_comes_to_an_end_is_given_up_and_no_process_is_left(tmp_path, monkeypatch):
    path = tmp_path / "pipe.toml"
    os.mkfifo(path)
    with pytest.raises(InputError, match="was stopped"):
        guard.in_time(str(path), "heavy_top", seconds=0.2)
    # a child whose caller is gone ends by itself
    command = [sys.executable, "-c", guard._CHILD, json.dumps(sys.path), str(path), "heavy_top", "1", "1"]
    assert subprocess.run(command, capture_output=True, timeout=20, check=False).returncode == -signal.SIGALRM


@pytest.mark.slow
def test_a_hard_limit_of_memory_below_its_own_is_kept(tmp_path):
    pytest.importorskip("resource")
    code = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30));"
        "from heavytop.features.claims.audit.guard import limit_process; limit_process(9);"
        "print(resource.getrlimit(resource.RLIMIT_AS)[0] >> 30)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["2"]


def test_flint_without_memory_says_so(monkeypatch):
    code = "import os, sys; sys.stderr.write('Exception (FLINT). Unable to allocate memory.\\n'); os.abort()"
    monkeypatch.setattr(guard, "_CHILD", code)
    with pytest.raises(InputError, match="more than 3 GB"):
        guard.in_time(EXAMPLE, "heavy_top")


@pytest.mark.slow
def test_a_path_that_is_none_is_refused():
    for path in ("a\0b.toml", "missing\udcff.toml"):
        with pytest.raises(InputError, match="cannot be read"):
            audit(path)
