"""From what pydantic finds to problems in the user's words: file, line, field, value, reason."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from pydantic import ValidationError

from carom.errors import ABSENT, Problem
from carom.scene.model import LISTS, SHAPE_KINDS, TABLES, field_names, quoted

Path = tuple[str | int, ...]
"""The way to a value: ``("body", 3, "shape", "radius")``."""


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name that ``name`` was probably meant to be."""
    matches = difflib.get_close_matches(name.lower(), list(known), n=1, cutoff=0.6)
    return matches[0] if matches else None


def written(path: Path) -> str:
    """``body[3].shape.radius``."""
    text = ""
    for step in path:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else str(step)
    return text


def value_at(data: object, path: Path) -> object:
    """What the scene as given has at ``path``; ABSENT if it has nothing there."""
    for step in path:
        match data, step:
            case Mapping(), str() if step in data:
                data = data[step]
            case list(), int() if step < len(data):
                data = data[step]
            case _:
                return ABSENT
    return data


class Findings:
    """The problems of one scene, collected one by one."""

    def __init__(self, data: Mapping[str, Any], file: str | None, line: Callable[[Path], int] | None) -> None:
        self.data, self.file, self.problems = data, file, list[Problem]()
        self._line = line
        self._paths = set[Path]()

    def add(self, path: Path, reason: str, value: object = None, *, again: bool = False) -> None:
        """Note a problem with the value at ``path``; ``value`` if another than the one there is to be shown.

        One problem a value is enough, unless it is noted ``again`` (a ball may overlap several).
        """
        if path in self._paths and not again:
            return
        self._paths.add(path)
        shown = ABSENT if not path else value_at(self.data, path) if value is None else value
        line = self._line(path) if self._line is not None else None
        self.problems.append(Problem(self.file, line, written(path), shown, reason, self._who(path)))

    def _who(self, path: Path) -> str:
        if len(path) < 2 or path[0] != "body":
            return ""
        name, number = value_at(self.data, (*path[:2], "name")), value_at(self.data, (*path[:2], "id"))
        words = [str(number)] if type(number) is int and path[2:] != ("id",) else []
        words += [f'"{name}"'] if isinstance(name, str) and name and path[2:] != ("name",) else []
        return " ".join(["body", *words]) if words else ""

    def add_all(self, error: ValidationError) -> None:
        """Note everything that pydantic found."""
        for found in error.errors(include_url=False, include_context=False, include_input=False):
            self._add_found(found["type"], found["loc"], found["msg"])

    def _add_found(self, kind: str, location: Path, message: str) -> None:
        table, path = _table_and_path(location)
        match kind:
            case "missing":
                self.add(path, "is missing")
            case "extra_forbidden":
                self.add(path, _unknown(str(path[-1]), table))
            case "reason":
                self.add(path, message)
            case "kind" | "union_tag_invalid" | "union_tag_not_found":
                self._add_kind(path, message if kind == "kind" else self._shape_reason(path, table[0]))
            case "too_short" if path[-1:] == ("parts",):
                self.add(path, "must be at least one part")
            case "list_type" if path[-1:] == ("parts",):
                self.add(path, "must be a list of parts, [{ shape = {...}, position = [x, y, z] }, ...]")
            case "list_type" if path[-1] in LISTS:
                self.add(path, f"must be a list of tables: [[{path[-1]}]] with two brackets")
            case _ if path[-1:] == ("shape",):
                example = 'kind = "cube", edge = 1.0' if table[:1] == ("fill",) else 'kind = "ball", radius = 0.5'
                self.add(path, f"must be a table, for example {{ {example} }}")
            case _:
                self.add(path, "must be a table of fields")

    def _add_kind(self, path: Path, reason: str) -> None:
        path = (*path, "kind")
        missing = value_at(self.data, path) is ABSENT
        self.add(path, f"is missing: {reason}" if missing else reason)

    def _shape_reason(self, path: Path, owner: str) -> str:
        """What is wrong with the kind of a shape; ``owner``: "body", "fill" or "part"."""
        kinds = SHAPE_KINDS[owner]
        given = value_at(self.data, (*path, "kind"))
        reason = f"must be {quoted(kinds)}"
        if owner == "fill" and given == "ball":
            return "a fill of balls has no shape but a radius, for example radius = 0.5"
        if owner == "part" and given == "compound":
            return "a part of a compound is convex: list the parts of this one instead"
        guess = nearest(given, kinds) if isinstance(given, str) else None
        return reason if guess is None else f'{reason}; the nearest is "{guess}"'

    def problems_under(self, path: Path) -> bool:
        """Whether anything is wrong at ``path`` or below."""
        return any(found[: len(path)] == path for found in self._paths)

    def problems_in(self, section: str) -> bool:
        """Whether anything is wrong in a section of the scene."""
        return any(found[:1] == (section,) for found in self._paths)

    def in_order(self) -> list[Problem]:
        """All problems, by line where lines are known."""
        return sorted(self.problems, key=lambda problem: problem.line or 0)


def _table_and_path(location: Path) -> tuple[tuple[str, ...], Path]:
    """The table (a key of TABLES) in which the last step of a location is, and the location without pydantic's tags."""
    table: list[str] = []
    path: list[str | int] = []
    tag_next = False
    for place, step in enumerate(location):
        if tag_next:
            table.append(str(step))
            tag_next = False
            continue
        path.append(step)
        last = place == len(location) - 1
        if isinstance(step, str) and not last:
            table.append(step)
        tag_next = step == "shape" or (table[:1], step) == (["fill"], "radius")
    if "parts" in table:
        table = ["part", *table[table.index("parts") + 1 :]]
    return tuple(table), tuple(path)


def _unknown(name: str, table: tuple[str, ...]) -> str:
    """What to say of a field that a table does not have."""
    known = field_names(TABLES[table])
    guess = nearest(name, known)
    owners = [place for place, model in TABLES.items() if place != table and name in field_names(model)]
    # What is not a part's own is probably the body's that the part is of.
    nearby = [place for place in owners if place[:1] == table[:1]]
    nearby = nearby or [place for place in owners if table[:1] == ("part",) and place == ("body",)]
    if nearby or (owners and (guess is None or _likeness(name, guess) < LIKE)):
        places = dict.fromkeys(_where(owner, table) for owner in nearby or owners)
        return f"unknown field here; it belongs {' or '.join(places)}"
    if guess is not None:
        return f'unknown field; the nearest is "{guess}"'
    return f"unknown field; the fields here are {', '.join(known)}"


LIKE = 0.7
"""A name less like its nearest neighbour than this, and known elsewhere, is misplaced and not misspelt."""


def _likeness(left: str, right: str) -> float:
    return difflib.SequenceMatcher(None, left, right).ratio()


def _where(table: tuple[str, ...], seen_from: tuple[str, ...]) -> str:
    match table:
        case ():
            return "at the top of the file"
        case ("part",):
            return "in a part"
        case (section,):
            return f"in [[{section}]]" if section in LISTS else f"in [{section}]"
        case (_, _, kind) if seen_from[:2] == table[:2]:
            return f'to the kind "{kind}"'
        case ("part", inner, *_):
            return f"in {inner} of a part"
        case _:
            # The tables inside tables are shapes, radii and columns, all of them in lists.
            return f"in {''.join(table[1:2])} of [[{''.join(table[:1])}]]"
