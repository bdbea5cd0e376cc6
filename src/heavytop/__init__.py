"""heavytop measures how wrong computed and claimed motions of a heavy top are, against references that are proven.

The public names; each is imported when it is first used, so that ``import heavytop`` loads nothing heavy.
"""

from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from heavytop.api import plot
    from heavytop.api.motions import Integrator, Propagated, ensemble, propagate, reference
    from heavytop.api.reports import Comparison, History, Report, compare, history, read_report, run
    from heavytop.errors import Contradiction, HeavyTopError, InputError, OutOfReach
    from heavytop.features.claims.api import ClaimLibrary, audit, claim_library
    from heavytop.features.claims.audit.judge import Audit
    from heavytop.features.derivatives.api import DerivativeScore, score_derivatives
    from heavytop.features.events.api import events, poincare
    from heavytop.features.events.functions import Events, ReferenceEvents, Section
    from heavytop.features.hunt.api import Hunt, hunt
    from heavytop.features.limits.between import between_samples
    from heavytop.features.limits.digits_end import digits_end
    from heavytop.features.limits.power import power
    from heavytop.features.score.api import Score, Summary, drift, score
    from heavytop.features.survey.api import read_survey
    from heavytop.integrate.trajectory import Outcome, Trajectory
    from heavytop.measure.reference import Reference
    from heavytop.precision import DOUBLE, DOUBLE_DOUBLE, EXTENDED, QUAD, Precision, available, real
    from heavytop.top.attitude import Attitude
    from heavytop.top.bodies import Body
    from heavytop.top.equations import GYROSTAT, HEAVY_GYROSTAT, HEAVY_TOP, System, holding
    from heavytop.top.heavy_top import HeavyTop, State

    __version__: str

_MODULES = {
    "api.motions": ("Integrator", "Propagated", "ensemble", "propagate", "reference"),
    "api.reports": ("Comparison", "History", "Report", "compare", "history", "read_report", "run"),
    "errors": ("Contradiction", "HeavyTopError", "InputError", "OutOfReach"),
    "integrate.trajectory": ("Outcome", "Trajectory"),
    "measure.reference": ("Reference",),
    "precision": ("DOUBLE", "DOUBLE_DOUBLE", "EXTENDED", "QUAD", "Precision", "available", "real"),
    "top.attitude": ("Attitude",),
    "top.bodies": ("Body",),
    "top.equations": ("GYROSTAT", "HEAVY_GYROSTAT", "HEAVY_TOP", "System", "holding"),
    "top.heavy_top": ("HeavyTop", "State"),
}


def _module(name: str) -> ModuleType:
    """The module of a public name; raises AttributeError."""
    for module, names in _MODULES.items():
        if name in names:
            return import_module(f"heavytop.{module}")
    from heavytop.features import FEATURES

    for feature in FEATURES:
        for module, names in feature.python.items():
            if name in names:
                return import_module(f"{feature.package}.{module}")
    raise AttributeError(f"module 'heavytop' has no attribute {name!r}")


__all__ = [
    "DOUBLE",
    "DOUBLE_DOUBLE",
    "EXTENDED",
    "GYROSTAT",
    "HEAVY_GYROSTAT",
    "HEAVY_TOP",
    "QUAD",
    "Attitude",
    "Audit",
    "Body",
    "ClaimLibrary",
    "Comparison",
    "Contradiction",
    "DerivativeScore",
    "Events",
    "HeavyTop",
    "HeavyTopError",
    "History",
    "Hunt",
    "InputError",
    "Integrator",
    "OutOfReach",
    "Outcome",
    "Precision",
    "Propagated",
    "Reference",
    "ReferenceEvents",
    "Report",
    "Score",
    "Section",
    "State",
    "Summary",
    "System",
    "Trajectory",
    "__version__",
    "audit",
    "available",
    "between_samples",
    "claim_library",
    "compare",
    "digits_end",
    "drift",
    "ensemble",
    "events",
    "history",
    "holding",
    "hunt",
    "plot",
    "poincare",
    "power",
    "propagate",
    "read_report",
    "read_survey",
    "real",
    "reference",
    "run",
    "score",
    "score_derivatives",
]


if not TYPE_CHECKING:  # it would tell a type checker that every name is there

    def __getattr__(name: str) -> object:
        if name == "__version__":
            from heavytop.version import version

            return version()
        if name == "plot":
            return import_module("heavytop.api.plot")
        value = getattr(_module(name), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted(__all__)
