"""Steps on a grid of K words: h = ± a power of two, halved and doubled by the number of orders that a step takes.

A step that takes more than 0.53 K b orders is followed by one of half its length, one that takes fewer than 0.34 K b by
one of twice its length where the time is a multiple of that.  A step that does not converge, or in which a sum left its
range, is done again with half its length; where that goes on, the run ends.
"""

from __future__ import annotations

import ctypes
from typing import Any

from llvmlite import ir

from heavytop.top.equations import System
from heavytop.words.grid_samples import write_samples
from heavytop.words.grid_series import Series
from heavytop.words.kernels import Grid
from heavytop.words.machine import DOUBLES, INTEGERS, Machine, Processor, compiled
from heavytop.words.stepping import Stepping
from heavytop.words.vector import DOUBLE, INT, INT_POINTER, POINTER, Code, function

TIME, TARGET, BEGAN, SIGN, CLOCK = range(5)
"""Places of the clock, doubles: |time|, its target, the beginning of the last step; the direction."""
HALVINGS, FEWEST, MOST, STATUS, ORDERS, REDONE, EXCESS, COUNTS = range(8)
"""Places of the counts: −log2 h of the next step and its bounds, how the last one ended, its orders, steps redone;
log2 of what the constants were divided by."""
FINE, TOO_SMALL, CAPACITY = 0, 2, 3
_MANY_ORDERS, _FEW_ORDERS = 0.53, 0.34


def build(grid: Grid, system: System, attitude: bool, processor: Processor | None = None) -> Machine:
    """``advance``, ``series`` and ``samples`` for this system.

    advance(state, constants, inverses, rows, sums, places, seen, result, clock, counts, steps): at most so many steps,
    until the time covers the target; gives their number.  Behind the result lies the state before the last step.
    """
    module = ir.Module("grid")
    series = Series(module, grid, system, 2 if attitude else 1, (processor or Processor.here()).wide)
    made = series.write()
    _Advance(module, grid, series.vectors, made).write()
    write_samples(module, grid, series.vectors)
    pointers = [DOUBLES] * 5 + [INTEGERS, DOUBLES]
    integer = ctypes.c_int64
    return compiled(
        module,
        {
            "series": (integer, [*pointers, ctypes.c_double, integer, DOUBLES]),
            "advance": (integer, [*pointers, DOUBLES, DOUBLES, INTEGERS, integer]),
            "samples": (None, [DOUBLES, integer, DOUBLES, integer, integer, DOUBLES]),
        },
        processor,
    )


class _Advance(Stepping):
    """Writes ``advance``."""

    def __init__(self, module: ir.Module, grid: Grid, vectors: int, series: Any) -> None:
        arguments = [POINTER] * 5 + [INT_POINTER, POINTER, POINTER, POINTER, INT_POINTER, INT]
        made, code = function(module, "advance", INT, arguments)
        self.scratch, self.result = made.args[:7], made.args[7]
        clock, counts, most = made.args[8:]
        super().__init__(code, clock, counts, most, STATUS)
        self.grid, self.size, self.series = grid, grid.words * vectors, series

    def covered(self) -> Any:
        return self.code.builder.fcmp_ordered(">=", self.time(TIME), self.time(TARGET))

    def write_step(self) -> Any:
        """One step; whether it stands."""
        code, b = self.code, self.code.builder
        halvings = self.count(HALVINGS)
        length = _power(code, halvings)
        exponent = b.sub(self.count(EXCESS), halvings)
        raises = b.ashr(b.add(exponent, code.integer(3)), code.integer(2))
        raises = b.select(b.icmp_signed(">", raises, code.integer(0)), raises, code.integer(0))
        rest = b.sub(b.shl(raises, code.integer(2)), exponent)
        factor = b.fmul(self.time(SIGN), _power(code, rest))
        orders = b.call(self.series, [*self.scratch, factor, raises, self.result])
        good = b.icmp_signed(">=", orders, code.integer(0))
        time = self.time(TIME)
        after = b.fadd(time, length)
        moves = b.fcmp_ordered("==", b.fsub(after, time), length)
        good = b.and_(good, moves)
        with b.if_then(good):
            for k in range(self.size):
                code.store(code.load(self.scratch[0], 8 * k), self.result, 8 * (self.size + k))
                code.store(code.load(self.result, 8 * k), self.scratch[0], 8 * k)
            b.store(time, code.address(self.clock, BEGAN))
            b.store(after, code.address(self.clock, TIME))
            self.set_count(orders, ORDERS)
        with b.if_then(b.not_(good)):
            self.set_count(b.add(self.count(REDONE), code.integer(1)), REDONE)
            exhausted = b.icmp_signed(">=", halvings, self.count(MOST))
            status = b.select(exhausted, code.integer(CAPACITY), code.integer(FINE))
            self.set_count(b.select(moves, status, code.integer(TOO_SMALL)), STATUS)
        self._set_length(good, orders, halvings, length)
        return good

    def _set_length(self, good: Any, orders: Any, halvings: Any, length: Any) -> None:
        code, b, one = self.code, self.code.builder, self.code.integer(1)
        few, many = (code.integer(int(share * self.grid.total)) for share in (_FEW_ORDERS, _MANY_ORDERS))
        doubled = b.fadd(length, length)
        quotient = b.fdiv(self.time(TIME), doubled)
        whole = b.sitofp(b.fptosi(quotient, INT), DOUBLE)
        aligned = b.fcmp_ordered("==", quotient, whole)
        longer = b.and_(b.and_(good, aligned), b.icmp_signed("<=", orders, few))
        longer = b.and_(longer, b.icmp_signed(">", halvings, self.count(FEWEST)))
        shorter = b.or_(b.not_(good), b.icmp_signed(">", orders, many))
        following = b.select(shorter, b.add(halvings, one), halvings)
        self.set_count(b.select(longer, b.sub(halvings, one), following), HALVINGS)


def raises_of(exponent: int) -> tuple[float, int]:
    """(factor, raises) with factor 16^raises = 2^exponent and factor at most 1, as ``advance`` takes them."""
    raises = max(0, (exponent + 3) >> 2)
    return 2.0 ** (exponent - 4 * raises), raises


def _power(code: Code, halvings: Any) -> Any:
    """2^-halvings."""
    b = code.builder
    return b.bitcast(b.shl(b.sub(code.integer(1023), halvings), code.integer(52)), DOUBLE)
