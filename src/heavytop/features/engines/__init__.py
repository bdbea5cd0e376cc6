"""Engines of rigid bodies: adapters of each over one protocol, and a plan that measures those that are installed."""

from heavytop.feature import Feature

FEATURE = Feature(__name__, plans=("engines",), starters="adapters")
