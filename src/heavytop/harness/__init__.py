"""Runs of plans."""

from heavytop.features import FEATURES

OF_FEATURES = {plan: feature.package for feature in FEATURES for plan in feature.plans}
BUILT_IN = ("smoke", "default", "growth", "long", "peers", "gate", "bodies", "claims", "selftest", *OF_FEATURES)
