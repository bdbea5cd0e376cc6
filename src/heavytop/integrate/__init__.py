"""Computed motions: integrators behind one call."""
