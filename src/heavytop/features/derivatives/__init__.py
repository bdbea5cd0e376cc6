"""Jacobians computed elsewhere, scored."""
