"""Nested square roots that are sums of simpler ones: √(3 + 2√2) = 1 + √2, √(a + √(a² − b²)) = (√(a + b) + √(a − b))/√2.

With p = A + B R, R = √C ≥ 0, and A² − B² C = D²,

    √p = √((A + D)/2) + s √((A − D)/2),   s = sign B,

where A ≥ 0, so that both radicands are ≥ 0 with p; for s < 0 also D ≥ 0, so that the sum is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from heavytop.claims.sign import Unprovable, used

if TYPE_CHECKING:
    from heavytop.claims.rational import Quotient, Tower

# roots within roots that are taken apart
_DEPTH = 3
_MAX_TERMS = 40


def denested(tower: Tower, p: Any, depth: int = _DEPTH) -> Quotient | None:
    """√p through roots that are nested less, for a polynomial ``p`` in roots; None where there is no such sum.

    It is √p wherever that is real.
    """
    roots = [index for index in sorted(used(p), reverse=True) if tower.generators[index].kind == "root"]
    if not depth or len(p) > _MAX_TERMS:
        return None
    for index in roots:
        try:
            found = _as_sum(tower, p, index, depth)
        except Unprovable:
            continue
        if found is not None:
            return found
    return _through_conjugate(tower, p) if roots else None


def _as_sum(tower: Tower, p: Any, index: int, depth: int) -> Quotient | None:
    """√(A + B R), R = √C the generator ``index``."""
    parts = tower.by_power(p, index)
    if parts.keys() != {0, 1}:
        return None
    a, b = parts[0], parts[1]
    s = tower.signs.of(b).value
    norm = tower.reduce(tower.times(a, a) - tower.times(tower.times(b, b), tower.radicand(index)))
    if not s or tower.signs.of(a).value <= 0:
        return None
    d = _plain_root(tower, norm, any_sign=s > 0)
    if d is None or d.denominator != tower.one:
        return None
    halves = [_simpler_root(tower, (a + sign * d.numerator) / 2, depth - 1) for sign in (1, -1)]
    if halves[0] is None or halves[1] is None:
        return None
    return tower.sum((halves[0], tower.product((tower.number(s), halves[1]))))


def _simpler_root(tower: Tower, p: Any, depth: int) -> Quotient | None:
    plain = _plain_root(tower, p)
    return denested(tower, p, depth) if plain is None else plain


def _plain_root(tower: Tower, p: Any, *, any_sign: bool = False) -> Quotient | None:
    """√p where that nests no root, from factors of known sign; with ``any_sign`` some D with D² = p."""
    if not p:
        return tower.number(0)
    constant, factors = tower.signs.factors(p)
    result = tower.one
    for factor, power in factors:
        sign = 1 if _needs_no_sign(power, any_sign) else tower.signs.of(factor).value
        if power % 2:
            constant = constant * sign
            known = tower.known_root(factor * sign) if sign else None
            is_nested = any(tower.radicand(i) is not None for i in used(factor))
            if not sign or (known is None and is_nested):
                return None
        elif not sign:
            return None
    if constant < 0:
        return None
    root = tower.root_of_number(constant)
    for factor, power in factors:
        sign = 1 if _needs_no_sign(power, any_sign) else tower.signs.of(factor).value
        result = tower.times(result, tower.raised(factor * sign, int(power) // 2))
        if power % 2:
            result = tower.times(result, tower.gens[tower.root_of(factor * sign)])
    return tower.product((tower.polynomial(result), root))


def _needs_no_sign(power: Any, any_sign: bool) -> bool:
    """An even power of a factor comes out of the root, as does any where the sign of the root may be either."""
    return bool(power % 4 == 0 or (any_sign and power % 2 == 0))


def _through_conjugate(tower: Tower, p: Any) -> Quotient | None:
    """√p = √(p q)/√q, for a root √q of the tower with p q the square of something plain: √(√2 − 1) = 1/√(√2 + 1)."""
    for index in reversed(range(len(tower.generators))):
        q = tower.radicand(index)
        if q is None or tower.generators[index].kind != "root" or not tower.generators[index].strict:
            continue
        if len(q) > _MAX_TERMS or not any(tower.radicand(i) is not None for i in used(q) & used(p)):
            continue
        try:
            root = _plain_root(tower, tower.reduce(tower.times(p, q)))
        except Unprovable:
            continue
        if root is not None:
            return tower.divide(root, tower.polynomial(tower.gens[index]))
    return None
