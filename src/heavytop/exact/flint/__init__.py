"""Balls: python-flint's arb, its context, and exact numbers in and out."""
