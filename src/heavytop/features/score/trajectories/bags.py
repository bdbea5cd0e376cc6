"""ROS bags and MCAP files as tables: one topic of attitudes or angular velocities, through the package rosbags."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from heavytop.errors import InputError, quoted
from heavytop.extras import require_extra

SUFFIXES = (".mcap", ".bag", ".db3")
_NAMES = ("orientation.w", "rotation.w", "angular_velocity.x", "angular.x", "quaternion.w")
_ABOUT = "/heavytop"
"""A topic of std_msgs/String with the comments of the table, such as `mass: 2`."""


def storage(folder: Path) -> Path:
    """The file of messages in the folder of a ROS 2 bag; the folder itself where there is not one."""
    files = [path for path in folder.iterdir() if path.suffix in SUFFIXES]
    return files[0] if len(files) == 1 else folder


def of_bag(path: Path) -> str:
    """The topic of a bag as CSV, with dotted names of fields; times of the header, or of the bag where it has none.

    Raises InputError without the package rosbags, for a file that it cannot read, and unless one topic has attitudes.
    """
    with _opened(path) as reader:
        topics: dict[str, list[str]] = {}
        comments: list[str] = []
        for connection, nanoseconds, raw in reader.messages():
            if connection.topic != _ABOUT and connection.topic in topics and not topics[connection.topic]:
                continue
            message = reader.deserialize(raw, connection.msgtype)
            if connection.topic == _ABOUT:
                comments += [f"# {line}" for line in message.data.splitlines()]
                continue
            values = dict(_flat(message, ""))
            rows = topics.setdefault(connection.topic, [])
            if any(name.endswith(_NAMES) for name in values):
                if not any(name.endswith("stamp.sec") for name in values):
                    values = {"timestamp": f"{nanoseconds}e-9"} | values
                rows += [",".join(values)] * (not rows) + [",".join(values.values())]
    topics_with_rows = {topic: rows for topic, rows in topics.items() if rows}
    if len(topics_with_rows) != 1:
        names = ", ".join(topics_with_rows) or "none of " + (", ".join(topics) or "no topics")
        raise InputError(
            f"{len(topics_with_rows)} topics contain attitudes or angular velocities: {names}.",
            "Give a bag with one: rosbags-convert --src FILE --dst FILE.mcap --include-topic NAME.",
        )
    return "\n".join([*comments, *topics_with_rows.popitem()[1]])


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    require_extra("logs")
    from rosbags.highlevel import AnyReader, AnyReaderError
    from rosbags.rosbag1 import ReaderError as FirstReaderError
    from rosbags.rosbag2 import ReaderError as SecondReaderError
    from rosbags.typesys import Stores, get_typestore

    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
            yield reader
    except (AnyReaderError, FirstReaderError, SecondReaderError, ValueError, KeyError) as error:
        raise InputError(f"The bag cannot be read: {quoted(str(error))}.", "Check it with: rosbags-convert.") from None


def _flat(value: object, name: str) -> Iterator[tuple[str, str]]:
    """Names and texts of the numbers in a message; a list of one message counts as that message."""
    if is_dataclass(value):
        for part in fields(value):
            if not part.name.startswith("__"):
                yield from _flat(getattr(value, part.name), f"{name}.{part.name}".lstrip("."))
    elif isinstance(value, list) and len(value) == 1:
        yield from _flat(value[0], name)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield name, repr(value)
