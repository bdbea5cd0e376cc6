"""heyoka's Taylor integrators, compiled: the only file that builds its engines."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass, field
from fractions import Fraction
from threading import Lock, RLock
from time import perf_counter
from typing import Any

import heyoka
import numpy

from heavytop.errors import InputError
from heavytop.integrate.selfcheck import check
from heavytop.integrate.trajectory import Problem
from heavytop.last_call import last_call
from heavytop.precision import DOUBLE, DOUBLE_DOUBLE, Precision, number, require, usable_tolerance
from heavytop.top.equations import HEAVY_GYROSTAT, VARIABLES, Parameters, System

# A machine-code cache on disk is not protected against corruption: a flipped bit there gives wrong numbers silently.
heyoka.llvm_state.set_diskcache_enabled(False)

_XI = ("xi1", "xi2", "xi3")


@dataclass(slots=True)
class Compiled:
    """A compiled integrator of one system and format, used again for every top.

    engine: never run, only copied, so that a copy can be made while others run.  spare: copies that nobody uses now.
    """

    engine: Any
    seconds: float
    flags: dict[str, str]
    spare: list[Any] = field(default_factory=list)
    copying: Lock = field(default_factory=Lock)

    @contextmanager
    def lent(self) -> Iterator[Any]:
        """A copy of the engine for one run, given back at the end, also of a run that raises.

        Whoever runs meanwhile, another thread or an observer of this very run, has another copy.
        """
        try:
            engine = self.spare.pop()
        except IndexError:
            with self.copying:
                engine = deepcopy(self.engine)
        try:
            yield engine
        finally:
            self.spare.append(engine)


_compiled: dict[tuple[Any, ...], Compiled] = {}
_compiling: dict[tuple[Any, ...], RLock] = {}
"""One lock a key: what one thread compiles, another that needs the same waits for."""


def expressions(system: System, attitude: bool, constants: Parameters | None = None) -> list[tuple[Any, Any]]:
    """The field as heyoka expressions with par[0..2] = I and par[3..5] = P r, or par[3] = λ for the gyrostat; par[6..8]
    = k for the heavy gyrostat.

    constants: doubles in the place of all par[i].
    """
    names = VARIABLES + (_XI if attitude else ())
    y = heyoka.make_vars(*names)
    p = constants or system.taken_in([heyoka.par[i] for i in range(_count(system))])
    rates = system.field(p, y[:6])
    if attitude:
        rates = (*rates, *system.attitude(p, y[:6], y[6:]))
    return list(zip(y, rates, strict=True))


def compiled(
    system: System,
    precision: Precision,
    *,
    attitude: bool = False,
    tolerance: Fraction | None = None,
    high_accuracy: bool = False,
    compact_mode: bool | None = None,
    lanes: int | None = None,
    constants: Parameters | None = None,
) -> Compiled:
    """The integrator for this system and format, compiled at its first use.

    constants: exact parameters of one top, compiled into the code, in double only (heyoka demotes all constants to it);
    None for code that serves every top.

    lanes: that many motions at once in SIMD lanes, in double only; None for a scalar integrator, whose bits differ.
    tolerance: None for the format's eps.  compact_mode: None for off in double and extended (faster to run) and on in
    quad and real (else they take minutes to compile).

    Raises Contradiction where its first step, which is known, is wrong.
    """
    require(precision)
    if precision == DOUBLE_DOUBLE:
        raise InputError("heyoka has no double-double.", "Use the integrator multiword for it, or quad.")
    compact = precision.family in ("quad", "real") if compact_mode is None else compact_mode
    if constants is not None and precision != DOUBLE:
        raise InputError(f"Constants cannot be compiled in for {precision.name}.", "Use double.")
    key = (system.name, precision, attitude, tolerance, high_accuracy, compact, lanes, constants)
    with _compiling.setdefault(key, RLock()):
        if key not in _compiled:
            engine, seconds = _built(system, precision, attitude, tolerance, high_accuracy, compact, lanes, constants)
            check(engine, system, precision, constants)
            _compiled[key] = Compiled(engine, seconds, _flags(engine))
    return _compiled[key]


def _built(
    system: System,
    precision: Precision,
    attitude: bool,
    tolerance: Fraction | None,
    high_accuracy: bool,
    compact: bool,
    lanes: int | None,
    constants: Parameters | None,
) -> tuple[Any, float]:
    """A new engine, and the seconds that compiling it took."""
    one, zero = number(Fraction(1), precision), number(Fraction(0), precision)
    size = 9 if attitude else 6
    options: dict[str, Any] = {"compact_mode": compact, "high_accuracy": high_accuracy}
    if tolerance is not None:
        options["tol"] = number(usable_tolerance(tolerance, precision), precision)
    if precision.family == "real":
        options["prec"] = precision.bits
    build, shape = (heyoka.taylor_adaptive, ()) if lanes is None else (heyoka.taylor_adaptive_batch, (lanes,))
    if constants is None:
        options["pars"] = numpy.full((_count(system), *shape), one)
    before = perf_counter()
    engine = build(
        expressions(system, attitude, constants and _doubles(constants)),
        numpy.full((size, *shape), zero),
        fp_type=type(one),
        **options,
    )
    return engine, perf_counter() - before


def _count(system: System) -> int:
    """How many numbers enter the field."""
    return len(system.entering(Parameters((1, 1, 1), (0, 0, 0), (0, 0, 0) if system is HEAVY_GYROSTAT else 0)))


def _doubles(p: Parameters) -> Parameters:
    return p.mapped(float)


def _flags(engine: Any) -> dict[str, str]:
    """Everything that can change bits."""
    code = engine.llvm_state
    values = {
        "tolerance": engine.tol,
        "order": engine.order,
        "compact_mode": engine.compact_mode,
        "high_accuracy": engine.high_accuracy,
        "opt_level": code.opt_level,
        "fast_math": code.fast_math,
        "force_avx512": code.force_avx512,
        "slp_vectorize": code.slp_vectorize,
        "code_cache": "none",
        "coefficients": "par" if len(engine.pars) else "constants",
    }
    if hasattr(engine, "batch_size"):
        values["batch_size"] = engine.batch_size
    return {name: str(value).lower() for name, value in values.items()}


def load(engine: Any, problem: Problem) -> None:
    """Set an engine to the beginning of a problem."""
    parameters, engine.state[:] = arrays(problem)
    if len(engine.pars):
        engine.pars[:] = parameters
    engine.time = number(Fraction(0), problem.precision)


@last_call
def arrays(problem: Problem) -> tuple[Any, Any]:
    """The parameters and the state that an engine is given, as native arrays."""
    p = problem.parameters
    numbers = list(problem.system.entering(p))
    start = [*problem.start.flat, *(problem.xi or ())]
    found = numpy.array(problem.native(numbers)), numpy.array(problem.native(start))
    for array in found:
        array.setflags(write=False)  # kept for the next who asks
    return found
