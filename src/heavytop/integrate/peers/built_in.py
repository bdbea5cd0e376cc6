"""The integrators of this program by name, and which extras each needs."""

from __future__ import annotations

from importlib.util import find_spec
from typing import NamedTuple

HERE = "heavytop.integrate.peers"


class BuiltIn(NamedTuple):
    """Where one of this program's is, as ``module:name``, and the modules of extras that it needs."""

    place: str
    needs: tuple[str, ...] = ()

    @property
    def lacks(self) -> str:
        """The first of them that is not installed; "" where none lacks."""
        return next((module for module in self.needs if find_spec(module) is None), "")


BUILT_IN = {
    "heyoka": BuiltIn("heavytop.integrate.taylor:propagate"),
    "heyoka:constants": BuiltIn(f"{HERE}.heyoka_taylor:constants"),
    "heyoka:lanes": BuiltIn(f"{HERE}.heyoka_taylor:lanes"),
    "multiword": BuiltIn("heavytop.integrate.words:propagate_words"),
    "scipy:DOP853": BuiltIn(f"{HERE}.scipy_ivp:dop853", ("scipy",)),
    "scipy:LSODA": BuiltIn(f"{HERE}.scipy_ivp:lsoda", ("scipy",)),
    "scipy:Radau": BuiltIn(f"{HERE}.scipy_ivp:radau", ("scipy",)),
    "cyrk:DOP853": BuiltIn(f"{HERE}.cyrk:dop853", ("CyRK", "numba")),
    "cyrk:Vern8": BuiltIn(f"{HERE}.cyrk:vern8", ("CyRK", "numba")),
    "sundials:CVODE": BuiltIn(f"{HERE}.sundials:cvode", ("sksundae",)),
    "diffrax:Dopri8": BuiltIn(f"{HERE}.diffrax_dopri8:dopri8", ("diffrax",)),
    "mpmath:odefun": BuiltIn(f"{HERE}.mpmath_taylor:odefun"),
    "splitting:2": BuiltIn(f"{HERE}.splitting:order2"),
    "splitting:4": BuiltIn(f"{HERE}.splitting:order4"),
    "splitting:8": BuiltIn(f"{HERE}.splitting:order8"),
}
