"""Motions with separated variables: Abel integrals, their inversion, oscillation intervals."""
