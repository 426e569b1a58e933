"""Scenes: what is simulated, read from a file or a dict, checked, and handed to the simulator."""

from __future__ import annotations

import gc
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from pydantic import ValidationError

from carom import _carom, imports
from carom.errors import ABSENT, Problem, SceneError
from carom.scene import check, text
from carom.scene.fill import fill_count
from carom.scene.model import (
    LISTS,
    Body,
    Domain,
    Fill,
    Import,
    Material,
    Output,
    Pair,
    Rules,
    SceneFields,
    SolidShape,
)
from carom.scene.problems import Findings, nearest
from carom.scene.problems import Path as FieldPath
from carom.scene.shapes import Shapes
from carom.scene.spec import Roster, build_spec

__all__ = ["DEFAULT_FRAMES", "Scene"]

DEFAULT_FRAMES = 60.0
"""States recorded a second where the scene does not say."""


class Scene:
    """A checked scene: bodies, the space they are in, the materials they are made of, and the rules of impact.

    Made by :meth:`load` or :meth:`from_dict`, never changed afterwards; :meth:`changed` gives another one.
    The fields, their units and defaults are those of a scene file (``docs/reference/scene_file.md``).
    """

    def __init__(
        self, fields: SceneFields, data: Mapping[str, Any], file: str | None, folder: Path, lines: _carom.Lines | None
    ) -> None:
        # Reached by load and from_dict alone, which have checked what they pass.
        self._fields, self._data, self._lines = fields, data, lines
        self.file = file
        """The file as it was named when loading; None if the scene was made from a dict."""
        self.folder = folder
        """The folder from which the files of [[import]] and of meshes are named."""
        self._imported: list[imports.Imported] = []
        self._shapes = Shapes(folder)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Scene:
        """Read a scene file, .toml or .json.

        Raises
        ------
        SceneError
            The file cannot be read or something in it is wrong; all problems are reported together, each with its
            file, line, field and value.
        """
        file = os.fspath(path)
        with _no_collecting():
            data, lines = text.read(Path(path), file)
            return cls._checked(data, file, Path(path).parent, lines)

    @classmethod
    def from_dict(cls, fields: Mapping[str, Any], folder: str | os.PathLike[str] | None = None) -> Scene:
        """Make a scene of a mapping with the fields of a scene file; NumPy arrays and tuples will do for lists.

        Parameters
        ----------
        fields
            As in a file: ``{"duration": 2.0, "body": [{...}, ...]}``. It is copied.
        folder
            From where the files of [[import]] and of meshes are named; default: the current folder.

        Raises
        ------
        SceneError
            Something is wrong; all problems are reported together, each with its field and value.
        """
        with _no_collecting():
            return cls._checked(_plain(fields), None, Path(folder) if folder is not None else Path(), None)

    @classmethod
    def _checked(cls, data: Any, file: str | None, folder: Path, lines: _carom.Lines | None) -> Scene:
        if not isinstance(data, Mapping):
            raise SceneError([Problem(file, None, "", ABSENT, "a scene is a table of fields")])
        findings = Findings(data, file, lines.line if lines is not None else None)
        fields, places = _read_fields(data, findings)
        if fields is None:
            raise SceneError(findings.in_order())
        scene = cls(fields, data, file, folder, lines)
        boxes = any(item.box for item in fields.imports)
        check.check(fields, places, findings, domain_by_import=boxes)
        scene._read_shapes(places, findings)
        scene._read_imports(places["import"], findings)
        if not findings.problems:
            scene.roster.check(findings)
        if findings.problems:
            raise SceneError(findings.in_order())
        return scene

    def _read_shapes(self, places: dict[str, list[int]], findings: Findings) -> None:
        sections = (("body", self._fields.bodies), ("fill", self._fields.fills))
        wrong = bool(findings.problems)
        for section, items in sections:
            for item, place in zip(items, places[section], strict=True):
                path: FieldPath = (section, place, "shape")
                if item.shape is not None and not (wrong and findings.problems_under(path)):
                    self._shapes.read(item.shape, path, findings)
        if findings.problems:
            return
        for fill, place in zip(self._fields.fills, places["fill"], strict=True):
            if fill.shape is not None and not any(item.box for item in self._fields.imports):
                geometry = self._shapes.geometry(fill.shape)
                count = fill_count(fill, self._fields.domain, self.dimensions, geometry)
                check.check_count(fill, ("fill", place), count, findings)

    def _read_imports(self, places: list[int], findings: Findings) -> None:
        for item, place in zip(self._fields.imports, places, strict=True):
            path: FieldPath = ("import", place)
            if findings.problems_under(path):
                continue
            try:
                self._imported.append(imports.read_import(item, self.folder / item.file, self.dimensions))
            except imports.ImportFileError as failure:
                if failure.place is not None:
                    findings.add((*path, *failure.place), failure.reason)
                else:
                    file = self._shown_file(item)
                    findings.problems.append(Problem(file, failure.line, failure.field, failure.value, failure.reason))

    def _shown_file(self, item: Import) -> str:
        return item.file if self.file is None else os.fspath(Path(self.file).parent / item.file)

    def changed(self, changes: Mapping[str, Any]) -> Scene:
        """The same scene with other values: ``scene.changed({"duration": 3.0, "body.heavy.shape.radius": 0.2})``.

        A name leads to a field as it is written in messages: ``body[1].mass``, ``fill[0].packing``; instead of a place,
        the name of a body, material or the like will do: ``body.heavy.mass``. A value of None takes a field out.

        Raises
        ------
        SceneError
            There is nothing of such a name, or the changed scene is wrong.
        """
        data = self.to_dict()
        for name, value in changes.items():
            _change(data, name, _plain(value))
        return self.from_dict(data, self.folder)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the scene, as it was given, to a .toml or .json file.

        Raises
        ------
        SceneError
            The suffix is another, or the scene needs files that are not to be found from the new file's folder.
        """
        path = Path(path)
        imports = [(f"import[{place}].file", item.file) for place, item in enumerate(self.imports)]
        for field, file in [*imports, *(("mesh", file) for file in self._shapes.files)]:
            if not (path.parent / file).is_file():
                reason = f"is not in the folder of {path.name}; copy it there first"
                raise SceneError([Problem(os.fspath(path), None, field, file, reason)])
        writers = {".toml": text.to_toml, ".json": text.to_json}
        if path.suffix.lower() not in writers:
            raise SceneError([Problem(os.fspath(path), None, "", ABSENT, "a scene is a .toml or a .json file")])
        # Whole or not at all.
        draft = path.with_name(path.name + ".draft")
        draft.write_text(writers[path.suffix.lower()](self.to_dict()), encoding="utf-8")
        draft.replace(path)

    def to_dict(self, *, defaults: bool = False) -> dict[str, Any]:
        """The fields as they were given, a copy; with ``defaults`` also those that were left out."""
        fields = self._fields.model_dump(by_alias=True, exclude_unset=not defaults, exclude_none=True)
        if defaults and "times" not in fields["output"]:
            fields["output"].setdefault("frames", DEFAULT_FRAMES)
        return fields

    @staticmethod
    def json_schema() -> dict[str, Any]:
        """The JSON Schema of scene files: for editors that complete and check while one types."""
        schema = SceneFields.model_json_schema(by_alias=True)
        schema.pop("title", None)
        return {
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "title": "A Carom scene",
            **schema,
        }

    @property
    def title(self) -> str:
        """What the scene is about; may be empty."""
        return self._fields.title

    @property
    def duration(self) -> float:
        """For how long a run goes on, s: from ``time`` to ``time + duration``."""
        return self._fields.duration

    @property
    def time(self) -> float:
        """The clock at the start, s."""
        return self._fields.time

    @property
    def end(self) -> float:
        """The clock at the end, s."""
        return self._fields.time + self._fields.duration

    @property
    def dimensions(self) -> int:
        """3, or 2 for discs in a plane (z is 0)."""
        return self._fields.dimensions

    @property
    def gravity(self) -> list[float]:
        """Acceleration of every free body, [x, y, z] in m/s²."""
        return [*self._fields.gravity, 0.0][:3]

    @property
    def restitution(self) -> float:
        """Restitution of the pairs of materials that ``pairs`` does not list."""
        return self._fields.restitution

    @property
    def seed(self) -> int:
        """For whatever is drawn at random."""
        return self._fields.seed

    @property
    def rules(self) -> Rules:
        """What is done where the laws leave a choice."""
        return self._fields.rules

    @property
    def output(self) -> Output:
        """What a run records, as given: ``frames`` is None where it is left out and means ``DEFAULT_FRAMES``."""
        return self._fields.output

    @property
    def domain(self) -> Domain | None:
        """The space, from the scene or from an imported file; None: open space."""
        return self._fields.domain or self.roster.imported_domain

    @property
    def materials(self) -> list[Material]:
        """The materials declared under [[material]]."""
        return self._fields.materials

    @property
    def pairs(self) -> list[Pair]:
        """The pairs of materials."""
        return self._fields.pairs

    @property
    def bodies(self) -> list[Body]:
        """The bodies of [[body]], in the order of the file."""
        return self._fields.bodies

    @property
    def fills(self) -> list[Fill]:
        """The fills, in the order of the file."""
        return self._fields.fills

    @property
    def imports(self) -> list[Import]:
        """The imports, in the order of the file."""
        return self._fields.imports

    @property
    def names(self) -> dict[int, str]:
        """The names of the bodies that have one, by id."""
        pairs = zip(self.bodies, self.roster.body_ids, strict=True)
        return {number: body.name for body, number in pairs if body.name is not None}

    @property
    def imported_files(self) -> list[tuple[str, Path]]:
        """The files of [[import]] and of meshes: as the scene names them, and where they are."""
        names = [*(item.file for item in self.imports), *self._shapes.files]
        return [(name, self.folder / name) for name in names]

    @property
    def geometries(self) -> dict[int, _carom.Geometry]:
        """The geometry of every body that turns, by id; bodies that are alike share one."""
        pairs = list(zip(self.bodies, self.roster.body_ids, strict=True))
        found = {n: self._shapes.geometry(body.shape) for body, n in pairs if isinstance(body.shape, SolidShape)}
        for fill, ids in zip(self.fills, self.roster.fill_ids, strict=True):
            if fill.shape is not None:
                found |= dict.fromkeys(ids, self._shapes.geometry(fill.shape))
        return found

    @property
    def count(self) -> int:
        """The number of bodies, planes included."""
        return self.roster.count

    @property
    def notes(self) -> list[str]:
        """Remarks for the user: how finely imported files are written."""
        remarks = []
        for item, imported in zip(self.imports, self._imported, strict=True):
            if imported.rounding > 0:
                fate = "are shrunk away" if item.shrink else "are errors; shrink = true shrinks them away"
                remarks.append(
                    f"{item.file}: positions are rounded by up to {imported.rounding:.2g} m, "
                    f"so bodies that touch may overlap by up to {imported.depth:.2g} m; such overlaps {fate}"
                )
        return remarks

    @cached_property
    def roster(self) -> Roster:
        """Which body has which id, and where in the scene it comes from."""
        return Roster(self._fields, self._imported, self._shapes)

    def to_spec(self) -> dict[str, Any]:
        """The scene as the simulator takes it: numbers and arrays, ids and materials resolved."""
        with _no_collecting():
            return build_spec(self._fields, self._imported, self._shapes, self.roster)

    def engine(self) -> _carom.Engine:
        """A simulator at the start of the scene.

        Raises
        ------
        SceneError
            Bodies overlap or are outside their walls, or a fill does not fit.
        """
        try:
            return _carom.Engine(self.to_spec())
        except _carom.CheckError as error:
            self._blame(error)

    def restore(self, checkpoint: bytes) -> _carom.Engine:
        """A simulator in the state that :meth:`Engine.checkpoint` saved.

        Raises
        ------
        SceneError
            The checkpoint is damaged or belongs to another scene.
        """
        try:
            return _carom.Engine.restore(self.to_spec(), checkpoint)
        except _carom.CheckError as error:
            self._blame(error)

    def _blame(self, error: _carom.CheckError) -> NoReturn:
        """Raise what the core found as a SceneError that names file, line, field and value."""
        line = self._lines.line if self._lines is not None else None
        findings = Findings(self._data, self.file, line)
        for problem in error.problems:
            self.roster.blame(problem, findings)
        if not findings.problems:
            findings.add((), str(error))
        raise SceneError(findings.problems) from error

    def __repr__(self) -> str:
        title = f"{self.title!r}, " if self.title else ""
        return f"Scene({title}{self.count} bodies, {self.duration!r} s)"


@contextmanager
def _no_collecting() -> Iterator[None]:
    """Keep the garbage collector from looking again and again through a million new objects that all are to stay."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def _read_fields(data: Mapping[str, Any], findings: Findings) -> tuple[SceneFields | None, dict[str, list[int]]]:
    """The scene without whatever is of the wrong form (which is noted), and the places in the file of what is left."""
    places = {name: list(range(_length(data.get(name)))) for name in LISTS}
    try:
        return SceneFields.model_validate(data), places
    except ValidationError as error:
        findings.add_all(error)
        left = _without(data, [found["loc"] for found in error.errors(include_url=False)], places)
    try:
        return SceneFields.model_validate(left), places
    except ValidationError:
        # What is left still does not hold together; what is noted has to do.
        return None, places


def _length(value: object) -> int:
    return len(value) if isinstance(value, list) else 0


def _without(data: Mapping[str, Any], locations: list[FieldPath], places: dict[str, list[int]]) -> dict[str, Any]:
    """The data without the items and fields at fault, so that the rest can be checked too."""
    left = dict(data)
    dropped: dict[str, set[int]] = {}
    for location in locations:
        section = str(location[0])
        if section in places and len(location) > 1 and isinstance(location[1], int):
            dropped.setdefault(section, set()).add(location[1])
        elif section == "duration":
            left[section] = 1.0
        else:
            left.pop(section, None)
            places[section] = []
    for section, gone in dropped.items():
        if section in left:
            places[section] = [place for place in places[section] if place not in gone]
            left[section] = [data[section][place] for place in places[section]]
    return left


def _plain(value: object) -> Any:
    """A copy with NumPy's numbers and arrays, tuples and other mappings made plain."""
    kind = type(value)
    if kind is float or kind is int or kind is str:
        return value
    if isinstance(value, Mapping):
        return {str(name): _plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return os.fspath(value) if isinstance(value, Path) else value


def _change(data: dict[str, Any], name: str, value: object) -> None:
    steps = re.findall(r"[^.\[\]]+", name)
    at: Any = data
    done = ""
    for step in steps[:-1]:
        done += f".{step}" if done else step
        if isinstance(at, list):
            at = at[_place(at, step, name)]
        elif isinstance(at, dict):
            # A table that is not there yet begins empty; a list of tables has to be there.
            at = at.setdefault(step, [] if step in LISTS else {})
        else:
            raise SceneError([Problem(None, None, name, value, f"{done} is no table")])
    if not steps:
        raise SceneError([Problem(None, None, name, ABSENT, "names no field")])
    if isinstance(at, list):
        at[_place(at, steps[-1], name)] = value
    elif not isinstance(at, dict):
        raise SceneError([Problem(None, None, name, value, f"{done} is no table")])
    elif value is None:
        at.pop(steps[-1], None)
    else:
        at[steps[-1]] = value


def _place(items: list[Any], step: str, name: str) -> int:
    """The place in a list that a step means: a number, or the name of what is there."""
    if step.isdigit() and int(step) < len(items):
        return int(step)
    names = [item.get("name") if isinstance(item, dict) else None for item in items]
    if step in names:
        return names.index(step)
    known = [word for word in names if word]
    guess = nearest(step, known)
    hint = f'; the nearest is "{guess}"' if guess else f"; there are {len(items)}, counted from 0"
    raise SceneError([Problem(None, None, name, ABSENT, f"there is no {step}{hint}")])
