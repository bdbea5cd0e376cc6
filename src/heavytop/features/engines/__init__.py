"""Rigid-body engines: adapters to the protocol of programs, and a plan that measures the installed ones."""

from heavytop.feature import Feature

FEATURE = Feature(__name__, plans=("engines",), starters="adapters")
