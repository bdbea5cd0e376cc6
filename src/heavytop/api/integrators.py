"""The contract of integrators, from Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from heavytop.integrate.peers.source import named
from heavytop.suite.integrator_check import Checked, check


def check_integrator(integrator: str | Callable[..., Any]) -> list[Checked]:
    """What an integrator answers to every request of the contract, odd ones too.

    Arguments:
        integrator: a name that `heavytop list` shows, a file ("mine.toml", "./mine.py:solve") or a callable.

    Returns:
        A list of :class:`Checked`: ``check``, ``verdict`` ("kept", "violated" or "note") and ``text``, a sentence.

    Raises:
        InputError: for an unknown integrator, and a file that describes none.
    """
    return check(named(integrator))
