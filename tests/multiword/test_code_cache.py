"""Machine code on disk: what is damaged, foreign or cannot be kept is compiled again, and never a wrong number."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy
import pytest

from heavytop.errors import InputError
from heavytop.files import cache_folder
from heavytop.multiword.codegen import code_cache
from heavytop.multiword.codegen.machine_code import POINTER, Machine, once, pointer
from support.words_helpers import machine_of

CHANGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda _: b"",
    "cut short": lambda content: content[:-1],
    "longer": lambda content: content + b"\0",
    "without its code": lambda content: content.partition(b"\n")[0] + b"\n",
    "some text": lambda _: b"some text\n",
}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "heavytop" / "multiword"


def thrice(calls: list[int]) -> Callable[[int], Machine]:
    """Code that multiplies a vector by 3, compiled at the first call of what is returned; calls: of the compiler."""

    def make(factor: int) -> Machine:
        calls.append(factor)

        def write(_, code) -> None:
            (vector,) = code.arguments
            code.store(code.load(vector, 0) * float(factor), vector, 0)

        return machine_of(write, [POINTER])

    return once(make)


def require_right(machine: Machine) -> None:
    room = numpy.zeros(16)
    vector = room[(-room.ctypes.data % 64) // 8 :][:8]
    vector[:] = range(8)
    machine.functions["f"](pointer(vector))
    assert [*vector] == [3.0 * k for k in range(8)]


def kept(folder: Path) -> Path:
    """The file of a first process, whose code is right."""
    require_right(thrice([])(3))
    (file,) = folder.iterdir()
    return file


def test_a_second_process_compiles_nothing(folder: Path) -> None:
    kept(folder)
    calls: list[int] = []
    require_right(thrice(calls)(3))
    assert calls == []


def test_other_arguments_have_other_code(folder: Path) -> None:
    kept(folder)
    calls: list[int] = []
    thrice(calls)(4)
    assert calls == [4]
    assert len([*folder.iterdir()]) == 2


def test_a_flipped_bit_is_noticed_wherever_it_is(folder: Path) -> None:
    file = kept(folder)
    content = file.read_bytes()
    for place in (*range(200), *range(200, len(content), 13)):
        damaged = bytearray(content)
        damaged[place] ^= 1 << place % 8
        file.write_bytes(damaged)
        assert code_cache.read(file.name) is None


@pytest.mark.parametrize("change", CHANGES)
def test_a_damaged_file_is_compiled_again_and_replaced(folder: Path, change: str) -> None:
    file = kept(folder)
    content = file.read_bytes()
    file.write_bytes(CHANGES[change](content))
    calls: list[int] = []
    require_right(thrice(calls)(3))
    assert calls == [3]
    assert code_cache.read(file.name) is not None


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="the system has no owners of files")
def test_what_others_may_write_counts_as_none(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = kept(folder)
    file.chmod(0o666)
    assert code_cache.read(file.name) is None
    file.chmod(0o600)
    assert code_cache.read(file.name) is not None
    monkeypatch.setattr(os, "getuid", lambda: 1 + file.stat().st_uid)
    assert code_cache.read(file.name) is None


def test_a_cache_that_cannot_be_written_changes_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> str:
        raise InputError("No space left on device.")

    monkeypatch.setattr(code_cache, "replace", full)
    require_right(thrice([])(3))
    monkeypatch.setenv("XDG_CACHE_HOME", os.devnull)
    require_right(thrice([])(3))
    folder.parent.mkdir(parents=True, exist_ok=True)
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder.parent))
    (folder.parent / "heavytop").write_bytes(b"")  # a file where the folder would be
    require_right(thrice([])(3))


def test_the_folder_does_not_grow_without_end(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(code_cache, "_MOST_FILES", 3)
    for number in range(5):
        code_cache.write(str(number), b"code", b"{}")
    assert len([*folder.iterdir()]) == 3
    assert code_cache.read("4") == (b"code", b"{}")


def test_a_relative_folder_of_caches_is_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "caches")
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    assert cache_folder("code") == Path.home() / ".cache" / "heavytop" / "code"
