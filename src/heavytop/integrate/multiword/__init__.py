"""This program's own Taylor integrators, in several doubles."""
