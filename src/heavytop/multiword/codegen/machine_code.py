"""Machine code out of LLVM's intermediate representation: compiled in memory, at the first use, once."""

from __future__ import annotations

import ctypes
import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Lock
from time import perf_counter
from typing import Any, ParamSpec, TypeAlias, TypeVar

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
    module: ir.Module, signatures: dict[str, tuple[ir.Type, Sequence[ir.Type]]], processor: Processor | None = None
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


# Vectors of eight doubles in LLVM's intermediate representation, and loops over them.
#
# Every operation is one IEEE operation, rounded to nearest: no fast-math flag is ever set and nothing is contracted, so
# the bits are those of any processor.  Only ``fma`` fuses, and where there is no such instruction it is computed.


LANES = 8
DOUBLE = ir.DoubleType()
INT = ir.IntType(64)
VECTOR = ir.VectorType(DOUBLE, LANES)
INT_VECTOR = ir.VectorType(INT, LANES)
POINTER = DOUBLE.as_pointer()
INT_POINTER = INT.as_pointer()
_INDEX = ir.IntType(32)
_INFINITY = float("inf")

Value: TypeAlias = ir.Value
"""A value of the machine code: a double, a vector of eight of them, an integer, a flag or an address."""
Pair: TypeAlias = tuple[Value, Value]
Index: TypeAlias = int | Value
"""An int, known when the code is made, or an integer value of the code."""


class Code:
    """Writes the body of one function; a value is a vector of eight doubles where nothing else is said."""

    def __init__(self, builder: ir.IRBuilder) -> None:
        self.builder = builder
        self.module = builder.module
        self.zero = self.constant(0.0)

    def _call(self, name: str, result: ir.Type, arguments: Sequence[Value]) -> Value:
        known = self.module.globals.get(name)
        function = known or ir.Function(self.module, ir.FunctionType(result, [a.type for a in arguments]), name)
        return self.builder.call(function, arguments)

    def constant(self, value: float | Sequence[float]) -> Value:
        """The same double in every lane, or eight."""
        values = [value] * LANES if isinstance(value, (int, float)) else list(value)
        return ir.Constant(VECTOR, [ir.Constant(DOUBLE, float(v)) for v in values])

    def integer(self, value: Index) -> Value:
        """An integer value."""
        return ir.Constant(INT, value) if isinstance(value, int) else value

    def add(self, a: Value, b: Value) -> Value:
        """a + b."""
        return self.builder.fadd(a, b)

    def subtract(self, a: Value, b: Value) -> Value:
        """a - b."""
        return self.builder.fsub(a, b)

    def multiply(self, a: Value, b: Value) -> Value:
        """a b."""
        return self.builder.fmul(a, b)

    def negative(self, a: Value) -> Value:
        """-a."""
        return self.builder.fneg(a)

    def fma(self, a: Value, b: Value, c: Value) -> Value:
        """a b + c, rounded once."""
        name = "llvm.fma.v8f64" if a.type == VECTOR else "llvm.fma.f64"
        return self._call(name, a.type, (a, b, c))

    def multiply_add(self, a: Value, b: Value, c: Value) -> Value:
        """a b + c where that is exact with and without a rounding of a b: the same bits, however it is computed."""
        return self._call("llvm.fmuladd.v8f64", VECTOR, (a, b, c))

    def floor(self, a: Value) -> Value:
        """The largest integer that is not above a double, a double."""
        return self._call("llvm.floor.f64", DOUBLE, (a,))

    def absolute(self, a: Value) -> Value:
        """|a|."""
        return self._call("llvm.fabs.v8f64", VECTOR, (a,))

    def larger(self, a: Value, b: Value) -> Value:
        """max(a, b) lane by lane, for numbers that are not NaN."""
        return self.builder.select(self.builder.fcmp_ordered(">", a, b), a, b)

    def least(self, a: Value, b: Value) -> Value:
        """min(a, b) of two integers."""
        return self.builder.select(self.builder.icmp_signed("<", a, b), a, b)

    def largest(self, a: Value) -> Value:
        """The largest |lane|, a double; NaN lanes are passed over."""
        return self._call("llvm.vector.reduce.fmax.v8f64", DOUBLE, (self.absolute(a),))

    def finite(self, a: Value) -> Value:
        """Whether every lane is a finite number, a bit."""
        below = self.builder.fcmp_ordered("<", self.absolute(a), self.constant(_INFINITY))
        return self.all_of(below)

    def all_of(self, bits: Value) -> Value:
        """Whether eight bits are set, a bit."""
        mask = self.builder.bitcast(bits, ir.IntType(LANES))
        return self.builder.icmp_unsigned("==", mask, ir.Constant(ir.IntType(LANES), (1 << LANES) - 1))

    def any_bit(self, a: Value) -> Value:
        """The bits that are set in any lane of eight integers, an integer."""
        return self._call("llvm.vector.reduce.or.v8i64", INT, (a,))

    def shuffle(self, a: Value, b: Value, lanes: Sequence[int]) -> Value:
        """Lanes 0 to 7 of ``a`` and 8 to 15 of ``b``, in that order."""
        return self.builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(_INDEX, LANES), list(lanes)))

    def spread(self, scalar: Value) -> Value:
        """A double in every lane."""
        undefined = ir.Constant(VECTOR, ir.Undefined)
        first = self.builder.insert_element(undefined, scalar, ir.Constant(_INDEX, 0))
        return self.builder.shuffle_vector(first, undefined, ir.Constant(ir.VectorType(_INDEX, LANES), [0] * LANES))

    def two_sum(self, a: Value, b: Value) -> Pair:
        """(s, e) with s + e = a + b exactly and s rounded (Knuth); vectors or doubles."""
        total = self.add(a, b)
        part = self.subtract(total, a)
        return total, self.add(self.subtract(a, self.subtract(total, part)), self.subtract(b, part))

    def quick_two_sum(self, a: Value, b: Value) -> Pair:
        """The same where |a| >= |b| or a = 0 (Dekker)."""
        total = self.add(a, b)
        return total, self.subtract(b, self.subtract(total, a))

    def two_product(self, a: Value, b: Value) -> Pair:
        """(p, e) with p + e = a b exactly and p rounded."""
        product = self.multiply(a, b)
        return product, self.fma(a, b, self.negative(product))

    def address(self, base: Value, offset: Index) -> Value:
        """Where ``base[offset]`` is."""
        return self.builder.gep(base, [self.integer(offset)])

    def load(self, base: Value, offset: Index) -> Value:
        """The eight doubles from ``base[offset]`` on, aligned to 64 bytes."""
        value = self.builder.load(self.builder.bitcast(self.address(base, offset), VECTOR.as_pointer()))
        value.align = 64
        return value

    def store(self, value: Value, base: Value, offset: Index) -> None:
        """Put eight doubles to ``base[offset]`` and on, aligned to 64 bytes."""
        self.builder.store(value, self.builder.bitcast(self.address(base, offset), VECTOR.as_pointer())).align = 64

    def loop(
        self,
        start: Index,
        stop: Index,
        body: Callable[[Value, list[Value]], Sequence[Value] | None],
        values: Sequence[Value],
    ) -> list[Value]:
        """``values`` after ``values = body(i, values)`` for i from ``start`` to before ``stop``."""
        b = self.builder
        before, head = b.block, b.append_basic_block("head")
        b.branch(head)
        b.position_at_end(head)
        index, carried = b.phi(INT), [b.phi(value.type) for value in values]
        index.add_incoming(self.integer(start), before)
        for phi, value in zip(carried, values, strict=True):
            phi.add_incoming(value, before)
        inside, after = b.append_basic_block("body"), b.append_basic_block("after")
        b.cbranch(b.icmp_signed("<", index, self.integer(stop)), inside, after)
        b.position_at_end(inside)
        results = body(index, carried) or []
        for phi, value in zip(carried, results, strict=True):
            phi.add_incoming(value, b.block)
        index.add_incoming(b.add(index, self.integer(1)), b.block)
        b.branch(head)
        b.position_at_end(after)
        return carried

    def either(self, condition: Value, one: Callable[[], list[Value]], other: Callable[[], list[Value]]) -> list[Value]:
        """The values of ``one`` where a bit is set, else those of ``other``; the other's code does not run."""
        b = self.builder
        with b.if_else(condition) as (then, otherwise):
            with then:
                first, after_first = one(), b.block
            with otherwise:
                second, after_second = other(), b.block
        chosen = []
        for values in zip(first, second, strict=True):
            chosen.append(b.phi(values[0].type))
            for value, block in zip(values, (after_first, after_second), strict=True):
                chosen[-1].add_incoming(value, block)
        return chosen


def function(module: ir.Module, name: str, result: ir.Type, arguments: Sequence[ir.Type]) -> tuple[ir.Function, Code]:
    """A new function of ``module`` whose pointers point to different places, and the writer of its body."""
    made = ir.Function(module, ir.FunctionType(result, list(arguments)), name)
    for argument in made.args:
        if isinstance(argument.type, ir.PointerType):
            argument.add_attribute("noalias")
    return made, Code(ir.IRBuilder(made.append_basic_block("entry")))


# The loop of steps, in machine code: until the time covers a target, a step fails or there were enough.


class Stepping(ABC):
    """Writes a function that takes steps.

    clock, counts: arrays of doubles and of integers that live between calls.  most: the steps of a call at most.
    status: the place among the counts of how the last step ended; 0 if well.
    """

    def __init__(self, code: Code, clock: Value, counts: Value, most: Value, status: int) -> None:
        self.code, self.clock, self.counts, self.most, self.status = code, clock, counts, most, status

    @abstractmethod
    def covered(self) -> Value:
        """Whether the time is the target or behind it, a bit."""

    @abstractmethod
    def write_step(self) -> Value:
        """Write one step; gives the bit that says whether it stands."""

    def time(self, place: int) -> Value:
        """A double of the clock."""
        return self.code.builder.load(self.code.address(self.clock, place))

    def count(self, place: int) -> Value:
        """One of the counts."""
        return self.code.builder.load(self.code.address(self.counts, place))

    def set_count(self, value: Index, place: int) -> None:
        """Put one of the counts."""
        self.code.builder.store(self.code.integer(value), self.code.address(self.counts, place))

    def write(self) -> None:
        """The loop; the function gives the number of steps that stand."""
        code, b = self.code, self.code.builder
        head, body, out = (b.append_basic_block(name) for name in ("steps", "step", "out"))
        entry = b.block
        b.branch(head)
        b.position_at_end(head)
        taken = b.phi(INT)
        taken.add_incoming(code.integer(0), entry)
        running = b.icmp_signed("==", self.count(self.status), code.integer(0))
        wanted = b.and_(b.icmp_signed("<", taken, self.most), b.not_(self.covered()))
        b.cbranch(b.and_(running, wanted), body, out)
        b.position_at_end(body)
        good = self.write_step()
        taken.add_incoming(b.add(taken, b.zext(good, INT)), b.block)
        b.branch(head)
        b.position_at_end(out)
        b.ret(taken)
