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


_options: ContextVar[Mapping[str, str]] = ContextVar("_options", default={})  # noqa: B039 - never changed in place


def argument(name: str) -> str:
    """An argument as the user wrote it: its name, or the option of the command line that gives it."""
    return _options.get().get(name, name)


@contextmanager
def options_named(options: Mapping[str, str]) -> Iterator[None]:
    """Errors in this block name arguments by these options of the command line."""
    token = _options.set(options)
    try:
        yield
    finally:
        _options.reset(token)


def quoted(value: object, most: int = 60) -> str:
    """Any value for a message: its ``repr`` on one line, cut short; what has none is named by its type."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # an integer of more digits than Python prints, or a foreign __repr__ that raises
        return f"<{type(value).__name__}>"
    return text if len(text) <= most else f"{text[: most - 3]}..."


def invalid(error: Exception, kind: type | None = None) -> str:
    """The fault of a value in a table of TOML: where it stands, what it has to be, and what it is.

    kind: the record that the file is read as, which knows the words that a key may have.
    """
    text, _, path = str(error).partition(" - at `$")
    path = path.strip("`.") or "the file"
    if match := re.fullmatch(r"Expected `([^`]*)`, got `(\w+)`", text):
        wanted = " or ".join(_TYPES.get(name, name) for name in match[1].split(" | ") if name != "null")
        # a plan has its decimals as text
        is_number = match[2] == "str" and match[1].startswith(("int", "float"))
        return f"{path} has to be {wanted}" + ("" if is_number else f", and is {_TYPES.get(match[2], match[2])}")
    if match := re.fullmatch(r"Expected `([^`]*)` (?:of length )?([<>=]+) (\d+)", text):
        what = "of length " if match[1] in ("array", "str") else ""
        return f"{path} has to be {_TYPES.get(match[1], match[1])} {what}{match[2]} {match[3]}"
    if match := re.fullmatch(r"Object missing required field `(.*)`", text):
        return f"{path} lacks the key {match[1]}"
    if match := re.fullmatch(r"Object contains (unknown field `.*`)", text):
        return f"{match[1]} in {path}"
    if (match := re.fullmatch(r"Invalid enum value (.*)", text)) and (words := _words(kind, path)):
        return f"{path} = {match[1]}: {' or '.join(filter(None, (', '.join(words[:-1]), words[-1])))}"
    return str(error)


def _words(kind: Any, path: str) -> list[str]:
    """The texts that the key at ``path`` may have in a record; none where it is not there."""
    for key in re.findall(r"[A-Za-z_]\w*", path):
        record = next((part for part in _parts(kind) if key in getattr(part, "__annotations__", {})), None)
        kind = get_type_hints(record)[key] if record else None
    return [*(["true", "false"] if bool in _parts(kind) else []), *(part for part in _parts(kind) if type(part) is str)]


def _parts(kind: Any) -> list[Any]:
    """A type and all those in it: the texts of a Literal, the entries of a list."""
    return [kind, *(part for entry in get_args(kind) for part in _parts(entry))]


def why(error: Exception) -> str:
    """The reason that a file could not be read or written, without its path and the number of the error."""
    return getattr(error, "strerror", None) or str(error)


def nearest(name: str, known: Iterable[str], alike: float = 0.6) -> str:
    """The known name nearest to a misspelt one, "" where none is; alike: the ratio of difflib that it must reach."""
    names = {entry.lower(): entry for entry in sorted(known)}
    return next((names[near] for near in get_close_matches(name.lower(), names, 1, alike)), "")


def meant(name: str, known: Iterable[str], alike: float = 0.6) -> str:
    """``Did you mean NAME? `` of the nearest name, to begin a remedy; "" where none is near."""
    near = nearest(name, known, alike)
    return f"Did you mean {near}? " if near else ""


class HeavyTopError(Exception):
    """A request that cannot be carried out: ``cause`` says what was wrong, ``remedy`` what to do about it."""

    exit_code = ExitCode.BAD_INPUT

    def __init__(self, cause: str, remedy: str = "") -> None:
        super().__init__(f"{cause}\n  {remedy}" if remedy else cause)
        self.cause = cause
        self.remedy = remedy


class ImpossibleBody(UserWarning):
    """A body whose moments of inertia no rigid body has, though the equations have solutions."""


class InputError(HeavyTopError):
    """Bad input: a number, a top, a start, a plan, a file."""


class MissingExtra(InputError):
    """A package of an extra that is not installed; names the extra and the command that installs it."""


@contextmanager
def prefixed(what: str) -> Iterator[None]:
    """Says in the cause of an InputError what was read."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{what}: {error.cause}", error.remedy) from None


class NotInClass(InputError):
    """A start outside the class of motions that a closed form covers; says which exact test failed and by how much."""


class NoSuchFunction(InputError):
    """A function that a Python file does not have."""


class LevelNotDone(NotInClass):
    """A start of a class, on or beside a degenerate level that its closed form does not cover; names the level."""


class Contradiction(HeavyTopError):
    """Two sources that must agree exclude each other: one of them is wrong, and nothing may rest on either."""

    exit_code = ExitCode.FINDING


class OutOfReach(HeavyTopError):
    """A reference that cannot be proven to the digits asked for; says how many could be reached."""

    exit_code = ExitCode.INCOMPLETE


class PeerFailed(HeavyTopError):
    """A third-party integrator that raised or broke its contract; says which and how.  Its row says so, others go on.

    answered: whether it kept the protocol: it said itself that it failed, gave a state that is not finite, or was still
    at it when its time was over.
    """

    exit_code = ExitCode.INCOMPLETE

    def __init__(self, cause: str, remedy: str = "", answered: bool = False) -> None:
        super().__init__(cause, remedy)
        self.answered = answered


class Unsupported(InputError):
    """A request that an integrator declares that it cannot do: a system, a format, a direction, events.  No failure."""


class OutOfTime(HeavyTopError):
    """A third-party integrator that was stopped at the time limit of its row."""

    exit_code = ExitCode.INCOMPLETE


class NotAsked(OutOfTime):
    """A row of a third-party integrator that ran out of time in others."""
