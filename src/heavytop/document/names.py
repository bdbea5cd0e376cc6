"""What a row is called, for people."""

from __future__ import annotations

import re
from collections.abc import Iterable
from decimal import Decimal
from fractions import Fraction

from heavytop.errors import InputError
from heavytop.measure.integrator import HEYOKA
from heavytop.precision import decimal_text, exact
from heavytop.records import Identity, Report, Row
from heavytop.top.equations import HEAVY_TOP


def computed_by(row: Row) -> str:
    """`` NAME`` of the integrator, "" for heyoka and for what is not computed: behind the case in tables."""
    subject = row.key.subject
    return f" {subject.name}" if subject.what == "computed" and subject.name != HEYOKA else ""


def row_name(row: Identity, with_kind: bool = True) -> str:
    """Its kind, case, system where it is not the heavy top, subject and format."""
    system = "" if row.system == HEAVY_TOP.name else row.system
    parts = (row.key.kind if with_kind else "", row.case, system, row.integrator, row.precision)
    return " ".join(part for part in parts if part)


def variant(row: Row, sources: Iterable[tuple[str, Report]]) -> str:
    """The integrator and what is asked of it; "" for heyoka.  Many starts are named where single ones are too."""
    subject = row.key.subject
    name = "" if subject.name == HEYOKA else subject.name
    mixed = row.starts > 1 and any(other.starts == 1 for _, report in sources for other in report.rows)
    return " ".join(part for part in (name, subject.variant, "many starts" if mixed else "") if part)


def with_source(name: str, source: str) -> str:
    """A label with the report that it is of, where there are several."""
    return f"{name}, {source}" if source else name


# Names of any origin as text that terminals, XML and pictures can show.


_NO_SHAPE = re.compile("[^\t\n\r\x20-\x7e\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def printable(text: str) -> str:
    """Text with U+FFFD for control characters other than tabs and line breaks, and for what XML 1.0 does not have."""
    return _NO_SHAPE.sub("\ufffd", text)


def short(value: str, digits: int = 3) -> str:
    """A metric's text with few digits; words stay as they are."""
    try:
        number = exact(value)
    except InputError:
        return value
    if number == 0:
        return "0"
    if Fraction(1, 1000) <= abs(number) < 10**5:
        return f"{float(number):.{digits + 2}g}"
    text = f"{Decimal(decimal_text(number, digits)):.{digits - 1}E}"
    mantissa, _, exponent = text.partition("E")
    if exact(text) == number:  # a time such as 10^6 has no more digits
        mantissa = mantissa.rstrip("0").removesuffix(".")
    return f"{mantissa}e{int(exponent)}"
