"""How many files take part in one flow: a row of drift, a propagation, a comparison, a Kovalevskaya reference.

``python benchmarks/hops.py`` prints, for each flow, the files of ``heavytop`` that execute a call in it, in the order
of their first call, and how many of them are not the mathematics (`top/`, `multiword/`, `exact/`).  What runs while a
module is imported counts for nothing: all modules are imported before.  Each flow is a process of its own, forked
behind that, so that nothing is cached.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import sys
import tempfile
import threading
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path
from types import FrameType
from typing import Any

import heavytop as ht

PACKAGE = Path(ht.__file__).parent
MATHEMATICS = ("top/", "multiword/", "exact/")
PLAN = """name = "one"
[[measure]]
kind = "drift"
cases = ["euler"]
runs = [{ precision = "double", horizon = "10", samples = 10 }]
"""
TOP = ht.HeavyTop(inertia=(3, 2, 1), weight=1, centre=("1/2", "1/3", "1/5"))
START = ht.State(omega=("1/10", "2/5", "9/10"), gamma=("3/5", 0, "4/5"))


def drift(folder: Path) -> Callable[[], object]:
    """From the TOML to report.json and the page."""
    (folder / "plan.toml").write_text(PLAN)
    return lambda: ht.run(folder / "plan.toml", folder / "out", workers=1)


def propagate(folder: Path) -> Callable[[], object]:
    """One motion in double."""
    return lambda: ht.propagate(TOP, START, [1, 2], ht.DOUBLE)


def compare(folder: Path) -> Callable[[], object]:
    """Two reports from disk."""
    drift(folder)()
    return lambda: ht.compare(folder / "out", folder / "out")


def reference(folder: Path) -> Callable[[], object]:
    """A Kovalevskaya top to 40 digits."""
    top = ht.HeavyTop((2, 2, 1), "1/2", ("6/5", "2/3", 0))
    start = ht.State(("1/3", "4/5", "-7/10"), ("2/7", "3/7", "6/7"))
    return lambda: ht.reference(top, start, [1, 2], 40)


FLOWS = {flow.__name__: flow for flow in (drift, propagate, compare, reference)}


def files(flow: Callable[[], object]) -> list[str]:
    """Of the package, those that execute a call in it, in the order of their first call."""
    found: dict[str, None] = {}

    def watch(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        # the bodies of modules and classes are not optimized code
        if (
            event == "call"
            and code.co_flags & inspect.CO_OPTIMIZED
            and code.co_filename.startswith(str(PACKAGE))
            and code.co_filename.endswith(".py")
        ):
            found[str(Path(code.co_filename).relative_to(PACKAGE))] = None

    threading.setprofile(watch)
    sys.setprofile(watch)
    try:
        flow()
    finally:
        sys.setprofile(None)
        threading.setprofile(None)  # type: ignore[arg-type]
    return list(found)


def main() -> None:
    """All flows, or those that are named; exit code 1 where one failed."""
    for module in pkgutil.walk_packages([str(PACKAGE)], "heavytop."):
        if "peers." not in module.name and "__main__" not in module.name:
            importlib.import_module(module.name)
    for name in sys.argv[1:] or FLOWS:
        child = get_context("fork").Process(target=show, args=(name,))
        child.start()
        child.join()
        if child.exitcode:
            sys.exit(1)


def show(name: str) -> None:
    """Goes through a flow and prints its files."""
    with tempfile.TemporaryDirectory() as folder:
        found = files(FLOWS[name](Path(folder)))
    passed_on = [file for file in found if not file.startswith(MATHEMATICS)]
    print(f"{name}: {len(found)} files, {len(passed_on)} without the mathematics\n  " + ", ".join(found))


if __name__ == "__main__":
    main()
