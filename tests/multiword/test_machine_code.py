"""Formulas of the machine code: what they compute is what the same formulas are of numbers."""

from operator import add, and_, eq, ge, gt, le, lshift, lt, mul, ne, or_, rshift, sub, truediv, xor

import numpy
import pytest
from llvmlite import ir

from heavytop.multiword.codegen.machine_code import DOUBLE, INT, POINTER, Operand, doubles, function, pointer
from support.words_helpers import machine_of

PAIRS = [(1.5, -2.25), (-0.1, 3.0), (7.0, 7.0), (1e150, 1e-150), (5.0, 0.3)]
WHOLE = [(7, 3), (-9, 4), (12, 12), (1 << 40, 5)]
ON_DOUBLES = {
    **{operator.__name__: operator for operator in (add, sub, mul, truediv, lt, le, gt, ge, eq, ne)},
    "number before": lambda a, b: 2 - a + 3 * (1 + b),
    "number behind": lambda a, b: (a - 2) * 3 + (b + 1) / 4,
    "order": lambda a, b: a - (b - a) - b * -a,
}
ON_INTEGERS = {
    **{operator.__name__: operator for operator in (add, sub, mul, and_, or_, xor, lshift, rshift, lt, le, gt, ge, eq)},
    "numbers": lambda a, b: ((5 - a) * 3 + (-b << 2)) ^ ~a & 255 | 1,
    "quotient": lambda a, b: (a & 1023) // b,
}


def value_of(formula, kind: ir.Type, a, b):
    """What a formula gives in machine code, of two doubles or integers."""

    def write(_, code) -> Operand:
        found = formula(*code.arguments)
        is_flag = found.type == ir.IntType(1)
        return code.select(found, *((1.0, 0.0) if kind is DOUBLE else (1, 0))) if is_flag else found

    machine = machine_of(write, [kind, kind], kind)
    return machine.functions["f"](a, b)


@pytest.mark.parametrize("name", ON_DOUBLES)
def test_formulas_of_doubles(name: str) -> None:
    for a, b in PAIRS:
        assert value_of(ON_DOUBLES[name], DOUBLE, a, b) == ON_DOUBLES[name](a, b)


@pytest.mark.parametrize("name", ON_INTEGERS)
def test_formulas_of_integers(name: str) -> None:
    for a, b in WHOLE:
        assert value_of(ON_INTEGERS[name], INT, a, b) == ON_INTEGERS[name](a, b)


def test_formulas_of_eight_doubles() -> None:
    def write(_, code) -> None:
        first, second, result = code.arguments
        a, b = code.load(first, 0), code.load(second, 0)
        for k, formula in enumerate(ON_DOUBLES.values()):
            value = formula(a, b)
            flag = value.type == ir.VectorType(ir.IntType(1), 8)
            code.store(code.select(value, 1.0, 0.0) if flag else value, result, 8 * k)

    machine = machine_of(write, [POINTER] * 3)
    arrays = doubles(8), doubles(8), doubles(8 * len(ON_DOUBLES))
    arrays[0][:5], arrays[1][:5] = zip(*PAIRS, strict=True)
    arrays[1][5:] = 1.0
    machine.functions["f"](*map(pointer, arrays))
    for formula, row in zip(ON_DOUBLES.values(), arrays[2].reshape(-1, 8), strict=True):
        assert numpy.array_equal(row, [float(formula(*pair)) for pair in zip(*arrays[:2], strict=True)])


def test_bits_and_conversions() -> None:
    for a, _ in PAIRS:
        bits = int(numpy.float64(a).view(numpy.int64))
        assert value_of(lambda a, _: (a.bits() ^ 0).of_bits(), DOUBLE, a, 0.0) == a
        assert value_of(lambda a, _: a.unsigned_shift(52), INT, bits, 0) == (bits % 2**64) >> 52
    assert [value_of(lambda a, _: a.to_integer().to_double(), DOUBLE, a, 0.0) for a in (2.75, -2.75)] == [2.0, -2.0]


def test_a_comparison_is_no_condition_of_python() -> None:
    _, code = function(ir.Module("condition"), "f", INT, [INT, INT])
    a, b = code.arguments
    with pytest.raises(TypeError, match="not known when the code is made"):
        assert 0 < a < b
