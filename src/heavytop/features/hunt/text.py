"""The result of a hunt, for people."""

from __future__ import annotations

import math
from collections.abc import Sequence
from textwrap import fill
from typing import Any

from heavytop.display import plural
from heavytop.features.hunt.measured import MeasuredMotion, class_of, special
from heavytop.features.hunt.search import DECADES, Hunted, Proof, digits_lost, ratio
from heavytop.integrate.registry import Integrator
from heavytop.precision import time_text

_WIDTH = 80


def hunt_text(hunted: Hunted, documents: Sequence[dict[str, Any]], again: str) -> str:
    """The findings with their tables; else the worst motions and what explains them.  again: the command."""
    lines = [_searched(hunted), ""]
    for number, (document, m, p) in enumerate(zip(documents, hunted.found, hunted.proofs, strict=True), 1):
        lines += [*_found(hunted, number, document, m, p), ""]
    if not documents:
        lines += [*_nothing(hunted), ""]
    return "\n".join([*lines, "Repeat the search with:", f"  {again}"])


def worst_lines(hunted: Hunted) -> list[str]:
    """A line for each of the worst motions whose error is explained."""
    eps = float(hunted.request.precision.eps)
    lines = []
    for m in hunted.worst:
        part = m.error / max(hunted.law * m.explained(eps), 1e-300)
        features = "; ".join([class_of(*m.motion), *special(m)])
        lines.append(
            f"{_right(m.error, eps)} digits right, {m.error / hunted.request.unit:.2g} eps T^1.5, "
            f"{part:.2g} of the expected error: {features}."
        )
    return lines


def _searched(hunted: Hunted) -> str:
    request = hunted.request
    text = f"{len(hunted.found) or 'Nothing'} found: {request.integrator.name} in {request.precision.name} "
    text += f"to T = {time_text(request.horizon)}, {plural(hunted.motions, 'motion')} tried of {hunted.planned}."
    if hunted.unknown:
        text += f" No reference was within reach for {hunted.unknown}."
    if hunted.lost:
        text += f" {plural(hunted.lost, 'motion loses', 'motions lose')} all digits in every integrator of this format."
    return fill(text, _WIDTH)


def _nothing(hunted: Hunted) -> list[str]:
    request = hunted.request
    if request.against is not None:
        beyond = f"an error {request.limit or DECADES:.3g} times that of {request.against.name}"
    elif request.limit is not None:
        beyond = f"an error of {request.limit:.3g} eps T^1.5"
    else:
        law = f"{hunted.law_text}, which bounds nine tenths of random tops"
        beyond = f"an error two decades above the expected one: {law}; A is the amplification of the motion"
    lines = [fill(f"No run failed, and none has {beyond}.", _WIDTH)]
    if hunted.worst:
        lines += ["The nearest to that:", *_folded(worst_lines(hunted))]
    return lines


def _found(hunted: Hunted, number: int, document: dict[str, Any], m: MeasuredMotion, p: Proof) -> list[str]:
    eps = float(hunted.request.precision.eps)
    if math.isinf(m.error):
        head = f"{number}. The run ends as {m.outcome}" + (f": {m.reason}" if m.reason else "")
        proof = f"The motion exists there, {p.against}."
    else:
        head = f"{number}. {_right(p.error, eps)} digits right: an error of {p.error:.3g}"
        word = "Proven" if p.proven else "Not proven"
        proof = f"{word}: compared with {p.against.removeprefix('known: ')}."
    usual = f"Random tops: {_right(hunted.median, eps)} digits right (median)."
    other = _other_error(hunted.request.other, p, eps)
    features = "; ".join([document["class"], *special(m)])
    return [
        fill(f"{head}.", _WIDTH),
        *_folded([f"{usual} {other}", f"Features: {features}.", proof]),
        "",
        document["toml"],
        "",
        "Reproduce it with:",
        f"  {document['command']}",
    ]


def _right(error: float, eps: float) -> str:
    """Correct digits, at most those of the format."""
    return f"{-math.log10(eps) - digits_lost(error, eps):z.1f}"


def _other_error(other: Integrator, p: Proof, eps: float) -> str:
    if p.other is None:
        return f"The number of digits right of {other.name} is unknown here."
    if math.isinf(p.other):
        return f"{other.name} does not reach the horizon here either."
    times = ratio(p.error, p.other, eps)
    more = "" if times is None else f"; the error is {times:g} times as large"
    return f"{other.name}: {_right(p.other, eps)} digits right here{more}."


def _folded(texts: Sequence[str]) -> list[str]:
    return [fill(text, _WIDTH, initial_indent="  ", subsequent_indent="  ", break_long_words=False) for text in texts]
