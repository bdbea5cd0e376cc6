"""The library of claims as a page of the site: formulas typeset, verdict, conditions, witness and source of each.

Text in, Markdown out: :func:`page` of a :class:`claim_library.Library`.  What stands in an entry is
shown as it was written; nothing in it is read as markup.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from claim_library import Equation, Library, Published
from heavytop.features.claims.algebra.reader import NUMBER, Descent
from heavytop.features.claims.audit.values import SIZES

# Formulas of claims as MathML, as they are written: no term is moved, nothing is put together.
#
# Browsers show MathML by themselves: a page needs no script and fetches nothing.


_NAME = re.compile(r"([A-Za-z]+?)_?(\d*)('*)")
_LETTERS = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau phi chi psi omega "
    "Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega"
)
_GREEK = dict(zip(_LETTERS.split(), "αβγδεζηθικλμνξπρστφχψωΓΔΘΛΞΠΣΦΨΩ", strict=True))
_FUNCTIONS = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2"}
_TIMES, _SPACE = "<mo>&#x2062;</mo>", '<mspace width="0.17em"/>'


class NoFormulaError(ValueError):
    """Text that is no formula, such as a residual in words."""


def mathml(text: str) -> str:
    """A formula, or several joined by "=", as a `<math>` element; raises :class:`NoFormulaError` for other text."""
    sides = [_Writer(side).whole() for side in text.split("=")]
    return f"<math><mrow>{'<mo>=</mo>'.join(sides)}</mrow></math>"


def typeset(text: str) -> str:
    """The formula as MathML, or text that is none as code."""
    try:
        return mathml(text)
    except NoFormulaError:
        return f"<code>{escape(text)}</code>"


def name(text: str) -> str:
    """A name as MathML: Greek letters by their names, digits at the end and what follows _ below the line."""
    stem, _, below = text.partition("_")
    match = _NAME.fullmatch(stem)
    if match is None:
        return f"<mi>{escape(text)}</mi>"
    letters, digits, primes = match.groups()
    base = f"<mi>{_GREEK.get(letters, letters)}</mi>"
    if primes:
        base = f"<msup>{base}<mo>{'′' * len(primes)}</mo></msup>"
    parts = [f"<mn>{digits}</mn>"] * bool(digits)
    if below:
        parts.append(f"<mn>{below}</mn>" if below.isdigit() else name(below))
    return f"<msub>{base}<mrow>{'<mo>,</mo>'.join(parts)}</mrow></msub>" if parts else base


class _Writer(Descent):
    """Each method returns MathML; names may have primes, and any name may be that of a function."""

    token = re.compile(rf"\s*(?:{NUMBER}|[A-Za-z]\w*'*|\*\*|[-+*/^(),])", re.ASCII)
    deepest = 80

    def whole(self) -> str:
        """All of the text."""
        found = self._sum()
        self.end()
        return found

    def _error(self, what: str) -> NoFormulaError:
        return NoFormulaError(what)

    def _sum(self) -> str:
        with self._deeper("parentheses"):
            found = self._term()
            while sign := self._take("+", "-"):
                found += ("<mo>+</mo>" if sign == "+" else "<mo>−</mo>") + self._term()
        return found

    def _term(self) -> str:
        """Factors beside each other; what is divided stands above the line, with all that stands before it."""
        signs = ""
        while sign := self._take("+", "-"):
            signs += "<mo>−</mo>" if sign == "-" else "<mo>+</mo>"
        done, factors = "", [self._power()]
        while operator := self._take("*", "/"):
            factor = self._signed_power()
            if operator == "*":
                factors.append(factor)
                continue
            above = [*([(done, False)] if done else []), *factors]
            over = above[0][0] if len(above) == 1 else _product(above)
            done, factors = f"<mfrac><mrow>{over}</mrow><mrow>{factor[0]}</mrow></mfrac>", []
        return signs + _product([*([(done, False)] if done else []), *factors])

    def _signed_power(self) -> tuple[str, bool]:
        if not self._take("-"):
            return self._power()
        inside, compound = self._signed_power()
        return f"<mo>−</mo>{_fenced(inside) if compound else inside}", True

    def _power(self) -> tuple[str, bool]:
        """(MathML, whether it is a sum in parentheses)."""
        base, compound = self._atom()
        if not self._take("^", "**"):
            return base, compound
        with self._deeper("powers"):
            above, _ = self._signed_power()
        return f"<msup><mrow>{_fenced(base) if compound else base}</mrow><mrow>{above}</mrow></msup>", False

    def _atom(self) -> tuple[str, bool]:
        token = self._next()
        self._position += 1
        if token == "(":
            inside = self._sum()
            self._require(")")
            return inside, True
        if token[:1].isdigit() or token[:1] == ".":
            return _number(token), False
        if not token[:1].isalpha():
            raise NoFormulaError(token)
        return (self._function(token) if self._next() == "(" else name(token)), False

    def _function(self, token: str) -> str:
        inside = "<mo>,</mo>".join(self._arguments(self._sum))
        if token == "sqrt":
            return f"<msqrt>{inside}</msqrt>"
        return f"<mi>{_FUNCTIONS.get(token, token)}</mi><mo>&#x2061;</mo>{_fenced(inside)}"


def _number(token: str) -> str:
    mantissa, mark, power = token.lower().partition("e")
    if not mark:
        return f"<mn>{mantissa}</mn>"
    above = power.lstrip("+").replace("-", "−")
    return f"<mn>{mantissa}</mn><mo>·</mo><msup><mn>10</mn><mn>{above}</mn></msup>"


def _product(factors: list[tuple[str, bool]]) -> str:
    """The factors beside each other; sums in parentheses where there is more than one."""
    if len(factors) == 1:
        return _fenced(factors[0][0]) if factors[0][1] else factors[0][0]
    parts = [_fenced(text) if compound else text for text, compound in factors]
    found = parts[0]
    for part in parts[1:]:
        # 2 3 would be read as 23
        found += ("<mo>·</mo>" if part.startswith("<mn>") else _TIMES + _SPACE) + part
    return found


def _fenced(inside: str) -> str:
    return f"<mrow><mo>(</mo>{inside}<mo>)</mo></mrow>"


_HEADS = {"refuted": "Refuted", "holds": "Proven", "undecided": "Undecided"}
_SAID = {
    "motion": "Claimed: a motion",
    "component": "Claimed: a component of a motion",
    "integral": "Claimed: constant",
    "relation": "Claimed: stays 0 where it is 0",
    "stability": "Claimed: stable",
    "unstable": "Claimed: unstable",
    "value": "Claimed: numbers",
}
_MARKDOWN = re.compile(r"([\\`*_{}\[\]<>()#+!|$~-])")


def page(library: Library) -> str:
    """The page, in Markdown without its first heading: a table of all claims, then each under its verdict."""
    by_id = {each.entry.id: each for each in library.claims}
    corrected = {wrong: each.entry.id for each in library.claims for wrong in each.entry.corrected}
    parts = [_summary(library), _index(library.claims)]
    for verdict, head in _HEADS.items():
        found = [each for each in library.claims if each.verdict == verdict]
        if found:
            parts.append(f"## {head}")
            parts += [_entry(each, by_id, corrected.get(each.entry.id)) for each in found]
    return "\n\n".join(parts) + "\n"


def _summary(library: Library) -> str:
    counts = {verdict: sum(each.verdict == verdict for each in library.claims) for verdict in _HEADS}
    said = f"{counts['holds']} proven, {counts['refuted']} refuted"
    return f"{len(library.claims)} claims: {said}" + (
        f", {counts['undecided']} undecided." if counts["undecided"] else "."
    )


def _index(claims: Iterable[Published]) -> str:
    rows = ["| claim | year | about | verdict |", "|---|---|---|---|"]
    for each in claims:
        title = f"[{_plain(each.entry.title)}](#{each.entry.id})"
        rows.append(f"| {title} | {each.entry.source.year} | {_plain(each.system or '?')} | {each.verdict} |")
    return "\n".join(rows)


def _entry(published: Published, by_id: Mapping[str, Published], right: str | None) -> str:
    entry = published.entry
    beside = [f"The right form: [{_plain(by_id[right].entry.title)}](#{right})."] if right is not None else []
    beside += [
        f"Corrects [{_plain(by_id[wrong].entry.title)}](#{wrong})." for wrong in entry.corrected if wrong in by_id
    ]
    source = _plain(entry.source.text.removesuffix(f", doi:{entry.source.doi}"))
    if entry.source.doi:
        source += f", [doi:{_plain(entry.source.doi)}](<https://doi.org/{_address(entry.source.doi)}>)"
    parts = [
        f"({entry.id})=\n### {_plain(entry.title)}",
        f"**{published.verdict}** · `{entry.id}` · {_plain(published.system or '?')}",
        source + ".",
        f"Read: {_plain(entry.read)}; {_plain(entry.status)}.",
        _plain(" ".join(entry.note.split())),
        _claim(published),
        _verdicts(published),
        " ".join(beside),
    ]
    return "\n\n".join(part for part in parts if part)


def _claim(published: Published) -> str:
    """What is claimed, as its file has it: the body, the names, the formulas."""
    claim, kind = published.claim, published.kind
    lines = [_body(claim)]
    lines += [_equal(name(key), text) for key, text in claim.get("definitions", {}).items()]
    lines += [_equal(None, f"{text}", "0") for text in claim.get("relations", [])]
    if claim.get("assume"):
        lines.append("<p>assumed: " + ", ".join(_comparison(text) for text in claim["assume"]) + "</p>")
    lines.append(f"<p>{_SAID.get('unstable' if claim.get('stable') is False else kind, kind)}</p>")
    if kind in ("motion", "stability"):
        lines += _motion(claim.get("motion", {}))
    elif kind == "value":
        lines.append(_start(claim.get("start", {})))
    elif kind == "component":
        lines.append(_start(claim.get("start", {})))
        lines += _component(claim["component"], claim.get("quadrature", {}))
    elif integral := claim.get("integral"):
        lines.append(_equal(None, integral["value"], "0" if kind == "relation" else ""))
        where = [typeset(text) for text in integral.get("where", [])]
        lines += [f"<p>where {part} = 0</p>" for part in where]
    return _html(lines)


def _body(claim: Mapping[str, Any]) -> str:
    table = claim.get("top") or claim.get("body") or {}
    names = {"inertia": "I", "weight": "P", "centre": "r", "rotor": "k", "mass": "m", "gravity": "g"}
    given = {letter: _listed(table[key]) for key, letter in names.items() if key in table}
    said = [f"{_italic(letter)} = {value}" for letter, value in given.items() if value != typeset(letter)]
    about = f", inertia about the {escape(table['about'])}" if "about" in table else ""
    return f"<p>Body: {', '.join(said)}{about}</p>"


def _start(table: Mapping[str, Any]) -> str:
    letters = {"omega": "Omega", "omega_space": "Omega_space", "gamma": "gamma", "quaternion": "q", "matrix": "R"}
    said = [
        f"<math>{name(letters[key])}</math>(0) = {_listed(value)}"
        if key in letters
        else f"{escape(key.replace('_', ' '))} {escape(str(value))}"
        for key, value in table.items()
    ]
    return f"<p>Start: {', '.join(said)}</p>"


def _motion(table: Mapping[str, Sequence[str]]) -> list[str]:
    lines = []
    for key, letters in (
        ("omega", ("Omega1", "Omega2", "Omega3")),
        ("gamma", ("gamma1", "gamma2", "gamma3")),
        ("angles", ("phi", "theta", "psi")),
    ):
        lines += [_equal(name(letter), text) for letter, text in zip(letters, table.get(key, ()), strict=False)]
    return lines


def _component(table: Mapping[str, Any], quadrature: Mapping[str, Any]) -> list[str]:
    u = quadrature.get("variable", "u")
    texts = {u: table["quantity"], f"{u}'^2": table.get("reduced"), f"{u}(t)": table.get("value")}
    angles = [angle for angle in ("phi", "theta", "psi") if angle in quadrature]
    texts |= {f"d{u}/dt": f"1/({quadrature['integrand']})"} if "integrand" in quadrature else {}
    texts |= {f"{angle}'": quadrature[angle] for angle in angles} | {angle: table.get(angle) for angle in angles}
    given = [f"<p>{escape(left)} = {typeset(text)}</p>" for left, text in texts.items() if text is not None]
    return given + [f"<p>where {typeset(text)} = 0</p>" for text in table.get("where", [])]


def _verdicts(published: Published) -> str:
    if published.reason:
        return f"No verdict: {_plain(published.reason)}"
    if published.kind == "value":
        return _html([_numbers(published.equations)])
    lines = []
    for row in published.equations:
        if row.holds is not True:
            word = "refuted" if row.holds is False else "undecided"
            lines.append(f"<p>{_numbered(row)}: {word}, residual {typeset(row.residual)}</p>")
            if row.witness is not None:
                lines.append(f"<p>Witness: {_witness(row.witness)}</p>")
    held = sum(row.holds is True for row in published.equations)
    if held:
        lines.append(f"<p>{held} of {len(published.equations)} equations proven</p>")
    conditions = {
        (c["text"], c["discharged"], c["reason"]): None
        for row in published.equations
        if row.holds is not False
        for c in row.conditions
    }
    if conditions:
        items = "".join(
            f"<li>{escape(text)}: {'discharged' if done else '<strong>not discharged</strong>'}, {escape(reason)}</li>"
            for text, done, reason in conditions
        )
        lines.append(f"<details><summary>Conditions of the proofs</summary><ul>{items}</ul></details>")
    return _html(lines)


def _numbers(rows: Sequence[Equation]) -> str:
    cells = ("number", "t", "printed", "digits right", "proven", "verdict")
    head = "".join(f"<th>{cell}</th>" for cell in cells)
    lines = []
    for row in rows:
        label = f"{row.equation} {row.component}" if row.equation in SIZES else row.equation
        right = "?" if row.digits_right is None else f"{row.digits_right} of {row.digits_printed}"
        proven = "?" if row.proven is None else row.proven["value"]
        verdict = {True: "holds", False: "refuted", None: "undecided"}[row.holds]
        texts = (label, row.domain.removeprefix("t="), row.printed or "", right, proven, verdict)
        lines.append("<tr>" + "".join(f"<td>{escape(text)}</td>" for text in texts) + "</tr>")
    return (
        f'<div class="table-wrapper"><table class="docutils"><thead><tr>{head}</tr></thead>'
        f"<tbody>{''.join(lines)}</tbody></table></div>"
    )


def _numbered(row: Equation) -> str:
    if row.equation[:1].isdigit():
        return f"({escape(row.equation)}) {row.component}"
    return typeset(row.equation) if row.component == 1 else f"{typeset(row.equation)} {row.component}"


def _witness(witness: Mapping[str, Any]) -> str:
    place = {**witness.get("parameters", {}), **({"t": witness["t"]} if "t" in witness else {})}
    said = ", ".join(f"<math>{name(key)}</math> = {escape(str(value))}" for key, value in place.items())
    ball = f"{escape(witness['value'])} ± {escape(witness['radius'])} " if "value" in witness else ""
    return f"{ball}at {said}"


def _equal(left: str | None, text: str, right: str = "") -> str:
    """A line of its own: left = formula, formula = right, or the formula alone."""
    try:
        inside = mathml(text).removeprefix("<math>").removesuffix("</math>")
    except NoFormulaError:
        return f"<p><code>{escape(text)}</code></p>"
    before = f"{left}<mo>=</mo>" if left else ""
    after = f"<mo>=</mo><mn>{right}</mn>" if right else ""
    return f'<math display="block"><mrow>{before}{inside}{after}</mrow></math>'


def _comparison(text: str) -> str:
    parts = re.split(r"(<|>|!=)", text)
    return " ".join({"<": "&lt;", ">": "&gt;", "!=": "≠"}.get(part) or typeset(part) for part in parts)


def _italic(letter: str) -> str:
    return f"<math>{name(letter)}</math>"


def _listed(value: Any) -> str:
    if isinstance(value, list):
        return f"({', '.join(_listed(part) for part in value)})"
    return typeset(str(value))


def _html(lines: Iterable[str]) -> str:
    """Lines of HTML that Markdown leaves as they are: it ends at a blank line."""
    return '<div class="claim">\n' + "\n".join(line for line in lines if line) + "\n</div>"


def _plain(text: str) -> str:
    """Text that Markdown shows as it is."""
    return _MARKDOWN.sub(r"\\\1", " ".join(text.split()))


def _address(doi: str) -> str:
    return re.sub(r"[<>\s\\]", "", doi)
