"""What a command run in the process of the tests leaves behind."""

import sys
from pathlib import Path

import pytest

from support import in_process


def test_integrators_of_a_test_go_and_libraries_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever the environment stands, a temporary folder included: a library loaded twice would be two."""
    environment = tmp_path / "environment"
    for folder in (environment, tmp_path):
        folder.mkdir(exist_ok=True)
        (folder / f"from_{folder.name}.py").write_text("")
    monkeypatch.setattr(sys, "path", [str(environment), str(tmp_path), *sys.path])
    monkeypatch.setattr(in_process.tempfile, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr(sys, "prefix", str(environment))

    def command() -> None:
        __import__("from_environment")
        __import__(f"from_{tmp_path.name}")

    monkeypatch.setattr(in_process, "main", command)
    assert in_process.heavytop("list").returncode == 0
    assert "from_environment" in sys.modules
    assert f"from_{tmp_path.name}" not in sys.modules
    del sys.modules["from_environment"]
