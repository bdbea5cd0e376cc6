"""Formulas of the documentation as Unicode text, for terminals."""

from __future__ import annotations

import re

_SYMBOLS = {
    r"\\(left|right|begin|end)\b(\{aligned\})?|&": "",
    r"\\[,;]|\\quad": " ",
    r"\\tfrac12": "½",
    r"\\tfrac23": "⅔",
    r" *\\times *": " × ",
    r" *\\cdot *": "·",
    r"\\approx": "≈",
    r"\\int": "∫",
    r"\\alpha": "α",
    r"\\gamma": "γ",
    r"\\varepsilon": "ε",
    r"\\theta": "θ",
    r"\\xi": "ξ",
    r"\\varphi": "φ",
    r"\\psi": "ψ",
    r"\\Omega": "Ω",
    r"\\sqrt(\d)": r"√\1",
    r"(?<=\w)\\(tanh|sin|cos)": r" \\\1",
    r"\\(tanh|sin|cos)(?=\w)": r"\1 ",
    r"\\(tanh|sin|cos)": r"\1",
    "-": "−",
}
_RAISED = str.maketrans("0123456789t", "⁰¹²³⁴⁵⁶⁷⁸⁹ᵗ")
_LOWERED = str.maketrans("0123456789+ijk", "₀₁₂₃₄₅₆₇₈₉₊ᵢⱼₖ")
_GROUP = r"\{([^{}]*)\}"
_COMMAND = re.compile(rf"\\(?:t?frac{_GROUP}|(sqrt)|(?:text|mathrm|mathrel)){_GROUP}|([\^_])(?:{_GROUP}|(\w))")


def plain_formula(tex: str) -> str:
    r"""A displayed formula as plain text: a line for each of its lines and columns (``\\``, ``\qquad``)."""
    for pattern, symbol in _SYMBOLS.items():
        tex = re.sub(pattern, symbol, re.sub(r"\\\\|\\qquad", "\n", tex))
    while _COMMAND.search(tex):  # the innermost group first
        tex = _COMMAND.sub(_plain, tex)
    lines = (" ".join(line.split()) for line in tex.splitlines())
    return "\n".join(line for line in lines if line)


def _plain(command: re.Match[str]) -> str:
    numerator, root, argument, script, group, digit = command.groups()
    if script:
        exponent, table = group or digit, _RAISED if script == "^" else _LOWERED
        return exponent.translate(table) if all(ord(char) in table for char in exponent) else f"{script}({exponent})"
    if root:
        return f"√{_grouped(argument)}"
    if numerator is None:
        return argument
    fraction = f"{numerator}/{_grouped(argument)}"
    before, after = command.string[: command.start()], command.string[command.end() :]
    return (f"({fraction})" if re.search(r"\w *$", before) else fraction) + " " * bool(re.match(r"\w", after))


def _grouped(text: str) -> str:
    return f"({text})" if re.search(r"[ ·(]", text) else text
