"""The variational equation by powers of time, in machine code: V' = J(τ) V, V(0) = 1, in double."""

from __future__ import annotations

import ctypes
from threading import local
from typing import Any

import numpy
from llvmlite import ir

from heavytop.words.machine import DOUBLES, Doubles, Machine, compiled, doubles, once, pointer
from heavytop.words.vector import DOUBLE, INT, LANES, POINTER, Code, function


def variation(slopes: Doubles) -> Doubles:
    """V_0, …, V_T with (n + 1) V_(n+1) = Σ_(m ≤ n) J_m V_(n−m), each a scalar product in double.

    slopes: J_0, …, J_(T−1), shape (T, size, size).  The result has shape (T + 1, size, size).
    """
    orders, size, _ = slopes.shape
    room = _rooms.of(orders, size)
    room.given[:] = slopes.ravel()
    _machine(size).functions["variation"](*room.pointers, orders)
    return room.table[:, :, :size].copy()


class _Room:
    """What one thread computes with; V_0 stays."""

    def __init__(self, orders: int, size: int) -> None:
        width = _width(size)
        self.given, found = doubles(orders * size * size), doubles((orders + 1) * size * width)
        self.table = found.reshape(orders + 1, size, width)
        self.table[0, :, :size] = numpy.eye(size)
        self.pointers = pointer(self.given), pointer(found)


class _Rooms(local):
    def __init__(self) -> None:
        self.made: dict[tuple[int, int], _Room] = {}

    def of(self, orders: int, size: int) -> _Room:
        if (orders, size) not in self.made:
            self.made[orders, size] = _Room(orders, size)
        return self.made[orders, size]


_rooms = _Rooms()


def _width(size: int) -> int:
    """Doubles of a row of V."""
    return -(-size // LANES) * LANES


@once
def _machine(size: int) -> Machine:
    """variation(slopes, powers, orders) for matrices of ``size`` rows."""
    module = ir.Module("variation")
    made, code = function(module, "variation", ir.VoidType(), [POINTER, POINTER, INT])
    slopes, powers, orders = made.args
    b, width = code.builder, _width(size)

    def order(n: Any, _: list[Any]) -> None:
        after = b.add(n, code.integer(1))
        zeros = [code.zero] * (size * width // LANES)
        sums = code.loop(0, after, lambda m, values: _product(code, size, (slopes, powers), (m, n), values), zeros)
        divisor = code.spread(b.sitofp(after, DOUBLE))
        place = code.address(powers, b.mul(after, code.integer(size * width)))
        for k, total in enumerate(sums):
            code.store(b.fdiv(total, divisor), place, LANES * k)

    code.loop(0, orders, order, [])
    b.ret_void()
    return compiled(module, {"variation": (None, [DOUBLES, DOUBLES, ctypes.c_int64])})


def _product(code: Code, size: int, tables: tuple[Any, Any], at: tuple[Any, Any], sums: list[Any]) -> list[Any]:
    """``sums`` + J_m V_(n−m)."""
    b, width, (m, n) = code.builder, _width(size), at
    slope = code.address(tables[0], b.mul(m, code.integer(size * size)))
    power = code.address(tables[1], b.mul(b.sub(n, m), code.integer(size * width)))
    parts = width // LANES
    rows = [code.load(power, LANES * k) for k in range(size * parts)]
    found = list(sums)
    for i in range(size):
        for j in range(size):
            factor = code.spread(b.load(code.address(slope, size * i + j)))
            for part in range(parts):
                found[parts * i + part] = code.fma(factor, rows[parts * j + part], found[parts * i + part])
    return found
