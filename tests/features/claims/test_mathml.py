"""Formulas typeset: read back from the MathML they are the same formula, and nothing in a text becomes markup."""

import math
import tomllib
from random import Random
from xml.etree import ElementTree

import pytest
import sympy

from claims_page import NoFormulaError, mathml, typeset
from heavytop.errors import InputError
from heavytop.features.claims.algebra.reader import parse, symbol
from heavytop.features.claims.library.entry import FOLDER

NAMES = {"Omega1": 0.37, "gamma3": -1.21, "I2": 1.9, "lambda": 0.83, "p_psi": 2.3, "wx0": 0.59, "c": -0.71, "t": 1.13}
FUNCTIONS = {"sin": math.sin, "cos": math.cos, "exp": math.exp, "arctan": math.atan, "tanh": math.tanh}
LETTERS = {"Ω": "Omega", "γ": "gamma", "λ": "lambda", "ψ": "psi"}


def value(node: ElementTree.Element) -> float:
    """The formula that a reader makes of the MathML: by the shapes alone, the program's own parser is not asked."""
    if node.tag == "mfrac":
        return value(node[0]) / value(node[1])
    if node.tag == "msup":
        return value(node[0]) ** value(node[1])
    if node.tag == "msqrt":
        return math.sqrt(line(list(node)))
    if node.tag == "mn":
        return float((node.text or "").replace("−", "-"))
    if node.tag in ("mi", "msub"):
        return NAMES[read(node)]
    assert node.tag in ("mrow", "math"), node.tag
    children = list(node)
    fenced = children and children[0].text == "(" and children[-1].text == ")"
    return line(children[1:-1] if fenced else children)


def read(node: ElementTree.Element) -> str:
    if node.tag == "mi":
        return LETTERS.get(node.text or "", node.text or "")
    below = node[1][0]
    under = "" if below.tag == "mn" else "_"
    return read(node[0]) + under + (below.text if below.tag == "mn" else read(below) or "")  # type: ignore[operator]


def line(nodes: list[ElementTree.Element]) -> float:
    """A row: signs and sums, products of what stands beside each other, functions before their arguments."""
    total, product, sign, place = 0.0, None, 1.0, 0
    while place < len(nodes):
        node = nodes[place]
        text = node.text or ""
        if node.tag == "mo" and text in "+−":
            if product is not None:
                total, product, sign = total + sign * product, None, 1.0
            sign *= -1 if text == "−" else 1
        elif node.tag == "mi" and place + 1 < len(nodes) and nodes[place + 1].text == "\u2061":
            number = FUNCTIONS[text](value(nodes[place + 2]))
            product, place = number if product is None else product * number, place + 2
        elif not (node.tag == "mspace" or (node.tag == "mo" and text in "\u2062·")):
            number = value(node)
            product = number if product is None else product * number
        place += 1
    assert product is not None
    return total + sign * product


def formula(random: Random, depth: int) -> str:
    """A formula at random, with signs and parentheses where the grammar takes them."""
    if depth == 0:
        return random.choice([*NAMES, "2", "0.25", "3e-1", "17"])
    a, b = (formula(random, depth - 1 - random.randint(0, min(1, depth - 1))) for _ in range(2))
    shapes = [
        f"{a} + {b}", f"{a} - {b}", f"({a})*({b})", f"({a})*{random.choice([*NAMES])}*({b})", f"({a})/({b} + 20)",
        f"c/I2/({b} + 30)*t*({a})", f"-({a})", f"({a})^2", f"({a})*-({b})", f"sqrt(({a})^2 + 1)", f"sin({a})^2",
        f"exp(tanh({a}))*atan({b})", f"(({a})^2 + 1)^(1/2)", f"2*3*{random.choice([*NAMES])}", f"I2^-2*({a})",
    ]  # fmt: skip
    return random.choice(shapes)


@pytest.mark.slow
def test_what_is_typeset_reads_as_the_same_formula() -> None:
    random = Random(30)
    symbols = {each: sympy.Symbol(each) for each in NAMES}
    names = {each: symbol(sign) for each, sign in symbols.items()}
    count = 0
    for _ in range(150):
        text = formula(random, random.randint(0, 4))
        try:
            parsed = parse(text, names, "x").expression
        except InputError:  # a function of too large a formula
            continue
        expected = float(parsed.subs({symbols[each]: number for each, number in NAMES.items()}))
        if not 1e-6 < abs(expected) < 1e12:
            continue
        found = value(ElementTree.fromstring(mathml(text)))
        assert math.isclose(found, expected, rel_tol=1e-6), text
        count += 1
    assert count > 80


def test_every_formula_of_the_library_is_typeset() -> None:
    texts: list[str] = []
    for path in FOLDER.glob("*.toml"):
        table = tomllib.loads(path.read_text("utf-8"))
        integral, motion = table.get("integral", {}), table.get("motion", {})
        texts += [*table.get("definitions", {}).values(), *table.get("relations", []), *integral.get("where", [])]
        texts += [integral["value"]] if integral else []
        for part in motion.values():
            texts += [text for row in part for text in ([row] if isinstance(row, str) else row)]
    assert len(texts) > 100
    for text in texts:
        ElementTree.fromstring(mathml(text))


@pytest.mark.parametrize(
    "text",
    ["", "0.45 at the witness", "a b", "(a", "a)", "a +", "<script>", "a & b", "f(", "2..3", "=", "(" * 99 + "a"],
)
def test_what_is_no_formula_stays_text(text: str) -> None:
    with pytest.raises(NoFormulaError):
        mathml(text)
    shown = typeset(text)
    assert shown.startswith("<code>")
    assert "<script" not in shown
    ElementTree.fromstring(shown)


def test_names_have_their_letters_and_indices() -> None:
    assert typeset("Omega1") == typeset("Omega_1") != typeset("Omega")
    assert "<mi>ψ</mi>" in typeset("p_psi")
    assert "<mi>mgl</mi>" in typeset("mgl")
