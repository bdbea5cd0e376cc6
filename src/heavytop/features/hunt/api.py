"""`heavytop.hunt`: the search for the motion that breaks an integrator."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from shlex import quote
from typing import Any

from heavytop import arguments
from heavytop.arguments import Number
from heavytop.errors import quoted, refusal
from heavytop.features.hunt.measured import Family
from heavytop.features.hunt.search import Advance, Hunted, HuntRequest, documents
from heavytop.features.hunt.search import hunt as search
from heavytop.features.hunt.text import hunt_text
from heavytop.integrate import registry
from heavytop.integrate.peers.command import close_all
from heavytop.integrate.registry import described, named
from heavytop.precision import Precision, as_integer, physical, time_text

_MOST_SECONDS = 10**7
_BUDGET = 'Give a number of motions, "5000", or seconds, "60s".'


@dataclass(frozen=True, slots=True, repr=False)
class Hunt:
    """The result of a hunt; prints as `heavytop hunt` does.

    found: a dict each, worst first: exact texts of ``inertia``, ``weight``, ``centre``, ``omega`` and ``gamma`` after
    shrinking, ``system``, ``digits_lost``, ``ratio`` to the other integrator's error (None where one was aborted),
    ``outcome``, ``class``, ``command`` that shows it again, ``toml`` ready to paste.
    motions: that were tried, shrinking left out.  seed: of the search.
    hunted: everything that was measured; again: the command of the same search.
    """

    found: list[dict[str, Any]]
    motions: int
    seed: int
    hunted: Hunted
    again: str

    def __repr__(self) -> str:
        return hunt_text(self.hunted, self.found, self.again)

    def document(self) -> dict[str, Any]:
        """The document of `heavytop hunt --json`."""
        return {"found": self.found, "motions": self.motions, "seed": self.seed}


def hunt(
    integrator: str | Callable[..., Any] = "heyoka",
    precision: Precision | str = "double",
    horizon: Number = 100,
    budget: int | str = "5000",
    family: Family = "any",
    against: str | Callable[..., Any] | None = None,
    limit: Number | None = None,
    seed: int = 1,
    advance: Advance | None = None,
) -> Hunt:
    """Search bodies and starts for the motion on which an integrator is most wrong, or fails.

    Arguments:
        integrator: a name that `heavytop list` shows, a file ("mine.toml", "./mine.py:solve") or a callable.
        precision, horizon: the format, and the time up to which errors count; negative for backwards.
        budget: a number of motions, or seconds such as "60s": a number by the cost of the first 64, at least these.
        family: "any", or tops that are all "euler", "lagrange" or "kovalevskaya", or tops with a rotor,
            "heavy_gyrostat".
        against: an integrator; then the ratio to its error is searched for.
        limit: what counts as found: an error in eps T^1.5, or with ``against`` a ratio.  None for two decades beyond
            what the integrator's own law and the motion's amplification explain.
        seed: the same seed and number of motions search the same.
        advance: called with (motions done, motions in all) after each 64.

    Returns:
        A :class:`Hunt`.

    Raises:
        InputError: for an unknown integrator or family, an impossible budget, horizon, limit or seed.
    """
    which, form = named(integrator), arguments.precision(precision)
    other = None if against is None else named(against)
    registry.require(which)
    time, (motions, seconds) = physical(horizon, "horizon"), _budget(budget)
    beyond = None if limit is None else float(physical(limit, "limit"))
    pair = described(which), None if other is None else described(other)
    request = HuntRequest(pair[0], form, time, family, pair[1], beyond, motions, seconds, as_integer(seed, "seed"))
    try:
        hunted = search(request, arguments.callback(advance, "advance"))
    finally:
        close_all()
    name = integrator if isinstance(integrator, str) else request.integrator.name
    again = _again(request, name, against, hunted.planned)
    return Hunt(documents(hunted, name), hunted.motions, request.seed, hunted, again)


def _budget(value: int | str) -> tuple[int | None, float | None]:
    """(number of motions, None) or (None, seconds)."""
    if isinstance(value, int) and not isinstance(value, bool):
        return value, None
    text = value.strip() if isinstance(value, str) else ""
    if re.fullmatch(r"[0-9]{1,9}", text):
        return int(text), None
    if re.fullmatch(r"[0-9]{1,7}(\.[0-9]{1,3})?s", text) and 0 < float(text[:-1]) <= _MOST_SECONDS:
        return None, float(text[:-1])
    raise refusal("budget", "a time or a number of motions", quoted(value), _BUDGET)


def _again(request: HuntRequest, name: str, against: str | Callable[..., Any] | None, planned: int) -> str:
    """The command of the same search, with the number of motions in place of seconds."""
    parts = [f"heavytop hunt --integrator {quote(name)} --precision {request.precision.name}"]
    parts.append(f"--horizon {time_text(request.horizon)} --budget {planned} --seed {request.seed}")
    if request.family != "any":
        parts.append(f"--family {request.family}")
    if request.against is not None:
        parts.append(f"--against {quote(against if isinstance(against, str) else request.against.name)}")
    if request.limit is not None:
        parts.append(f"--limit {request.limit:.17g}")
    return " ".join(parts)
