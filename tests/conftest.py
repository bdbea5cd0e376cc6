"""Unloads the integrators that a test loaded from its own folder; skips what needs an extra that is not installed."""

from __future__ import annotations

import gc
import os
import re
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from heavytop.errors import MissingExtra
from heavytop.extras import EXTRAS, extra_of, has_extra, missing
from support.in_process import forget_integrators

MISSING = [name for name in EXTRAS if not has_extra(name)]
"""Extras that are not installed."""


def pytest_configure(config: pytest.Config) -> None:
    """Leaves files in their order for xdist, which else puts those of few and costly tests last.

    What one process compiles the others read, of hundreds, also where the environment says that Python is not to write.
    Products of small matrices are left to one thread: two that wait for a busy core take seven times as long.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    config.option.loadscopereorder = False
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    gc.disable()  # until the tests are collected


def pytest_collection_finish() -> None:
    """Leaves all that is loaded by now to no garbage collection, which costs a seventh of the time else.

    Nor is there any while the tests are collected, of which it takes a quarter.
    """
    gc.collect()
    gc.freeze()
    gc.enable()
    gc.set_threshold(50_000, 20, 20)


@pytest.fixture(autouse=True)
def integrators_of_a_test_end_with_it() -> Iterator[None]:
    """Two tests may call theirs by one name."""
    loaded = set(sys.modules)
    yield
    forget_integrators(loaded)


@pytest.fixture
def undiagnosed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scores without the search for what explains an error, which takes a second: where it is not the point."""
    monkeypatch.setattr("heavytop.features.score.diagnose.diagnosis.diagnose", lambda *_, **__: [])


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages without what matplotlib writes of their pictures, half of the time of a page: where it is not looked at."""
    _leave_pictures_out(monkeypatch)


def _leave_pictures_out(patch: pytest.MonkeyPatch) -> None:
    patch.setattr("heavytop.report.document.svg._inline", lambda figure, name: "")


@pytest.fixture(scope="module", autouse=True)
def pictures(request: pytest.FixtureRequest) -> Iterator[None]:
    """Pages of a file are undrawn unless it is marked ``pictures``."""
    with pytest.MonkeyPatch.context() as patch:
        if not request.node.get_closest_marker("pictures"):
            _leave_pictures_out(patch)
        yield


def _needed(error: BaseException | None) -> str:
    """The extra for want of which an error arose, also in a command that a test ran; "" for any other error."""
    if isinstance(error, ModuleNotFoundError):
        module = (error.name or "").partition(".")[0]
        return extra_of(module) if any(module in EXTRAS[name] for name in MISSING) else ""
    said = re.search(r"needs the extra (\w+):", str(error))
    return said[1] if said and said[1] in MISSING else ""


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Any:
    return (yield from _skipping())


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Any:
    return (yield from _skipping())


def _skipping() -> Any:
    """Runs what is wrapped; a test that fails for want of an extra is skipped, and says which."""
    try:
        return (yield)
    except Exception as error:
        if not (name := _needed(error)):
            raise
        pytest.skip(str(missing(name, "the test")))


@pytest.hookimpl(wrapper=True)
def pytest_pycollect_makemodule(module_path: Any, parent: Any) -> Any:
    module = yield
    usual = module._getobj

    def imported() -> Any:
        try:
            return usual()
        except (module.CollectError, MissingExtra) as error:
            if name := next((name for name in MISSING if re.search(_PATTERNS[name], str(error))), ""):
                pytest.skip(str(missing(name, "the file")), allow_module_level=True)
            raise

    module._getobj = imported
    return module


_PATTERNS = {
    name: rf"needs the extra {name}:|No module named '(?:{'|'.join(modules)})['.]" for name, modules in EXTRAS.items()
}
