"""Exact numbers as words on fixed grids, and which grid serves a number of bits."""

from __future__ import annotations

from fractions import Fraction
from math import ldexp

from heavytop.words.kernels import Grid
from heavytop.words.machine import Doubles

# words up to which so many bits are safe in each: products of a few hundred orders stay inside the sums
_BITS_OF_A_WORD = ((2, 48), (4, 46), (6, 45), (12, 44), (24, 43))
MOST_WORDS = 24
_NARROWER = 2
"""By so many bits words are narrower where that is enough: fewer bits take fewer orders."""


def grid_of(words: int, whole: bool = False) -> Grid:
    """The grid of so many words, 2 to 24; whole: as in :class:`heavytop.words.kernels.Grid`."""
    return Grid(words, next(bits for most, bits in _BITS_OF_A_WORD if words <= most), whole)


def grid_for(bits: int) -> Grid | None:
    """The smallest grid of at least so many bits and three words, of two widths a word; None where there is none."""
    wide = next((grid for grid in map(grid_of, range(3, MOST_WORDS + 1)) if grid.total >= bits), None)
    if wide is None:
        return None
    narrow = Grid(wide.words, wide.bits - _NARROWER)
    return narrow if narrow.total >= bits else wide


def digits(value: Fraction, grid: Grid) -> list[float]:
    """``value`` rounded to a multiple of the last unit, as words."""
    top, bottom = value.as_integer_ratio()
    whole, rest = divmod(top << grid.total, bottom)
    whole += 2 * rest > bottom or (2 * rest == bottom and whole & 1)  # to nearest, a tie to even
    found = []
    for k in range(grid.words):
        shift = grid.bits * (grid.words - 1 - k)
        digit = (whole + (1 << shift >> 1)) >> shift if k < grid.words - 1 else whole
        whole -= digit << shift
        found.append(ldexp(float(digit), -grid.bits * (k + 1)))
    return found


def exact(words: Doubles) -> Fraction:
    """The number that words add to."""
    ratios = [word.as_integer_ratio() for word in words.tolist()]
    bottom = max(below for _, below in ratios)  # all are powers of two
    return Fraction(sum(above * (bottom // below) for above, below in ratios), bottom)
