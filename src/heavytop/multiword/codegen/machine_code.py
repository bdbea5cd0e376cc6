"""Machine code from LLVM's intermediate representation, compiled in memory at its first use."""

from __future__ import annotations

import ctypes
import inspect
import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from threading import Lock
from time import perf_counter
from typing import Any, ParamSpec, TypeAlias

import numpy
from numpy.typing import NDArray

from heavytop.extras import Stub, require_extra
from heavytop.multiword.codegen import code_cache

try:
    from llvmlite import ir as ir  # also for the modules that write code
except ModuleNotFoundError:  # types and lengths need no extra; compiling does
    ir = Stub()

Doubles = NDArray[numpy.float64]
Integers = NDArray[numpy.int64]

DOUBLES = ctypes.POINTER(ctypes.c_double)
INTEGERS = ctypes.POINTER(ctypes.c_int64)

Signatures: TypeAlias = Mapping[str, Sequence[str]]
"""The types of the result and of the arguments of each function, as LLVM names them."""
_TYPES: dict[str, Any] = {
    "void": None,
    "i64": ctypes.c_int64,
    "double": ctypes.c_double,
    "i64*": INTEGERS,
    "double*": DOUBLES,
}

P = ParamSpec("P")

_building = Lock()
_started = False


@dataclass(frozen=True, slots=True)
class Machine:
    """Compiled functions by name, without state and so safe in threads.

    seconds: of compiling or reading.  engine: keeps the machine code in memory.
    code, signatures: the machine code as a file, and the types of its functions.
    """

    functions: dict[str, Any]
    seconds: float
    engine: Any
    code: bytes
    signatures: Signatures


@dataclass(frozen=True, slots=True)
class Processor:
    """The target processor.  name: of LLVM, such as ``x86-64-v3``.  features: such as ``+avx2``.

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
        """The processor of this machine."""
        from llvmlite import binding

        return cls(binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten())


def once(make: Callable[P, Machine]) -> Callable[P, Machine]:
    """Cache ``make`` by its arguments, in memory and on disk; other threads wait meanwhile."""
    making, made, signature = Lock(), dict[tuple[Any, ...], Machine](), inspect.signature(make)
    full = len(signature.parameters)

    def cached(*arguments: P.args, **named: P.kwargs) -> Machine:
        if len(arguments) == full and arguments in made:
            return made[arguments]
        bound = signature.bind(*arguments, **named)
        bound.apply_defaults()
        with making:
            if bound.args not in made:
                require_extra("multiword")
                made[bound.args] = _from_disk(make, bound.args)
            return made[bound.args]

    return cached


def _from_disk(make: Callable[..., Machine], arguments: tuple[Any, ...]) -> Machine:
    """The machine code from the cache on disk, or made now and stored there."""
    began = perf_counter()
    key = code_cache.key_of(make, arguments, Processor.here())
    if (cached := code_cache.read(key)) is not None:
        return _linked(cached[0], json.loads(cached[1]), began)
    machine = make(*arguments)
    code_cache.write(key, machine.code, json.dumps(machine.signatures).encode())
    return machine


def compiled(module: ir.Module, processor: Processor | None = None) -> Machine:
    """The functions of ``module`` that are not internal, as machine code; processor: None for this one.

    A call of a function lets other Python threads run.
    """
    from llvmlite import binding  # a tenth of a second, and 170 MB of addresses

    with _building:
        began = perf_counter()
        target = _target(processor)
        parsed = binding.parse_assembly(str(module))
        parsed.verify()
        # no inlining or unrolling; above 1, loads that several orders share are spilled to the stack
        options = binding.create_pipeline_tuning_options(speed_level=0)
        # the code consists of vectors already, and sums must not be reordered
        options.loop_vectorization = False
        options.slp_vectorization = False
        passes = binding.create_pass_builder(target, options)
        passes.getModulePassManager().run(parsed, passes)
        code = target.emit_object(parsed)
    called = (made for made in module.functions if not (made.is_declaration or made.linkage == "internal"))
    signatures = {made.name: [str(kind) for kind in (made.ftype.return_type, *made.ftype.args)] for made in called}
    return _linked(code, signatures, began)


def _target(processor: Processor | None) -> Any:
    """The compiler for a processor."""
    global _started
    from llvmlite import binding

    if not _started:
        binding.initialize_native_target()
        binding.initialize_native_asmprinter()
        _started = True
    which = processor or Processor.here()
    # the loader may place code and constants at any address
    return binding.Target.from_default_triple().create_target_machine(cpu=which.name, features=which.features, opt=3)


def _linked(code: bytes, signatures: Signatures, began: float) -> Machine:
    """Load functions from machine code."""
    from llvmlite import binding

    with _building:
        engine = binding.create_mcjit_compiler(binding.parse_assembly(""), _target(None))
        engine.add_object_file(binding.ObjectFileRef.from_data(code))
        engine.finalize_object()
        functions = {
            name: ctypes.CFUNCTYPE(*(_TYPES[kind] for kind in kinds))(engine.get_function_address(name))
            for name, kinds in signatures.items()
        }
        return Machine(functions, perf_counter() - began, engine, code, signatures)


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
# the bits are those of any processor.  Only ``fma`` fuses; without such an instruction it is emulated.


LANES = 8
DOUBLE = ir.DoubleType()
INT = ir.IntType(64)
VECTOR = ir.VectorType(DOUBLE, LANES)
INT_VECTOR = ir.VectorType(INT, LANES)
POINTER = DOUBLE.as_pointer()
INT_POINTER = INT.as_pointer()
_VECTOR_POINTER = VECTOR.as_pointer()
_INDEX = ir.IntType(32)
_INDICES = ir.VectorType(_INDEX, LANES)
_MASK = ir.IntType(LANES)
_INFINITY = float("inf")


def _operator(of_doubles: str, of_integers: str, swapped: bool = False) -> Callable[[Operand, Number], Operand]:
    """An operator that writes one operation, by its name in LLVM's builder."""

    def written(self: Operand, other: Number) -> Operand:
        write = getattr(self.builder, of_doubles if _is_double(self.type) else of_integers)
        b = _typed(self.type, other)
        return Operand(self.builder, write(b, self.raw) if swapped else write(self.raw, b))

    return written


def _relation(sign: str) -> Callable[[Operand, Number], Operand]:
    def written(self: Operand, other: Number) -> Operand:
        compare = self.builder.fcmp_ordered if _is_double(self.type) else self.builder.icmp_signed
        return Operand(self.builder, compare(sign, self.raw, _typed(self.type, other)))

    return written


def _conversion(operation: str, to: ir.Type) -> Callable[[Operand], Operand]:
    def written(self: Operand) -> Operand:
        return Operand(self.builder, getattr(self.builder, operation)(self.raw, _like(self.type, to)))

    return written


class Operand:
    """A double, an integer, a flag, eight of one of these, or an address of the machine code, and its arithmetic.

    An operator writes one operation, of doubles or of integers by the type; a number operand becomes a constant of that
    type.  LLVM's builder accepts operands as values.
    """

    __slots__ = ("builder", "raw", "type")

    def __init__(self, builder: ir.IRBuilder, raw: ir.Value) -> None:
        self.builder, self.raw, self.type = builder, raw, raw.type

    __add__, __radd__ = _operator("fadd", "add"), _operator("fadd", "add", swapped=True)
    __sub__, __rsub__ = _operator("fsub", "sub"), _operator("fsub", "sub", swapped=True)
    __mul__, __rmul__ = _operator("fmul", "mul"), _operator("fmul", "mul", swapped=True)
    __truediv__ = _operator("fdiv", "fdiv")
    __floordiv__ = _operator("sdiv", "sdiv")  # of integers that are not negative
    __and__, __or__, __xor__ = _operator("and_", "and_"), _operator("or_", "or_"), _operator("xor", "xor")
    __lshift__, __rshift__ = _operator("shl", "shl"), _operator("ashr", "ashr")
    unsigned_shift = _operator("lshr", "lshr")  # to the right, zeros come from the left
    __lt__, __le__, __gt__, __ge__ = _relation("<"), _relation("<="), _relation(">"), _relation(">=")
    __eq__, __ne__ = _relation("=="), _relation("!=")  # type: ignore[assignment]
    bits, of_bits = _conversion("bitcast", INT), _conversion("bitcast", DOUBLE)
    to_integer, to_double = _conversion("fptosi", INT), _conversion("sitofp", DOUBLE)  # towards 0, to nearest
    extended = _conversion("zext", INT)  # a flag, to 0 or 1

    def __neg__(self) -> Operand:
        return Operand(self.builder, (self.builder.fneg if _is_double(self.type) else self.builder.neg)(self.raw))

    def __invert__(self) -> Operand:
        return Operand(self.builder, self.builder.not_(self.raw))

    def get_reference(self) -> str:
        """The reference that LLVM's builder needs."""
        return str(self.raw.get_reference())

    def __bool__(self) -> bool:
        raise TypeError("An operand of the machine code is not known when the code is made.")


Number: TypeAlias = float | Operand
"""A number known when the code is written, or an operand."""
Index: TypeAlias = int | Operand
Pair: TypeAlias = tuple[Operand, Operand]


def _is_double(kind: ir.Type) -> bool:
    return isinstance(getattr(kind, "element", kind), ir.DoubleType)


def _like(shape: ir.Type, element: ir.Type) -> ir.Type:
    """One, or eight where the shape has eight."""
    return ir.VectorType(element, LANES) if isinstance(shape, ir.VectorType) else element


def _typed(kind: ir.Type, value: Number) -> ir.Value:
    """The value of LLVM's builder for an operand; a number as a constant of that type."""
    return value.raw if isinstance(value, Operand) else ir.Constant(kind, +value)  # of True it is 1


class Code:
    """Writes the body of one function; values are vectors of eight doubles unless stated otherwise.

    true: a flag.  null: the null address.
    """

    def __init__(self, builder: ir.IRBuilder) -> None:
        self.builder = builder
        self.module = builder.module
        self.arguments = [self.value(argument) for argument in builder.function.args]
        self.zero, self.true = self.constant(0.0), self.value(ir.Constant(ir.IntType(1), 1))
        self.null = self.value(ir.Constant(POINTER, None))

    def value(self, raw: ir.Value) -> Operand:
        """An operand of the type that LLVM's builder made."""
        return Operand(self.builder, raw)

    def _intrinsic(self, name: str, result: ir.Type, arguments: Sequence[ir.Value]) -> Operand:
        declared = self.module.globals.get(name)
        function = declared or ir.Function(self.module, ir.FunctionType(result, [a.type for a in arguments]), name)
        return self.value(self.builder.call(function, arguments))

    def call(self, function: ir.Function, arguments: Sequence[Operand]) -> Operand:
        """The result of a function."""
        return self.value(self.builder.call(function, [argument.raw for argument in arguments]))

    def constant(self, value: float | Sequence[float]) -> Operand:
        """A double in every lane, or eight."""
        return self.value(ir.Constant(VECTOR, value if isinstance(value, (int, float)) else list(value)))

    def integer(self, value: Index) -> Operand:
        """An integer value."""
        return self.value(ir.Constant(INT, value)) if isinstance(value, int) else value

    def select(self, condition: Operand, a: Number, b: Number) -> Operand:
        """``a`` where a bit is set, else ``b``; two numbers have their type in Python."""
        kind = INT if isinstance(a, int) else DOUBLE
        kinds = [value.type for value in (a, b) if isinstance(value, Operand)] or [_like(condition.type, kind)]
        return self.value(self.builder.select(condition.raw, _typed(kinds[0], a), _typed(kinds[0], b)))

    def unsigned_less(self, a: Operand, b: int) -> Operand:
        """Whether an integer is less and not negative."""
        return self.value(self.builder.icmp_unsigned("<", a.raw, _typed(INT, b)))

    def fma(self, a: Operand, b: Number, c: Number) -> Operand:
        """a b + c, rounded once."""
        name = "llvm.fma.v8f64" if isinstance(a.type, ir.VectorType) else "llvm.fma.f64"
        return self._intrinsic(name, a.type, (a.raw, _typed(a.type, b), _typed(a.type, c)))

    def multiply_add(self, a: Operand, b: Number, c: Operand) -> Operand:
        """a b + c where a b is exact, so that fused and separate operations give the same bits."""
        return self._intrinsic("llvm.fmuladd.v8f64", VECTOR, (a.raw, _typed(VECTOR, b), c.raw))

    def floor(self, a: Operand) -> Operand:
        """The largest integer that is not above a double, a double."""
        return self._intrinsic("llvm.floor.f64", DOUBLE, (a.raw,))

    def absolute(self, a: Operand) -> Operand:
        """|a|."""
        return self._intrinsic("llvm.fabs.v8f64", VECTOR, (a.raw,))

    def larger(self, a: Operand, b: Number) -> Operand:
        """max(a, b) lane by lane, for numbers that are not NaN."""
        return self.select(a > b, a, b)

    def smaller(self, a: Operand, b: Number) -> Operand:
        """min(a, b) lane by lane, for numbers that are not NaN."""
        return self.select(a < b, a, b)

    def largest(self, a: Operand) -> Operand:
        """The largest |lane|, a double; NaN lanes are passed over."""
        return self._intrinsic("llvm.vector.reduce.fmax.v8f64", DOUBLE, (self.absolute(a).raw,))

    def finite(self, a: Operand) -> Operand:
        """Whether every lane is a finite number, a bit."""
        return self.all_of(self.absolute(a) < _INFINITY)

    def all_of(self, bits: Operand) -> Operand:
        """Whether eight bits are set, a bit."""
        return self.value(self.builder.bitcast(bits.raw, _MASK)) == (1 << LANES) - 1

    def any_of(self, bits: Operand) -> Operand:
        """Whether one of eight bits is set, a bit."""
        return self.value(self.builder.bitcast(bits.raw, _MASK)) != 0

    def any_bit(self, a: Operand) -> Operand:
        """The bits that are set in any lane of eight integers, an integer."""
        return self._intrinsic("llvm.vector.reduce.or.v8i64", INT, (a.raw,))

    def shuffle(self, a: Operand, b: Operand, lanes: Sequence[int]) -> Operand:
        """Lanes 0 to 7 of ``a`` and 8 to 15 of ``b``, in that order."""
        return self.value(self.builder.shuffle_vector(a.raw, b.raw, ir.Constant(_INDICES, list(lanes))))

    def lane(self, a: Operand, lane: int) -> Operand:
        """One lane, a double."""
        return self.value(self.builder.extract_element(a.raw, ir.Constant(_INDEX, lane)))

    def spread(self, scalar: Operand) -> Operand:
        """A double in every lane."""
        undefined = ir.Constant(VECTOR, ir.Undefined)
        first = self.builder.insert_element(undefined, scalar.raw, ir.Constant(_INDEX, 0))
        return self.value(self.builder.shuffle_vector(first, undefined, ir.Constant(_INDICES, [0] * LANES)))

    def two_sum(self, a: Operand, b: Operand) -> Pair:
        """(s, e) with s + e = a + b exactly and s rounded (Knuth); vectors or doubles."""
        total = a + b
        part = total - a
        return total, (a - (total - part)) + (b - part)

    def quick_two_sum(self, a: Operand, b: Operand) -> Pair:
        """:meth:`two_sum` where |a| >= |b| or a = 0 (Dekker)."""
        total = a + b
        return total, b - (total - a)

    def two_product(self, a: Operand, b: Operand) -> Pair:
        """(p, e) with p + e = a b exactly and p rounded."""
        product = a * b
        return product, self.fma(a, b, -product)

    def _item(self, base: Operand, offset: Index) -> ir.Value:
        return self.builder.gep(base.raw, [_typed(INT, offset)])

    def address(self, base: Operand, offset: Index) -> Operand:
        """The address of ``base[offset]``."""
        return self.value(self._item(base, offset))

    def load_one(self, base: Operand, offset: Index) -> Operand:
        """``base[offset]``, a double or an integer."""
        return self.value(self.builder.load(self._item(base, offset)))

    def store_one(self, value: Number, base: Operand, offset: Index) -> None:
        """Store a double or an integer at ``base[offset]``."""
        self.builder.store(_typed(base.type.pointee, value), self._item(base, offset))

    def load(self, base: Operand, offset: Index) -> Operand:
        """The eight doubles from ``base[offset]`` on, aligned to 64 bytes."""
        return self.value(self.builder.load(self.builder.bitcast(self._item(base, offset), _VECTOR_POINTER), align=64))

    def store(self, value: Operand, base: Operand, offset: Index) -> None:
        """Store eight doubles from ``base[offset]`` on, aligned to 64 bytes."""
        self.builder.store(value.raw, self.builder.bitcast(self._item(base, offset), _VECTOR_POINTER), align=64)

    def phi(self, kind: ir.Type) -> Operand:
        """A phi node, whose values :meth:`add_incoming` sets for each preceding block."""
        return self.value(self.builder.phi(kind))

    def add_incoming(self, phis: Sequence[Operand], values: Sequence[Number], before: Any = None) -> None:
        """Set the values of ``phis`` after the block ``before``, by default after the current block."""
        for phi, value in zip(phis, values, strict=True):
            phi.raw.add_incoming(_typed(phi.type, value), before or self.builder.block)

    def loop(
        self,
        start: Index,
        stop: Index,
        body: Callable[[Operand, list[Operand]], Sequence[Operand] | None],
        values: Sequence[Operand],
    ) -> list[Operand]:
        """``values`` after ``values = body(i, values)`` for i from ``start`` to before ``stop``."""
        return self.loop_while(start, stop, None, body, values)[1]

    def loop_while(
        self,
        start: Index,
        stop: Index,
        holds: Callable[[list[Operand]], Operand] | None,
        body: Callable[[Operand, list[Operand]], Sequence[Operand] | None],
        values: Sequence[Operand],
    ) -> tuple[Operand, list[Operand]]:
        """:meth:`loop` up to the first i at which ``holds(values)`` does not, and that i."""

        def going(index: Operand, *carried: Operand) -> Operand:
            inside = index < stop
            return inside & holds(list(carried)) if holds else inside

        def following(index: Operand, *carried: Operand) -> list[Operand]:
            new = body(index, list(carried)) or []
            return [index + 1, *new]

        index, *carried = self.as_long_as(going, following, [self.integer(start), *values])
        return index, carried

    def as_long_as(
        self,
        holds: Callable[..., Operand],
        body: Callable[..., Sequence[Operand]],
        values: Sequence[Operand],
    ) -> list[Operand]:
        """``values`` after repeating ``values = body(*values)`` while ``holds(*values)``."""
        b = self.builder
        before, head = b.block, b.append_basic_block("head")
        b.branch(head)
        b.position_at_end(head)
        carried = [self.phi(value.type) for value in values]
        self.add_incoming(carried, values, before)
        inside, after = b.append_basic_block("body"), b.append_basic_block("after")
        b.cbranch(holds(*carried), inside, after)
        b.position_at_end(inside)
        self.add_incoming(carried, body(*carried))
        b.branch(head)
        b.position_at_end(after)
        return carried

    def either(
        self, condition: Operand, one: Callable[[], list[Operand]], other: Callable[[], list[Operand]]
    ) -> list[Operand]:
        """The values of ``one`` where a bit is set, else those of ``other``; only one of them is executed."""
        b = self.builder
        with b.if_else(condition) as (then, otherwise):
            with then:
                first, after_first = one(), b.block
            with otherwise:
                second, after_second = other(), b.block
        chosen = [self.phi(value.type) for value in first]
        self.add_incoming(chosen, first, after_first)
        self.add_incoming(chosen, second, after_second)
        return chosen


def function(
    module: ir.Module, name: str, result: ir.Type, arguments: Sequence[ir.Type], internal: bool = False
) -> tuple[ir.Function, Code]:
    """A new function of ``module`` whose pointers do not alias, and the writer of its body; internal: not exported."""
    made = ir.Function(module, ir.FunctionType(result, list(arguments)), name)
    if internal:
        made.linkage = "internal"
        made.attributes.add("noinline")
    for argument in made.args:
        if isinstance(argument.type, ir.PointerType):
            argument.add_attribute("noalias")
    return made, Code(ir.IRBuilder(made.append_basic_block("entry")))


# The loop of steps in machine code, until the time covers a target, a step fails or the limit is reached.


class Stepping(ABC):
    """Writes a function that takes steps.

    clock, counts: arrays of doubles and of integers that persist between calls.  most: the largest number of steps of a
    call.  status: the index in the counts of the outcome of the last step; 0 for success.
    """

    def __init__(self, code: Code, clock: Operand, counts: Operand, most: Operand, status: int) -> None:
        self.code, self.clock, self.counts, self.most, self.status = code, clock, counts, most, status

    @abstractmethod
    def covered(self) -> Operand:
        """Whether the time has reached the target, a bit."""

    @abstractmethod
    def write_step(self) -> Operand:
        """Write one step; returns the bit whether it is accepted."""

    def time(self, index: int) -> Operand:
        """A double of the clock."""
        return self.code.load_one(self.clock, index)

    def count(self, index: int) -> Operand:
        """A count, by its index."""
        return self.code.load_one(self.counts, index)

    def set_count(self, value: Index, index: int) -> None:
        """Store one of the counts."""
        self.code.store_one(value, self.counts, index)

    def write(self) -> None:
        """Write the loop; the function returns the number of accepted steps."""

        def wanted(taken: Operand) -> Operand:
            running = self.count(self.status) == 0
            return running & (taken < self.most) & ~self.covered()

        def step(taken: Operand) -> list[Operand]:
            return [taken + self.write_step().extended()]

        taken = self.code.as_long_as(wanted, step, [self.code.integer(0)])[0]
        self.code.builder.ret(taken)


class Following(ABC):
    """Writes a function that alternates steps and samples, until all times are done or the limit of steps is reached.

    arrays: the arguments of the function ``advance`` but its number of steps.  clock, counts, status: as of
    :class:`Stepping`.
    progress: times and steps done.  times_count: of the times.  most: of the steps.  result: of the samples.
    """

    def __init__(self, code: Code, arrays: Sequence[Operand], clock: Operand, counts: Operand, status: int) -> None:
        self.code, self.arrays, self.clock, self.counts, self.status = code, arrays, clock, counts, status
        self.progress, self.times_count, self.most, self.result = code.arguments[-4:]

    def time(self, index: int) -> Operand:
        """A double of the clock."""
        return self.code.load_one(self.clock, index)

    @abstractmethod
    def covered(self, index: Operand) -> Operand:
        """Whether the last step covers a time, a bit."""

    @abstractmethod
    def aim(self, index: Operand) -> None:
        """Set a time as the target of ``advance``."""

    @abstractmethod
    def put(self, done: Operand, head: Any, otherwise: Any) -> None:
        """Write samples from the time ``done`` on and branch to ``head``, or to ``otherwise`` where there are none."""

    def write(self, advance: Any) -> None:
        """The loop over times and steps."""
        code, b = self.code, self.code.builder
        head, inside, step, sample, out = map(b.append_basic_block, ("head", "in", "step", "at", "out"))
        b.branch(head)
        b.position_at_end(head)
        done, taken = (code.load_one(self.progress, index) for index in range(2))
        running = code.load_one(self.counts, self.status) == 0
        pending = (done < self.times_count) & (taken < self.most)
        b.cbranch(running & pending, inside, out)
        b.position_at_end(inside)
        b.cbranch(self.covered(done), sample, step)
        b.position_at_end(step)
        self.aim(done)
        more = code.call(advance, [*self.arrays, self.most - taken])
        code.store_one(taken + more, self.progress, 1)
        b.branch(head)
        b.position_at_end(sample)
        self.put(done, head, out)
        b.position_at_end(out)
        b.ret_void()
