"""The command line in the process of the tests: no interpreter starts, no library is loaded again.

What a process of its own is the point of (signals, closed streams, limits, what an import loads, workers that are
spawned, ``python -O``) is tested in one.
"""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Collection, Iterator
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

import flint
import mpmath

from heavytop.__main__ import main

HERE = Path(__file__).resolve().parents[2]
SIGNALS = (signal.SIGINT, signal.SIGTERM)


def heavytop(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """What ``heavytop ARGUMENTS`` prints and its exit code, in ``cwd`` or here.

    An error that is none of the program's is a traceback on standard error and exit 1, as in a process.  Fails where
    the command leaves anything behind that the next one would see.
    """
    line = ["heavytop", *map(str, arguments)]
    out, errors = (io.TextIOWrapper(io.BytesIO(), "utf-8", newline="", write_through=True) for _ in range(2))
    code: object = 0
    with _as_before(line), chdir(cwd or "."), redirect_stdout(out), redirect_stderr(errors):
        try:
            main()
        except SystemExit as ended:
            code = ended.code or 0
        except Exception:
            traceback.print_exc()
            code = 1
    assert isinstance(code, int)
    texts = [stream.buffer.getvalue().decode() for stream in (out, errors)]
    return subprocess.CompletedProcess(line, code, *texts)


def printed(*arguments: object, cwd: Path | None = None) -> str:
    """What ``heavytop ARGUMENTS``, which succeeds, prints."""
    done = heavytop(*arguments, cwd=cwd)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def refused(*arguments: object, cwd: Path | None = None, code: int = 2) -> str:
    """What ``heavytop ARGUMENTS``, which is refused, says on standard error; it prints nothing, and no traceback."""
    done = heavytop(*arguments, cwd=cwd)
    assert (done.returncode, done.stdout) == (code, ""), done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    return done.stderr


@contextmanager
def _as_before(line: list[str]) -> Iterator[None]:
    """The program's own argv, its handler of Ctrl-C and modules of the test go; all else has to be as it was."""
    argv, sys.argv = sys.argv, line
    interrupt, before, loaded = signal.getsignal(signal.SIGINT), state(), set(sys.modules)
    try:
        yield
    finally:
        sys.argv = argv
        signal.signal(signal.SIGINT, interrupt)
        forget_integrators(loaded)
    assert state() == before


def forget_integrators(loaded: Collection[str]) -> None:
    """Unload the integrators of tests that were loaded since ``loaded`` were all modules there are."""
    for name in sys.modules.keys() - loaded:
        if _is_temporary(sys.modules[name]):
            del sys.modules[name]


def _is_temporary(module: object) -> bool:
    """Whether it is an integrator of one test, whose name the next gives to another.

    The checkout and its environment may stand in a temporary folder themselves: what they hold is loaded once.
    """
    file = Path(getattr(module, "__file__", None) or "")
    lasting = (HERE, Path(sys.prefix), Path(sys.base_prefix))
    return file.is_relative_to(tempfile.gettempdir()) and not any(map(file.is_relative_to, lasting))


def state() -> dict[str, object]:
    """What one command could leave to the next: folder, environment, signals, streams, precisions, import path."""
    return {
        "folder": os.getcwd(),
        "environment": dict(os.environ),
        "signals": [signal.getsignal(number) for number in SIGNALS],
        "streams": (sys.stdout, sys.stderr),
        "flint": (flint.ctx.prec, flint.ctx.threads),
        "mpmath": mpmath.mp.prec,
        "path": list(sys.path),
    }
