"""Jacobi's functions of a real argument u and a parameter m = k², 0 ≤ m ≤ 1, as formulas of a claim.

sn² + cn² = 1, dn² + m sn² = 1, dn > 0;  d/du sn = cn dn, cn' = −sn dn, dn' = −m sn cn  (DLMF 22.6.1, 22.13.1).
"""

from __future__ import annotations

from typing import Any

import sympy

NAMES = ("sn", "cn", "dn")


class _Jacobi(sympy.Function):  # type: ignore[misc]
    """Real and analytic in u; the parameter has no rate here: it does not move in any claim that is proven."""

    nargs = 2
    is_real = True

    def fdiff(self, argindex: int = 1) -> sympy.Expr:
        u, m = self.args
        if argindex != 1:
            return sympy.Function(f"rate_of_{type(self).__name__}_by_m", real=True)(u, m)
        rates: dict[str, Any] = {
            "sn": lambda: cn(u, m) * dn(u, m),
            "cn": lambda: -sn(u, m) * dn(u, m),
            "dn": lambda: -m * sn(u, m) * cn(u, m),
        }
        return rates[type(self).__name__]()


class sn(_Jacobi):  # noqa: N801
    """sn(u, m)."""

    @classmethod
    def eval(cls, u: sympy.Expr, m: sympy.Expr) -> sympy.Expr | None:
        if u.is_zero:
            return sympy.S.Zero
        if u.could_extract_minus_sign():
            return -cls(-u, m)
        return sympy.sin(u) if m.is_zero else sympy.tanh(u) if m == 1 else None


class cn(_Jacobi):  # noqa: N801
    """cn(u, m)."""

    @classmethod
    def eval(cls, u: sympy.Expr, m: sympy.Expr) -> sympy.Expr | None:
        if u.is_zero:
            return sympy.S.One
        if u.could_extract_minus_sign():
            return cls(-u, m)
        return sympy.cos(u) if m.is_zero else sympy.sech(u) if m == 1 else None


class dn(_Jacobi):  # noqa: N801
    """dn(u, m)."""

    @classmethod
    def eval(cls, u: sympy.Expr, m: sympy.Expr) -> sympy.Expr | None:
        if u.is_zero or m.is_zero:
            return sympy.S.One
        if u.could_extract_minus_sign():
            return cls(-u, m)
        return sympy.sech(u) if m == 1 else None
