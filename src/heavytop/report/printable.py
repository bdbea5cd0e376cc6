"""Names of any origin as text that terminals, XML and pictures can show."""

from __future__ import annotations

import re

_NO_SHAPE = re.compile("[^\t\n\r\x20-\x7e\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def printable(text: str) -> str:
    """Text with U+FFFD for control characters other than tabs and line breaks, and for what XML 1.0 does not have."""
    return _NO_SHAPE.sub("\ufffd", text)
