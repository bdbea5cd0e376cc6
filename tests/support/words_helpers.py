"""A known problem in scaled units, and the processors that code can be made for here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction

import pytest
from llvmlite import binding, ir

from heavytop.multiword.codegen.machine_code import Code, Machine, Operand, Processor, compiled, function
from heavytop.multiword.problem import Scaled
from heavytop.top.equations import HEAVY_TOP, Parameters


def problem(spin: int = 1, attitude: bool = False) -> Scaled:
    p = Parameters(
        (Fraction(3), Fraction(2), Fraction(1)), (Fraction(1, 2), Fraction(1, 3), Fraction(1, 5)), Fraction(0)
    )
    y = tuple(Fraction(text) * spin for text in ("1/10", "1/5", "9/10"))
    return Scaled.of(HEAVY_TOP, p, (*y, *map(Fraction, ("3/5", "0", "4/5", *(("0", "1", "0") if attitude else ())))))


def machine_of(
    write: Callable[[ir.Module, Code], Operand | None], arguments: Sequence[ir.Type], result: ir.Type | None = None
) -> Machine:
    """Machine code of a function ``f`` of what ``write`` writes, which returns its result where it has one."""
    module = ir.Module("f")
    _, code = function(module, "f", result or ir.VoidType(), arguments)
    value = write(module, code)
    code.builder.ret_void() if result is None else code.builder.ret(value)
    return compiled(module)


def here(feature: str) -> bool:
    return bool(binding.get_host_cpu_features().get(feature))


LEVELS = [
    pytest.param(Processor("x86-64"), marks=pytest.mark.skipif(not here("sse2"), reason="no such processor"), id="1"),
    pytest.param(Processor("x86-64-v3"), marks=pytest.mark.skipif(not here("fma"), reason="no FMA"), id="3"),
    pytest.param(Processor("x86-64-v4"), marks=pytest.mark.skipif(not here("avx512f"), reason="no AVX-512"), id="4"),
]
