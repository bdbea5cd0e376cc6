"""The result of a hunt, for people."""

from __future__ import annotations

import math
from collections.abc import Sequence
from textwrap import fill
from typing import Any

from heavytop.features.hunt.measured import MeasuredMotion, class_of, special
from heavytop.features.hunt.search import DECADES, Hunted, Proof, digits_lost, ratio
from heavytop.integrate.registry import Integrator
from heavytop.precision import time_text

_WIDTH = 80


def hunt_text(hunted: Hunted, documents: Sequence[dict[str, Any]], again: str) -> str:
    """Each motion found with its table; else the worst and what explains it.  again: the command that searches so."""
    lines = [_searched(hunted), ""]
    for number, (document, m, p) in enumerate(zip(documents, hunted.found, hunted.proofs, strict=True), 1):
        lines += [*_found(hunted, number, document, m, p), ""]
    if not documents:
        lines += [*_nothing(hunted), ""]
    return "\n".join([*lines, "The same search again:", f"  {again}"])


def law_text(hunted: Hunted) -> str:
    """The law that explains an error of this integrator."""
    return (
        f"{hunted.law:.2g} eps times the motion's own amplification times the root of its radians, "
        "the law of nine tenths of the random tops"
    )


def worst_lines(hunted: Hunted) -> list[str]:
    """A line each of the worst motions whose error is explained."""
    eps = float(hunted.asked.precision.eps)
    lines = []
    for m in hunted.worst:
        part = m.error / max(hunted.law * m.explained(eps), 1e-300)
        about = "; ".join([class_of(*m.motion), *special(m)])
        lines.append(
            f"{_right(m.error, eps)} digits right, {m.error / hunted.asked.unit:.2g} eps T^1.5, "
            f"{part:.2g} of what is explained: {about}."
        )
    return lines


def _searched(hunted: Hunted) -> str:
    a = hunted.asked
    beyond = "" if not hunted.unknown else f" The true motion of {hunted.unknown} was out of reach."
    lost = "" if not hunted.lost else f" On {hunted.lost} no integrator of this format keeps a digit."
    return fill(
        f"{a.integrator.name} in {a.precision.name} to T = {time_text(a.horizon)}: {hunted.motions} motions tried of "
        f"{hunted.planned}.{beyond}{lost}",
        _WIDTH,
    )


def _nothing(hunted: Hunted) -> list[str]:
    asked = hunted.asked
    if asked.against is not None:
        beyond = f"an error {asked.limit or DECADES:.3g} times that of {asked.against.name}"
    elif asked.limit is not None:
        beyond = f"an error of {asked.limit:.3g} eps T^1.5"
    else:
        beyond = f"an error two decades beyond what explains it: {law_text(hunted)}"
    lines = [fill(f"Nothing was found: no run failed, and none has {beyond}.", _WIDTH)]
    if hunted.worst:
        lines += ["The worst:", *_folded(worst_lines(hunted))]
    return lines


def _found(hunted: Hunted, number: int, document: dict[str, Any], m: MeasuredMotion, p: Proof) -> list[str]:
    eps = float(hunted.asked.precision.eps)
    if math.isinf(m.error):
        head = f"{number}. The run ends as {m.outcome}" + (f": {m.said}" if m.said else "")
        proof = f"The true motion exists there, {p.against}."
    else:
        head = f"{number}. {_right(p.error, eps)} digits right: an error of {p.error:.3g}"
        word = "Proven" if p.proven else "Not proven"
        proof = f"{word}: compared with {p.against.removeprefix('known: ')}."
    usual = f"Random tops: {_right(hunted.median, eps)} digits right (median)."
    beside = f"{_beside(hunted.asked.other, p, eps)}"
    what = "; ".join([document["class"], *special(m)])
    return [
        fill(f"{head}.", _WIDTH),
        *_folded([f"{usual} {beside}", f"What is special: {what}.", proof]),
        "",
        document["toml"],
        "",
        "It shows again by:",
        f"  {document['command']}",
    ]


def _right(error: float, eps: float) -> str:
    """Digits right, at most those of the format."""
    return f"{-math.log10(eps) - digits_lost(error, eps):z.1f}"


def _beside(other: Integrator, p: Proof, eps: float) -> str:
    if p.other is None:
        return f"How many digits of {other.name} are right here is not known."
    if math.isinf(p.other):
        return f"{other.name} does not reach the horizon here either."
    times = ratio(p.error, p.other, eps)
    more = "" if times is None else f"; the error is {times:g} times as large"
    return f"{other.name}: {_right(p.other, eps)} digits right here{more}."


def _folded(texts: Sequence[str]) -> list[str]:
    return [fill(text, _WIDTH, initial_indent="  ", subsequent_indent="  ", break_long_words=False) for text in texts]
