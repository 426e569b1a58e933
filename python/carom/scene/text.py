"""Scene files as text: reading TOML and JSON with the line of every value, and writing them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from carom import _carom
from carom.errors import ABSENT, Problem, SceneError
from carom.scene.model import LISTS

SUFFIXES = {".toml": _carom.parse_toml, ".json": _carom.parse_json}


def read(path: Path, file: str) -> tuple[dict[str, Any], _carom.Lines]:
    """What the file says, and the lines on which it says it.

    Raises
    ------
    SceneError
        The file cannot be read, its suffix is neither .toml nor .json, or its text is not in that language.
    """
    parse = SUFFIXES.get(path.suffix.lower())
    if parse is None:
        raise _error(file, "a scene is a .toml or a .json file")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise _error(file, f"is not UTF-8 text: byte {error.start} is {error.object[error.start]:#04x}") from None
    except FileNotFoundError:
        raise _error(file, "there is no such file") from None
    except OSError as error:
        raise _error(file, f"cannot be read: {error.strerror}") from None
    try:
        return parse(text)
    except ValueError as error:
        message, line, column = error.args
        raise _error(file, f"column {column}: {message}", line) from None


def _error(file: str, reason: str, line: int | None = None) -> SceneError:
    return SceneError([Problem(file, line, "", ABSENT, reason)])


def to_json(fields: dict[str, Any]) -> str:
    """The fields of a scene as a JSON file."""
    return json.dumps(fields, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def to_toml(fields: dict[str, Any]) -> str:
    """The fields of a scene as a TOML file: one section a table, shapes and the like on one line."""
    lines = _assignments({name: value for name, value in fields.items() if name not in LISTS and not _is_table(value)})
    for name, table in fields.items():
        if _is_table(table):
            lines += ["", f"[{name}]", *_assignments(table)]
    for name in LISTS:
        for item in fields.get(name, []):
            lines += ["", f"[[{name}]]", *_assignments(item)]
    return "\n".join(lines) + "\n"


def _is_table(value: object) -> bool:
    return isinstance(value, dict)


def _assignments(table: dict[str, Any]) -> list[str]:
    return [f"{name} = {_toml(value)}" for name, value in table.items() if value is not None]


def _toml(value: object) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case int() | float():
            return repr(value)
        case str():
            # TOML's basic strings have the escapes of JSON's; a delete character is the one that JSON leaves as it is.
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case list():
            return "[" + ", ".join(map(_toml, value)) + "]"
        case dict():
            return "{ " + ", ".join(_assignments(value)) + " }"
        case _:
            raise TypeError(f"no scene has a value like {value!r}")
