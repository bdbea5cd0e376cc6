"""The process of an audit: from a plain script and from threads, and what is said of it when it dies."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib.resources import files

import pytest

from heavytop.claims import guard
from heavytop.claims.audit import audit
from heavytop.errors import HeavyTopError, InputError

EXAMPLE = str(files("heavytop.claims") / "examples" / "momentum-squared.toml")


def test_a_plain_script_without_a_main_guard_can_audit(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(f"from heavytop.claims.audit import audit\nprint(audit({EXAMPLE!r}).verdict)\n")
    (tmp_path / "json.py").write_text("raise RuntimeError('a module of the working directory was imported')\n")
    done = subprocess.run([sys.executable, "-P", str(script)], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["refuted"]


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


def test_a_process_without_memory_says_so(monkeypatch):
    monkeypatch.setattr(guard, "_CHILD", "print('{\"memory\": true}')")
    with pytest.raises(InputError, match="more than 3 GB"):
        guard.in_time(EXAMPLE, "heavy_top")
