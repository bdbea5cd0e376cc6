"""The program's own errors.  The text of each is the cause, with the offending value, then the remedy."""

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from difflib import get_close_matches
from enum import IntEnum
from typing import Any, get_args, get_type_hints


class ExitCode(IntEnum):
    """The exit codes of the command line."""

    GOOD = 0
    FINDING = 1
    BAD_INPUT = 2
    INCOMPLETE = 3
    INTERRUPTED = 130
    READER_GONE = 141
    TERMINATED = 143


_TYPES = {
    "str": "text",
    "array": "a list",
    "object": "a table",
    "int": "an integer",
    "float": "a number",
    "bool": "true or false",
}


_WHOLE = "the file"
_options: ContextVar[Mapping[str, str]] = ContextVar("_options", default={})  # noqa: B039 - never changed in place


def argument(name: str) -> str:
    """The user's name of an argument: its own, or the corresponding option of the command line."""
    return _options.get().get(name, name)


@contextmanager
def options_named(options: Mapping[str, str]) -> Iterator[None]:
    """Make errors in this block name arguments by these options of the command line."""
    token = _options.set(options)
    try:
        yield
    finally:
        _options.reset(token)


def quoted(value: object, most: int = 60) -> str:
    """The ``repr`` of a value on one line, abridged; its type if ``repr`` fails."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # an integer of more digits than Python prints, or a foreign __repr__ that raises
        return f"<{type(value).__name__}>"
    return text if len(text) <= most else f"{text[: most - 3]}..."


def invalid(error: Exception, kind: type | None = None) -> str:
    """The fault of a value in a TOML table: its path, the required type, and its type.

    kind: the record type of the file, which defines the allowed texts of a key.
    """
    text, _, path = str(error).partition(" - at `$")
    path = path.strip("`.") or _WHOLE
    if match := re.fullmatch(r"Expected `([^`]*)`, got `(\w+)`", text):
        expected = " or ".join(_TYPES.get(name, name) for name in match[1].split(" | ") if name != "null")
        # decimals of a plan are text
        is_number = match[2] == "str" and match[1].startswith(("int", "float"))
        return f"{path} must be {expected}" + ("" if is_number else f"; got {_TYPES.get(match[2], match[2])}")
    if match := re.fullmatch(r"Expected `([^`]*)` (?:of length )?((?:[<>=]+ )?\d+)(, got \d+)?", text):
        what = "of length " if match[1] in ("array", "str") else ""
        if match[1] == "array" and (rules := _descriptions(kind, path)):
            return f"{path} must be {rules[-1]}{(match[3] or '').replace(',', ';')}"
        return f"{path} must be {_TYPES.get(match[1], match[1])} {what}{match[2]}{match[3] or ''}".replace(
            ", got", "; got"
        )
    if match := re.fullmatch(r"Object missing required field `(.*)`", text):
        return f"{path} lacks the key {match[1]}"
    if match := re.fullmatch(r"Object contains unknown field `(.*)`", text, re.DOTALL):
        records = [part for part in _parts(_hint(kind, path)) if hasattr(part, "__struct_encode_fields__")]
        near = nearest(match[1], records[0].__struct_encode_fields__) if len(records) == 1 else ""
        return f"unknown field `{quoted(match[1])[1:-1]}` in {path}" + (f"; the nearest key is {near}" if near else "")
    if text.startswith("Expected `str` matching regex"):
        return f"{path} must be {_rule(kind, path)}"
    if (match := re.fullmatch(r"Invalid enum value (.*)", text)) and (words := _words(kind, path)):
        return f"{path} must be {' or '.join(filter(None, (', '.join(words[:-1]), words[-1])))}; got {match[1]}"
    return str(error)


def _hint(kind: Any, path: str) -> Any:
    """The type of the key at ``path`` in a record; None if there is no such key."""
    for key in re.findall(r"[A-Za-z_]\w*", path.removeprefix(_WHOLE)):
        record = next((part for part in _parts(kind) if key in getattr(part, "__annotations__", {})), None)
        kind = get_type_hints(record, include_extras=True)[key] if record else None
    return kind


def _words(kind: Any, path: str) -> list[str]:
    """The allowed texts of the key at ``path`` in a record; empty if there is no such key."""
    parts = _parts(_hint(kind, path))
    return [*(["true", "false"] if bool in parts else []), *(part for part in parts if type(part) is str)]


def _rule(kind: Any, path: str) -> str:
    """The description of the pattern of the key at ``path`` in a record."""
    return next(iter(_descriptions(kind, path)), "of another form")


def _descriptions(kind: Any, path: str) -> list[str]:
    """The descriptions of the key at ``path`` in a record, the outermost last."""
    descriptions = (getattr(part, "description", None) for part in _parts(_hint(kind, path)))
    return [text for text in descriptions if isinstance(text, str)]


def _parts(kind: Any) -> list[Any]:
    """A type and its arguments, recursively: the texts of a Literal, the entries of a list."""
    return [kind, *(part for entry in get_args(kind) for part in _parts(entry))]


def why(error: Exception) -> str:
    """The reason of a failed read or write, without path and error number."""
    return getattr(error, "strerror", None) or str(error)


def nearest(name: str, known: Iterable[str], alike: float = 0.6) -> str:
    """The known name nearest to a misspelt one, or ""; alike: its least difflib ratio."""
    names = {entry.lower(): entry for entry in sorted(known)}
    return next((names[near] for near in get_close_matches(name.lower(), names, 1, alike)), "")


def meant(name: str, known: Iterable[str], alike: float = 0.6) -> str:
    """``Did you mean NAME? `` with the nearest name, to begin a remedy; "" if none is near."""
    near = nearest(name, known, alike)
    return f"Did you mean {near}? " if near else ""


class HeavyTopError(Exception):
    """A request that cannot be carried out, with its ``cause`` and a ``remedy``."""

    exit_code = ExitCode.BAD_INPUT

    def __init__(self, cause: str, remedy: str = "") -> None:
        super().__init__(f"{cause}\n  {remedy}" if remedy else cause)
        self.cause = cause
        self.remedy = remedy


class ImpossibleBody(UserWarning):
    """A body with moments of inertia that no rigid body has, although the equations have solutions."""


class InputError(HeavyTopError):
    """Bad input: a number, a top, a start, a plan, a file."""


def refusal(what: str, rule: str, value: object, remedy: str) -> InputError:
    """The error of a value that breaks a rule: ``WHAT must be RULE; got VALUE.``"""
    text = quoted(value) if isinstance(value, int) else value  # Python prints 4300 digits at most
    return InputError(f"{argument(what)} must be {rule}; got {text}.", remedy)


class MissingExtra(InputError):
    """A package of an extra is not installed; names the extra and the command that installs it."""


@contextmanager
def prefixed(what: str) -> Iterator[None]:
    """Prefix the cause of an InputError with what was read."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{what}: {error.cause}", error.remedy) from None


def require_as_many(what: str, count: int, times: int) -> None:
    """Raise InputError unless there are as many of ``what`` as times."""
    if count != times:
        raise InputError(f"times and {what} must be equally many; got {times} and {count}.", "Give one for each time.")


class NotInClass(InputError):
    """A start outside the class of motions of a closed form; names the failed exact test and by how much it failed."""


class NoSuchIntegrator(InputError):
    """No such function in a Python file, or no such program."""


class LevelNotDone(NotInClass):
    """A start on or near a degenerate level that the closed form of its class does not cover; names the level."""


class Contradiction(HeavyTopError):
    """Two sources that must agree exclude each other: one of them is wrong, and neither can be used."""

    exit_code = ExitCode.FINDING


class OutOfReach(HeavyTopError):
    """A reference that cannot be proven to the requested digits; says how many can be reached."""

    exit_code = ExitCode.INCOMPLETE


class PeerFailed(HeavyTopError):
    """A third-party integrator raised an error or broke its contract.  Its row reports this; other rows are measured.

    answered: whether it kept the protocol: it reported the failure itself, returned a state that is not finite, or
    exceeded its time limit.
    """

    exit_code = ExitCode.INCOMPLETE

    def __init__(self, cause: str, remedy: str = "", answered: bool = False) -> None:
        super().__init__(cause, remedy or "`heavytop check-integrator` tests its contract (`heavytop docs gate`).")
        self.answered = answered


class Unsupported(InputError):
    """A request beyond the declared capabilities of an integrator: a system, format, direction, events.  No failure."""


class OutOfTime(HeavyTopError):
    """A third-party integrator was stopped at the time limit of its row."""

    exit_code = ExitCode.INCOMPLETE


class NotAsked(OutOfTime):
    """A row was skipped because its third-party integrator ran out of time in others."""
