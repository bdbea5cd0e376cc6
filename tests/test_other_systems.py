"""Another system than the one that runs the tests: what Unix alone has is taken away before anything is imported."""

from __future__ import annotations

import json

import pytest

from support import in_process
from support.helpers import options, python

pytestmark = pytest.mark.slow

PROGRAM = """
import asyncio, importlib, os, pkgutil, select, signal, sys
import filelock, flint, heyoka, jinja2, llvmlite.binding, matplotlib.pyplot, mpmath, msgspec, numpy, rich.live, sympy
import loky.backend.process, loky.backend.resource_tracker, multiprocessing.connection, typer.rich_utils

for name in ("fcntl", "resource", "termios", "tty", "pty", "pwd", "grp", "syslog", "readline"):
    sys.modules[name] = None
for module, names in {
    os: "fork killpg getpgid setsid setpgid getuid geteuid sched_getaffinity sched_yield uname waitstatus_to_exitcode",
    select: "poll epoll",
    signal: "SIGKILL SIGALRM SIGHUP alarm setitimer pthread_sigmask",
}.items():
    for name in names.split():
        if hasattr(module, name):
            delattr(module, name)
sys.platform = "win32"

import heavytop

failed = {}
for found in pkgutil.walk_packages(heavytop.__path__, "heavytop."):
    if found.name != "heavytop.__main__":
        try:
            importlib.import_module(found.name)
        except BaseException as error:
            failed[found.name] = repr(error)
assert failed == {}, failed

from heavytop.cli import app
from typer.testing import CliRunner

done = CliRunner().invoke(app, sys.argv[1:])
assert done.exception is None or done.exit_code == 0, done.output
print(done.stdout)
"""


def test_every_module_is_imported_and_a_motion_computed_without_what_unix_alone_has() -> None:
    command = ["propagate", *options(), "--json"]
    done = python("-c", PROGRAM, *command)
    assert done.returncode == 0, done.stderr
    there, here = json.loads(done.stdout), json.loads(in_process.heavytop(*command).stdout)
    assert there["outcome"] == "success"
    assert there["states"] == here["states"]
