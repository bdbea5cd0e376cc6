"""Machine code out of LLVM's intermediate representation: compiled in memory, at the first use, once."""

from __future__ import annotations

import ctypes
import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Lock
from time import perf_counter
from typing import Any, ParamSpec, TypeVar

import numpy
from llvmlite import binding, ir
from numpy.typing import NDArray

Doubles = NDArray[numpy.float64]
Integers = NDArray[numpy.int64]

DOUBLES = ctypes.POINTER(ctypes.c_double)
INTEGERS = ctypes.POINTER(ctypes.c_int64)

P = ParamSpec("P")
T = TypeVar("T")

_building = Lock()
_started = False


@dataclass(frozen=True, slots=True)
class Machine:
    """Compiled functions by name; they keep nothing between calls, so that any thread may call them at any time.

    seconds: what compiling took.  engine: keeps the machine code in memory.
    """

    functions: dict[str, Any]
    seconds: float
    engine: Any


@dataclass(frozen=True, slots=True)
class Processor:
    """What code is made for.  name: of LLVM, such as ``x86-64-v3``.  features: as LLVM writes them, such as ``+avx2``.

    The bits of all results are the same for every processor.
    """

    name: str
    features: str = ""

    @property
    def wide(self) -> bool:
        """Whether eight doubles are one register, of 32."""
        return self.name == "x86-64-v4" or "+avx512f" in self.features.split(",")

    @classmethod
    def here(cls) -> Processor:
        """The one that this runs on."""
        return cls(binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten())


def once(make: Callable[P, T]) -> Callable[P, T]:
    """``make``, called once for the same arguments: other threads that ask for them wait."""
    making, made, signature = Lock(), dict[tuple[Any, ...], T](), inspect.signature(make)
    full = len(signature.parameters)

    def found(*arguments: P.args, **named: P.kwargs) -> T:
        if len(arguments) == full and arguments in made:
            return made[arguments]
        bound = signature.bind(*arguments, **named)
        bound.apply_defaults()
        with making:
            if bound.args not in made:
                made[bound.args] = make(*arguments, **named)
            return made[bound.args]

    return found


def compiled(
    module: ir.Module, signatures: dict[str, tuple[Any, Sequence[Any]]], processor: Processor | None = None
) -> Machine:
    """The functions of ``module`` as machine code.

    signatures: for each function the ctypes of its result and arguments.  processor: None for this one.

    A call of a function lets other Python threads run.
    """
    global _started
    with _building:
        began = perf_counter()
        if not _started:
            binding.initialize_native_target()
            binding.initialize_native_asmprinter()
            _started = True
        which = processor or Processor.here()
        parsed = binding.parse_assembly(str(module))
        parsed.verify()
        target = binding.Target.from_default_triple().create_target_machine(
            cpu=which.name, features=which.features, opt=3
        )
        # the code is as it shall be; above 1, loads that several orders share are kept on the stack
        options = binding.create_pipeline_tuning_options(speed_level=0)
        # the code is vectors already; reordering of sums is not allowed anyway
        options.loop_vectorization = False
        options.slp_vectorization = False
        passes = binding.create_pass_builder(target, options)
        passes.getModulePassManager().run(parsed, passes)
        engine = binding.create_mcjit_compiler(parsed, target)
        engine.finalize_object()
        functions = {
            name: ctypes.CFUNCTYPE(result, *arguments)(engine.get_function_address(name))
            for name, (result, arguments) in signatures.items()
        }
        return Machine(functions, perf_counter() - began, engine)


def doubles(count: int) -> Doubles:
    """Zeros, aligned to 64 bytes."""
    room = numpy.zeros(count + 8)
    skipped = (-room.ctypes.data % 64) // 8
    return room[skipped : skipped + count]


def pointer(array: Doubles | Integers) -> Any:
    """The address of an array, for a compiled function; the array must outlive the call."""
    return array.ctypes.data_as(DOUBLES if array.dtype == numpy.float64 else INTEGERS)
