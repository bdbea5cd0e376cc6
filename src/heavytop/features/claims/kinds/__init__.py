"""Kinds of measurement of claims."""
