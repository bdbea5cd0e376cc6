"""The largest singular value of a real matrix of balls, enclosed."""

from __future__ import annotations

from flint import acb_mat, arb, arb_mat

from heavytop.exact.balls import working_precision
from heavytop.exact.flint_context import whole_evaluation


@whole_evaluation
def largest_singular_value(matrix: list[list[arb]], bits: int) -> arb:
    """σ ≥ 0 with σ² the largest eigenvalue of S = JᵀJ: a ball, as narrow as ``matrix`` allows to ``bits`` bits.

    From below Rayleigh's quotient of any vector, here an approximate eigenvector, at most σ².  From above any μ such
    that μ − S is positive definite, which Cholesky's factorisation in balls proves: μ is the quotient and a margin,
    sixteen times as large as long as the factorisation does not exist.  So several equal singular values do no harm.
    An infinite ball where neither comes to an end.
    """
    with working_precision(2 * bits + 64):
        given = arb_mat(matrix)
        square = given.transpose() * given
        below = _quotient(square)
        margin = below.abs_upper() * arb(2) ** -(bits + 8)
        for _ in range(bits // 4 + 16):
            above = (below + margin).upper()
            if _positive_definite(above, square):
                return below.lower().sqrt().union(above.sqrt())
            margin = margin * 16
        return arb(0, arb("inf"))


def _quotient(square: arb_mat) -> arb:
    """xᵀSx/xᵀx of the approximate eigenvector x of the largest eigenvalue."""
    size = square.nrows()
    middle = acb_mat([[square[i, j].mid() for j in range(size)] for i in range(size)])
    values, vectors = middle.eig(right=True, algorithm="approx")
    largest = max(range(size), key=lambda k: float(values[k].real.mid() / (1 + values[0].real.abs_upper())))
    x = arb_mat([[vectors[i, largest].real.mid()] for i in range(size)])
    numerator, denominator = (x.transpose() * square * x)[0, 0], (x.transpose() * x)[0, 0]
    return numerator / denominator


def _positive_definite(shift: arb, square: arb_mat) -> bool:
    """Whether shift − S is: every pivot of its L D Lᵀ factorisation is proven to be positive."""
    size = square.nrows()
    rest = [[(shift if i == j else arb(0)) - square[i, j] for j in range(size)] for i in range(size)]
    for k in range(size):
        pivot = rest[k][k]
        if not pivot > 0:
            return False
        for i in range(k + 1, size):
            for j in range(k + 1, i + 1):
                rest[i][j] = rest[j][i] = rest[i][j] - rest[i][k] * rest[j][k] / pivot
    return True
