"""The proven bound of first variations in words, attacked with exact integers."""

from fractions import Fraction
from math import ldexp
from random import Random

import numpy
import pytest

from heavytop import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, HeavyTop, State
from heavytop.exact.enclosure import derivatives
from heavytop.exact.enclosure.run import Validated
from heavytop.exact.enclosure.step import Whole, lacking
from heavytop.multiword.fixed_point.arithmetic import grid_of
from heavytop.multiword.fixed_point.first_variation import WordColumns
from multiword.test_proven import extreme_centre, rounded
from support.helpers import moments_of_a_body


def some(random: Random, system) -> Validated:
    moments = moments_of_a_body(random)
    centre = [Fraction(random.randint(-4096, 4096), 4096) for _ in range(3)]
    rotor = (1, "1/2", "-1/3") if system is HEAVY_GYROSTAT else None
    start = State(
        [Fraction(random.randint(-7000, 7000), 4096) for _ in range(3)],
        random.choice([("3/5", 0, "4/5"), (0, 1, 0), ("2/3", "-2/3", "1/3")]),
    )
    weight = 0 if system is GYROSTAT else Fraction(10) ** random.randint(-3, 3)
    given = HeavyTop(moments, weight, centre) if rotor is None else HeavyTop(moments, weight, centre, rotor=rotor)
    return Validated(given, start, system, rotor=Fraction(1, 3) if system is GYROSTAT else None)


def used(known: Validated, words: int, extreme: bool, random: Random) -> tuple[float, float]:
    """How much of the bounds of Φ and of σ is used."""
    grid, motion = grid_of(words, whole=True), known.motion(random.choice((1, -1)))
    tangent = derivatives._tangent(known, motion, grid.total, True, tuple(range(6)))
    centre = extreme_centre(random, grid, 6) if extreme else rounded(motion, grid)
    for halvings in range(2, 12):
        own = tangent.certified.series(centre, halvings)
        found = None if own is None else tangent.columns.columns(centre, halvings, values=True)
        if found is not None:
            break
    flat = [component for column in found.values for component in column]
    assert [[sum(component) for component in column] for column in found.values] == found.total
    unit = [(k == j) << grid.total for j in range(12) for k in range(6)]
    assert [component[0] for component in flat] == unit[:36] + [0] * 36
    for column, sizes in zip(found.values, found.sizes, strict=True):
        for together, size in zip(zip(*column, strict=True), sizes, strict=True):
            assert max(map(abs, together)) <= Fraction(size) * 2**grid.total
    more = len(flat[0]) - own.order - 1
    padded = [[*component, *[0] * more] for component in own.values]
    shares = []
    for count, data, bound in zip((36, 72), ([], tangent.data), found.rounding, strict=True):
        together = derivatives.Together.of(motion.field, [datum.field for datum in data])
        off = lacking(together, Whole([*padded, *flat[:count]], grid.total), grid.total, halvings)[: own.order]
        shares.append(float(sum(off) / Fraction(bound)))
    return shares[0], shares[1]


@pytest.mark.slow
@pytest.mark.parametrize(("words", "system"), [(3, HEAVY_TOP), (4, HEAVY_GYROSTAT), (6, GYROSTAT)])
def test_what_columns_lack_is_within_the_bounds(words: int, system) -> None:
    random = Random(words)
    shares = [used(some(random, system), words, extreme, random) for extreme in (False, True)]
    for of_a_kind in zip(*shares, strict=True):
        assert 1e-6 < max(of_a_kind) <= 1


@pytest.mark.parametrize("omega", [(0, 0, 0), ("1e-20", 0, 0), (0, 1, "1e-30")])
def test_columns_that_are_0_at_first_are_not_lost(omega) -> None:
    """From rest the first coefficients of many columns are 0 and later ones are not."""
    known = Validated(HeavyTop((3, 2, 1), 1, (0, 0, 1)), State(omega, ("3/5", 0, "4/5")), HEAVY_TOP)
    assert max(used(known, 4, False, Random(1))) <= 1


@pytest.mark.parametrize("words", [3, 24])
def test_columns_end_where_their_last_coefficients_are_a_thousand_ulps(words: int) -> None:
    """Also of 1,032 bits, the ulp of which is no normal double."""
    grid = grid_of(words, whole=True)
    for ulps, small in ((1000, True), (1100, False)):
        sizes = numpy.array([[1.0, 0.0], [0.5, ldexp(ulps, -grid.total)]])
        assert WordColumns([], None, sizes, (0.0, 0.0)).ends_small(grid) == small
