"""Sums of products of series in digits of 24 bits: every product and every sum is exact.

Digits are whole numbers, |d| ≤ 2^23 + 4.  A product of two is a whole number of at most 2^46 (1 + 2^-18), and 120 of
them add up to less than 2^53: a double holds their sum, one operation a product, in any order and without a look at
exponents.  Products with i + j < q are computed in tiles, some digits of the left by as many of the right with a sum
for each i + j, over so many orders that no sum has more than 120 products; it is then split at 2^24, so that what adds
up over all orders stays far below 2^53 too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from llvmlite import ir

from heavytop.words.vector import INT, INT_POINTER, LANES, POINTER, Code, function

BITS = 24
SUM_BITS = 38
"""Of the sum of a level over 700 orders: 50 groups of orders in 8 tiles, or fewer in more, of 2^29 and 2^23 each."""
_PRODUCTS = 120
_ROUND = 1.5 * 2.0**52


def rounded(code: Code, value: Any, place: int = 0) -> Any:
    """To the nearest multiple of 2^place, for |value| ≤ 2^(51 + place)."""
    big = code.constant(_ROUND * 2.0**place)
    return code.subtract(code.add(value, big), big)


@dataclass(frozen=True, slots=True)
class _Tiles:
    """side: digits of the left and of the right in a tile.  triangle: levels up to which one tile has all.
    sums: kept in registers.
    """

    side: int
    triangle: int
    sums: int


_WIDE, _NARROW = _Tiles(8, 13, 18), _Tiles(4, 4, 7)


def _write_tile(module: ir.Module, levels: int, side: int, most_sums: int) -> Any:
    """(left, right, where, orders, sums): sums += Σ_m left[where[m]] right[−where[m]] for i + j < levels, i, j < side.

    Split at 2^24: what is whole multiples of that is added to the level before.
    """
    made, code = function(module, f"tile_{levels}_{side}", ir.VoidType(), [POINTER, POINTER, INT_POINTER, INT, POINTER])
    made.linkage = "internal"
    made.attributes.add("noinline")
    left, right, where, orders, sums = made.args
    b = code.builder
    pairs = [
        [(i, level - i) for i in range(side) if 0 <= level - i < side] for level in range(min(levels, 2 * side - 1))
    ]
    ways = [1] * len(pairs)
    while sum(ways) < most_sums and (rest := [k for k, pair in enumerate(pairs) if ways[k] < len(pair)]):
        ways[max(rest, key=lambda k: len(pairs[k]) / ways[k])] += 1
    most = _PRODUCTS // max(map(len, pairs))
    begins = [sum(ways[:level]) for level in range(len(ways) + 1)]

    def order(m: Any, values: list[Any]) -> list[Any]:
        at, found = b.load(code.address(where, m)), list(values)
        one, other = code.address(left, at), code.address(right, b.neg(at))
        a = [code.load(one, LANES * i) for i in range(side)]
        for j in range(side):
            c = code.load(other, LANES * j)
            for i in range(side):
                if i + j < levels:
                    place = begins[i + j] + pairs[i + j].index((i, j)) % ways[i + j]
                    found[place] = code.multiply_add(a[i], c, found[place])
        return found

    def group(g: Any, _: list[Any]) -> None:
        start = b.mul(g, code.integer(most))
        stop = b.add(start, code.integer(most))
        stop = b.select(b.icmp_signed("<", stop, orders), stop, orders)
        _add_levels(code, sums, begins, code.loop(start, stop, order, [code.zero] * begins[-1]))

    code.loop(0, b.sdiv(b.add(orders, code.integer(most - 1)), code.integer(most)), group, [])
    b.ret_void()
    return made


def _add_levels(code: Code, sums: Any, begins: list[int], values: list[Any]) -> None:
    """sums += the values of each level, split at 2^24."""
    carries, rest = [], []
    for level in range(len(begins) - 1):
        first, *others = values[begins[level] : begins[level + 1]]
        for value in others:
            first = code.add(first, value)
        carries.append(rounded(code, first, BITS))
        rest.append(code.subtract(first, carries[-1]))
    down = code.constant(2.0**-BITS)
    for level, (value, carry) in enumerate(zip([code.zero, *rest], [*carries, code.zero], strict=True)):
        place = LANES * level
        total = code.add(code.load(sums, place), value)
        code.store(code.multiply_add(carry, down, total), sums, place)


def write_sums(module: ir.Module, wide: bool) -> Any:
    """(left, right, where, orders, levels, sums): sums += Σ_m left[where[m]] right[−where[m]] for i + j < levels.

    sums begins with what is whole multiples of a level before the first.  where counts doubles, a digit has eight.
    wide: as :attr:`heavytop.words.machine.Processor.wide`; the sums are the same.

    Few levels are one tile.  Else a few orders at a time, which stay near, go through all tiles.
    """
    sizes = _WIDE if wide else _NARROW
    side = sizes.side
    triangles = [_write_tile(module, d, d, sizes.sums) for d in range(1, sizes.triangle + 1)]
    tiles = triangles[:side] + [_write_tile(module, d, side, sizes.sums) for d in range(side + 1, 2 * side)]
    arguments = [POINTER, POINTER, INT_POINTER, INT, INT, POINTER]
    made, code = function(module, "sum_products", ir.VoidType(), arguments)
    made.linkage = "internal"
    made.attributes.add("noinline")
    left, right, where, orders, levels, sums = made.args
    b, tile, group = code.builder, code.integer(LANES * side), code.integer(_PRODUCTS // side)
    many = b.icmp_signed(">", levels, code.integer(len(triangles)))
    with b.if_then(b.not_(many)):
        _call(code, triangles, levels, [left, right, where, orders, sums])
        b.ret_void()
    parts = b.sdiv(b.add(levels, code.integer(side - 1)), code.integer(side))

    def some(g: Any, _: list[Any]) -> None:
        start = b.mul(g, group)
        rest = b.sub(orders, start)
        count = b.select(b.icmp_signed("<", rest, group), rest, group)

        def one(i: Any, _: list[Any]) -> None:
            def other(j: Any, _: list[Any]) -> None:
                ahead = b.add(i, j)
                both = [code.address(base, b.mul(k, tile)) for base, k in ((left, i), (right, j))]
                places = [code.address(where, start), count, code.address(sums, b.mul(ahead, tile))]
                _call(code, tiles, b.sub(levels, b.mul(ahead, code.integer(side))), [*both, *places])

            code.loop(0, b.sub(parts, i), other, [])

        code.loop(0, parts, one, [])

    code.loop(0, b.sdiv(b.add(orders, b.sub(group, code.integer(1))), group), some, [])
    b.ret_void()
    return made


def _call(code: Code, tiles: list[Any], levels: Any, arguments: list[Any]) -> None:
    """The tile of so many levels, if there are any, or the last."""
    b = code.builder
    end = b.append_basic_block("end")
    blocks = [b.append_basic_block(f"levels_{d}") for d in range(1, len(tiles) + 1)]
    switch = b.switch(levels, blocks[-1])
    switch.add_case(code.integer(0), end)
    for d, (tile, block) in enumerate(zip(tiles, blocks, strict=True), 1):
        switch.add_case(code.integer(d), block)
        b.position_at_end(block)
        b.call(tile, arguments)
        b.branch(end)
    b.position_at_end(end)
