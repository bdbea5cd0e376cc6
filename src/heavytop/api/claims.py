"""Audits of claims from Python."""

from __future__ import annotations

import os

from heavytop.api import arguments
from heavytop.claims.audit import PAPER, only_branch
from heavytop.claims.audit import audit as audit_named
from heavytop.claims.judge import Audit as Audit
from heavytop.top.equations import System


def audit(claim: str | os.PathLike[str], system: System | str | None = None, *, branch: str | None = None) -> Audit:
    """Prove or refute a claim, equation by equation.

    Arguments:
        claim: "ershkov-general", "ershkov-partial", or the path of a claim in TOML (docs/claims-in-toml.md).
        system: "heavy_top", "gyrostat" or "heavy_gyrostat": the system whose motion it is claimed to be; None for the
            file's, else "heavy_gyrostat" where its rotor is a list of three, else "heavy_top".
        branch: "smooth" or "printed": the rows of that branch alone.

    Returns:
        An :class:`Audit`; ``verdict`` is "holds" only where every equation is proven on its whole domain.

    Raises:
        InputError: for an unknown claim, system or branch, for a file that is no claim, and for one whose audit takes
            too long.
    """
    name = claim if isinstance(claim, str) and claim in PAPER else str(arguments.path(claim, "claim"))
    found = audit_named(name, None if system is None else arguments.system(system).name)
    return found if branch is None else only_branch(found, arguments.text(branch, "branch"))
