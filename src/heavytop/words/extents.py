"""How large the words of a series are, in machine code: what the proof of :mod:`heavytop.words.proven` needs."""

from __future__ import annotations

import ctypes
from typing import Any

from llvmlite import ir

from heavytop.words.machine import DOUBLES, Machine, compiled, once
from heavytop.words.vector import INT, POINTER, Code, function

# y out of L = (Ω2, Ω3, Ω1, γ2 + γ3, γ1 + γ2, 2 γ2, …): lane by lane L[first] − L[second]/2, where 8 is a zero
_FIRST, _SECOND = (2, 0, 1, 4, 5, 3, 8, 8), (8, 8, 8, 5, 5, 5, 8, 8)


@once
def machine(words: int, vectors: int) -> Machine:
    """extents(rows, orders, values, sizes, widest, added) for rows of R and L of each vector, K words each.

    values, sizes: for each order and vector Σ_k y_k and Σ_k |word k of y|, eight doubles each; the smallest words are
    added first, so that a value is right to 2^-50 of its size.  widest: max_n |word k| of R and of each L.
    added: Σ_n |word k of y| of each vector.
    """
    module = ir.Module("extents")
    made, code = function(module, "extents", ir.VoidType(), [POINTER, INT, *[POINTER] * 4])
    rows, orders, values, sizes, widest, added = made.args
    b, row = code.builder, words * (1 + vectors)
    for k in range(row):
        code.store(code.zero, widest, 8 * k)
    for k in range(words * vectors):
        code.store(code.zero, added, 8 * k)

    def order(n: Any, _: list[Any]) -> None:
        at = code.address(rows, b.mul(n, code.integer(8 * row)))
        side = [code.load(at, 8 * k) for k in range(row)]
        for k, word in enumerate(side):
            code.store(code.larger(code.absolute(word), code.load(widest, 8 * k)), widest, 8 * k)
        for v in range(vectors):
            value = size = code.zero
            for k in reversed(range(words)):
                y = _component(code, side[words * (1 + v) + k])
                magnitude, place = code.absolute(y), 8 * (words * v + k)
                code.store(code.add(code.load(added, place), magnitude), added, place)
                value, size = code.add(value, y), code.add(size, magnitude)
            place = b.mul(b.add(b.mul(n, code.integer(vectors)), code.integer(v)), code.integer(8))
            code.store(value, code.address(values, place), 0)
            code.store(size, code.address(sizes, place), 0)

    code.loop(0, b.add(orders, code.integer(1)), order, [])
    b.ret_void()
    return compiled(module, {"extents": (None, [DOUBLES, ctypes.c_int64, *[DOUBLES] * 4])})


def _component(code: Code, left: Any) -> Any:
    """A word of y, exactly."""
    half = code.shuffle(left, code.zero, _SECOND)
    return code.fma(half, code.constant(-0.5), code.shuffle(left, code.zero, _FIRST))
