"""Elliptic functions as balls: Jacobi's, Weierstrass', theta functions, and x'² = quartic."""
