"""Bodies from files that other programs wrote: extended XYZ (ASE, OVITO), GSD (HOOMD-blue, freud) and CSV.

Each format has a reader that knows its columns, where a row stands in the file and how finely the file's numbers are
written; `read_import` makes balls of the columns, the same way for all formats.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pyarrow

from carom.errors import ABSENT
from carom.scene.model import LARGEST_ID, Import, quoted
from carom.scene.problems import nearest

__all__ = ["Box", "ImportFileError", "Imported", "read_import"]

Floats = NDArray[np.float64]

FORMATS: Final = {".xyz": "xyz", ".extxyz": "xyz", ".gsd": "gsd", ".csv": "csv"}

USUAL_NAMES: Final[dict[str, tuple[str | tuple[str, ...], ...]]] = {
    "position": ("position", "positions", "pos", ("x", "y", "z"), ("x", "y")),
    "velocity": ("velocity", "velocities", "vel", "velo", ("vx", "vy", "vz"), ("vx", "vy")),
    "momentum": ("momentum", "momenta", ("px", "py", "pz")),
    "radius": ("radius", "radii", "r"),
    "diameter": ("diameter", "diameters", "d"),
    "mass": ("mass", "masses", "m"),
}
"""What columns are called where the scene does not say: the first that the file has."""

EXACT_DIGITS: Final = 4
"""Numbers written with fewer digits than this were set by hand and are taken as exact."""

DOUBLE_DIGITS: Final = 16
"""Numbers written with this many digits or more are doubles written in full."""

DIGITS_SAMPLED: Final = 1000
"""So many rows show how many digits a file writes."""


class ImportFileError(Exception):
    """An imported file cannot be used.

    ``place`` is the field of the [[import]] that is to blame, or None if it is the file's own ``field`` in ``line``.
    """

    def __init__(
        self,
        reason: str,
        place: tuple[str, ...] | None = None,
        field: str = "",
        value: object = ABSENT,
        line: int | None = None,
    ) -> None:
        super().__init__(reason)
        self.reason, self.place, self.field, self.value, self.line = reason, place, field, value, line


@dataclass(frozen=True)
class Box:
    """The box of a file: lengths in m, its middle in the coordinates of the file, and which axes are periodic."""

    size: Floats
    middle: Floats
    periodic: tuple[bool, bool, bool]
    rounding: float


TILTED: Final = Box(np.full(3, np.nan), np.zeros(3), (True, True, True), 0.0)
"""A box whose edges are not along the axes; only a scene that wants the box minds."""


@dataclass
class Imported:
    """The balls of one file, one row a ball, in the order of the file.

    ``position`` and ``velocity`` are (n, 3) in m and m/s, in the scene's coordinates; ``radius`` (n,) m, ``mass``
    (n,) kg, ``id`` (n,) or None. ``rounding`` is the largest error of a position in m, ``depth`` the deepest overlap
    of two balls in m that the file's rounding alone can explain. ``lines`` tells the line of a row, if there are lines.
    """

    position: Floats
    velocity: Floats
    radius: Floats
    mass: Floats
    id: NDArray[np.int64] | None
    box: Box | None
    rounding: float
    depth: float
    source: Source = field(repr=False)


class Source(Protocol):
    """One frame of a file: its columns and their widths, and whatever else it tells about them."""

    count: int
    columns: dict[str, int]
    box: Box | None

    def read(self, names: Sequence[str]) -> dict[str, Floats]:
        """The columns named, each (count, width)."""
        ...

    def line(self, row: int) -> int | None:
        """The line of a row, counted from 1."""
        ...

    def rounding(self, name: str, largest: float) -> float:
        """The largest error that writing ``name`` made, in its own unit, where its largest value is ``largest``."""
        ...


def read_import(item: Import, path: Path, dimensions: int) -> Imported:
    """Read the balls that an [[import]] asks for.

    Parameters
    ----------
    item
        The table of the scene.
    path
        Where its file is.
    dimensions
        Of the scene; with 2, every z must be 0 and ``density`` is a mass per area.

    Raises
    ------
    ImportFileError
        The file is missing, damaged, or has not what is needed.
    """
    kind = item.format or FORMATS.get(path.suffix.lower())
    if kind is None:
        raise ImportFileError(f"has no known suffix ({', '.join(FORMATS)}): give format", ("file",))
    if not path.is_file():
        raise ImportFileError("there is no such file", ("file",))
    source: Source
    try:
        source = {"xyz": XyzSource, "gsd": GsdSource, "csv": CsvSource}[kind](path, item.frame)
    except OSError as error:
        raise ImportFileError(f"cannot be read: {error.strerror or error}", ("file",)) from None
    return _balls(item, source, dimensions)


def _balls(item: Import, source: Source, dimensions: int) -> Imported:
    chosen = {name: _columns_for(name, item, source) for name in (*USUAL_NAMES, "id")}
    if item.radius is not None:
        chosen["radius"] = chosen["diameter"] = None
    if item.velocity is not None:
        chosen["velocity"] = chosen["momentum"] = None
    elif chosen["velocity"] is not None:
        chosen["momentum"] = None
    if (item.mass is not None or item.density is not None) and chosen["momentum"] is None:
        chosen["mass"] = None
    if chosen["radius"] is not None:
        chosen["diameter"] = None
    _require(item, chosen, source)
    columns = _Columns(source, chosen, dimensions)
    position = columns.vector("position")
    radius = np.full(source.count, item.radius) if item.radius is not None else columns.radius()
    mass = _masses(item, columns, radius, dimensions)
    velocity = np.zeros((source.count, 3))
    if item.velocity is not None:
        velocity[:, : len(item.velocity)] = item.velocity
    elif chosen["velocity"] is not None:
        velocity = columns.vector("velocity")
    elif chosen["momentum"] is not None:
        velocity = columns.vector("momentum") / (columns.positive("mass") if chosen["mass"] else mass)[:, None]
    position_error = columns.rounding("position")
    radius_error = 0.0 if item.radius is not None else columns.rounding("radius")
    box_error = source.box.rounding if item.box and source.box is not None else 0.0
    position = position - _origin(item, source)
    if item.box:
        position = _wrapped(position, _box(source))
    return Imported(
        position=position,
        velocity=velocity,
        radius=radius,
        mass=mass,
        id=columns.ids() if chosen["id"] else None,
        box=_box(source) if item.box else None,
        rounding=position_error,
        # Two positions are each off by a diagonal of errors, two radii each by their own, the box by one diagonal.
        depth=math.sqrt(dimensions) * (2 * position_error + box_error) + 2 * radius_error,
        source=source,
    )


def _columns_for(name: str, item: Import, source: Source) -> list[str] | None:
    """The columns that hold a quantity: those that the scene names, or the first of the usual names that there are."""
    named = getattr(item.columns, name)
    if named is not None:
        for column in [named] if isinstance(named, str) else named:
            if column not in source.columns:
                guess = nearest(column, source.columns)
                hint = f'; the nearest is "{guess}"' if guess else f"; it has {', '.join(source.columns)}"
                raise ImportFileError(f"{item.file} has no column {quoted([column])}{hint}", ("columns", name))
        return [named] if isinstance(named, str) else list(named)
    for usual in USUAL_NAMES.get(name, ()):
        parts = [usual] if isinstance(usual, str) else list(usual)
        if all(part in source.columns for part in parts):
            return parts
    return None


def _require(item: Import, chosen: dict[str, list[str] | None], source: Source) -> None:
    has = f"{item.file} has the columns {', '.join(source.columns)}"
    if chosen["position"] is None:
        raise ImportFileError(f"is missing: {has}", ("columns", "position"))
    if item.radius is None and chosen["radius"] is None and chosen["diameter"] is None:
        raise ImportFileError(f"is missing: {has}; give radius, or columns.radius or columns.diameter", ("radius",))
    if item.mass is None and item.density is None and chosen["mass"] is None:
        raise ImportFileError(f"is missing: {has}; give mass, density or columns.mass", ("mass",))


def _masses(item: Import, columns: _Columns, radius: Floats, dimensions: int) -> Floats:
    if item.mass is not None:
        return np.full(len(radius), item.mass)
    if item.density is not None:
        volume = math.pi * radius * radius if dimensions == 2 else 4 / 3 * math.pi * radius * radius * radius
        return item.density * volume
    return columns.positive("mass")


def _origin(item: Import, source: Source) -> Floats:
    if item.origin is not None:
        return np.array([*item.origin, 0.0][:3])
    return _box(source).middle if item.box else np.zeros(3)


def _box(source: Source) -> Box:
    if source.box is None:
        raise ImportFileError("the file has no box", ("box",))
    if np.isnan(source.box.size).any():
        raise ImportFileError("the file's box is tilted; its edges must be along x, y and z", ("box",))
    return source.box


def _wrapped(position: Floats, box: Box) -> Floats:
    """Positions brought back into the box along its periodic axes; those that are inside stay what they are."""
    wrapped = position.copy()
    for axis in range(3):
        if box.periodic[axis]:
            turns = np.floor(position[:, axis] / box.size[axis] + 0.5)
            half = box.size[axis] / 2
            # Many turns leave a rounding error of their own.
            wrapped[:, axis] = np.clip(position[:, axis] - turns * box.size[axis], -half, half)
    return wrapped


class _Columns:
    """The columns chosen for each quantity, read once and checked."""

    def __init__(self, source: Source, chosen: dict[str, list[str] | None], dimensions: int) -> None:
        self._source, self._chosen, self._dimensions = source, chosen, dimensions
        self._names = {name: columns for name, columns in chosen.items() if columns is not None}
        self._data = source.read(list(dict.fromkeys(column for columns in self._names.values() for column in columns)))

    def _raw(self, name: str) -> Floats:
        data = np.hstack([self._data[column] for column in self._names[name]])
        self._first(name, np.asarray(~np.isfinite(data).all(axis=1)), data, "must be finite")
        return data

    def _first(self, name: str, bad: NDArray[np.bool_], data: Floats, reason: str) -> None:
        """Raise for the first bad row, if there is one."""
        if bad.any():
            row = int(np.argmax(bad))
            value = data[row].tolist()
            where = self._source.line(row)
            if isinstance(value, list) and len(value) == 1:
                value = value[0]
            label = ", ".join(self._names[name]) + ("" if where is not None else f" of row {row}")
            raise ImportFileError(reason, None, label, value, where)

    def _width(self, name: str, data: Floats, allowed: tuple[int, ...]) -> None:
        if data.shape[1] not in allowed:
            columns, expected = ", ".join(self._names[name]), " or ".join(map(str, allowed))
            raise ImportFileError(f"{columns} has {data.shape[1]} numbers a row, not {expected}", ("columns", name))

    def vector(self, name: str) -> Floats:
        data = self._raw(name)
        self._width(name, data, (3, 2) if self._dimensions == 2 else (3,))
        if data.shape[1] == 2:
            data = np.hstack([data, np.zeros((len(data), 1))])
        if self._dimensions == 2:
            self._first(name, data[:, 2] != 0, data, "the z component must be 0 (dimensions = 2)")
        return np.ascontiguousarray(data)

    def positive(self, name: str) -> Floats:
        data = self._raw(name)
        self._width(name, data, (1,))
        self._first(name, data[:, 0] <= 0, data, "must be positive and finite")
        return np.ascontiguousarray(data[:, 0])

    def radius(self) -> Floats:
        return self.positive("radius") if "radius" in self._names else self.positive("diameter") / 2

    def ids(self) -> NDArray[np.int64]:
        data = self._raw("id")
        self._width("id", data, (1,))
        numbers = data[:, 0]
        wrong = (numbers != np.floor(numbers)) | (numbers < 0) | (numbers > LARGEST_ID)
        self._first("id", wrong, data, f"must be a whole number: from 0 to {LARGEST_ID}")
        again = np.ones(len(numbers), dtype=bool)
        again[np.unique(numbers, return_index=True)[1]] = False
        self._first("id", again, data, "another row has this id too")
        return numbers.astype(np.int64)

    def rounding(self, name: str) -> float:
        if name == "radius" and "radius" not in self._names:
            return self.rounding("diameter") / 2
        errors = []
        for column in self._names[name]:
            largest = float(np.abs(self._data[column]).max(initial=0.0))
            errors.append(self._source.rounding(column, largest))
        return max(errors)


def text_rounding(numbers: Iterable[str], largest: float) -> float:
    """The error of numbers written in decimal: half a unit of the last digit that the largest of them has.

    ``numbers`` is a sample. A file writes either a fixed number of decimals or a fixed number of digits; in both cases
    the largest number has the most digits, and the most digits seen are its own.
    """
    digits = max((_digit_count(number) for number in numbers), default=0)
    if digits < EXACT_DIGITS or largest == 0:
        return 0.0
    if digits >= DOUBLE_DIGITS:
        return math.ulp(largest) / 2
    return 0.5 * 10.0 ** (math.floor(math.log10(largest)) + 1 - digits)


def _digit_count(number: str) -> int:
    mantissa = re.split("[eE]", number.strip().lstrip("+-"), maxsplit=1)[0]
    return len(mantissa.replace(".", "").lstrip("0"))


class XyzSource:
    """Extended XYZ: the number of atoms, a line of ``key=value``, then one line an atom."""

    def __init__(self, path: Path, frame: int) -> None:
        self._bytes = path.read_bytes()
        ends = np.flatnonzero(np.frombuffer(self._bytes, np.uint8) == ord("\n"))
        if self._bytes and not self._bytes.endswith(b"\n"):
            ends = np.append(ends, len(self._bytes))
        self._ends = ends
        self._first_line = self._find(frame)
        self.count = self._count_at(self._first_line)
        self._keys = dict(self._key_values(self._text(self._first_line + 1)))
        self.columns, self._at = self._properties(self._keys.get("Properties", "species:S:1:pos:R:3"))
        self.box = self._read_box()

    def _text(self, line: int) -> str:
        start = int(self._ends[line - 1]) + 1 if line else 0
        return self._bytes[start : int(self._ends[line])].decode("utf-8", "replace").strip()

    def _count_at(self, line: int) -> int:
        text = self._text(line)
        if not text.isascii() or not text.isdigit() or int(text) == 0:
            raise ImportFileError("must be a positive whole number", None, "number of atoms", text, line + 1)
        count = int(text)
        if line + 2 + count > len(self._ends):
            there = max(len(self._ends) - line - 2, 0)
            raise ImportFileError(f"the file ends after {there} of them", None, "number of atoms", count, line + 1)
        return count

    def _find(self, frame: int) -> int:
        """The line (from 0) at which a frame begins."""
        starts, line = list[int](), 0
        while line < len(self._ends) and (self._text(line) or not starts):
            starts.append(line)
            line += 2 + self._count_at(line)
        if not -len(starts) <= frame < len(starts) or not starts:
            raise ImportFileError(f"the file has {len(starts)} frame{'s' * (len(starts) != 1)}", ("frame",))
        return starts[frame]

    @staticmethod
    def _key_values(text: str) -> Iterable[tuple[str, str]]:
        for key, quoted_value, bare in re.findall(r'([^\s="]+)\s*=\s*(?:"([^"]*)"|(\S+))', text):
            yield key, quoted_value or bare

    def _properties(self, text: str) -> tuple[dict[str, int], dict[str, int]]:
        parts = text.split(":")
        widths, at, place = dict[str, int](), dict[str, int](), 0
        if len(parts) % 3 or not all(width.isdigit() for width in parts[2::3]):
            raise ImportFileError("must be triples name:type:count", None, "Properties", text, self._first_line + 2)
        for name, kind, width in zip(parts[::3], parts[1::3], parts[2::3], strict=True):
            if kind in ("R", "I"):
                widths[name], at[name] = int(width), place
            place += int(width)
        self._width = place
        return widths, at

    def _read_box(self) -> Box | None:
        text = self._keys.get("Lattice")
        if text is None:
            return None
        line = self._first_line + 2
        try:
            cell = np.array(text.split(), dtype=float).reshape(3, 3)
            corner = np.array(self._keys.get("Origin", "0 0 0").split(), dtype=float).reshape(3)
        except ValueError:
            raise ImportFileError("must be nine numbers (and Origin three)", None, "Lattice", text, line) from None
        size = np.diag(cell).copy()
        if (cell != np.diag(size)).any():
            return TILTED
        flags = self._keys.get("pbc", "T T T").split()
        periodic = tuple(flag.upper() in ("T", "TRUE", "1") for flag in flags)
        if len(periodic) != 3 or any(wraps and not length > 0 for wraps, length in zip(periodic, size, strict=True)):
            raise ImportFileError("periodic axes must have a positive length", None, "Lattice", text, line)
        return Box(size, corner + size / 2, periodic, text_rounding(text.split(), float(np.abs(size).max())))

    def read(self, names: Sequence[str]) -> dict[str, Floats]:
        places = [self._at[name] + k for name in names for k in range(self.columns[name])]
        start, end = self._ends[self._first_line + 1] + 1, self._ends[self._first_line + 1 + self.count]
        lines = self._bytes[start:end].decode("ascii", "replace").split("\n")
        try:
            data = np.loadtxt(lines, usecols=places, comments=None, ndmin=2)
        except ValueError:
            self._explain(lines, names)
            raise
        if len(data) != self.count:
            self._explain(lines, names)
        columns, place = dict[str, Floats](), 0
        for name in names:
            columns[name] = data[:, place : place + self.columns[name]]
            place += self.columns[name]
        return columns

    def _explain(self, lines: list[str], names: Sequence[str]) -> None:
        """Raise for the first line that has not the numbers that it should have."""
        for row, line in enumerate(lines):
            words = line.split()
            if len(words) < self._width:
                raise ImportFileError(
                    f"must have the {self._width} columns of Properties, has {len(words)}",
                    None,
                    "row",
                    line,
                    self.line(row),
                )
            for name in names:
                for word in words[self._at[name] : self._at[name] + self.columns[name]]:
                    try:
                        float(word)
                    except ValueError:
                        raise ImportFileError("must be a number", None, name, word, self.line(row)) from None

    def line(self, row: int) -> int:
        return self._first_line + 3 + row

    def rounding(self, name: str, largest: float) -> float:
        rows = range(min(self.count, DIGITS_SAMPLED))
        at, width = self._at[name], self.columns[name]
        sample = [word for row in rows for word in self._text(self.line(row) - 1).split()[at : at + width]]
        return text_rounding(sample, largest)


class CsvSource:
    """Comma-separated values with a line of names."""

    box = None

    def __init__(self, path: Path, frame: int) -> None:
        from pyarrow import ArrowInvalid, csv

        if frame not in (0, -1):
            raise ImportFileError("a CSV file has 1 frame", ("frame",))
        self._path, self._csv, self._invalid = path, csv, ArrowInvalid
        try:
            with path.open(encoding="utf-8-sig", newline="") as file:
                header = file.readline().strip()
        except UnicodeDecodeError:
            raise ImportFileError("is not UTF-8 text", ("file",)) from None
        self._header = [name.strip().strip('"') for name in header.split(",")]
        if not header:
            raise ImportFileError("must name the columns", None, "header", "", 1)
        self.columns = dict.fromkeys(self._header, 1)
        if len(self.columns) < len(self._header):
            twice = next(name for name in self._header if self._header.count(name) > 1)
            raise ImportFileError("another column has this name too", None, "header", twice, 1)
        self.count = len(self._read_as([self._header[0]], "string"))
        if self.count == 0:
            raise ImportFileError("the file has no rows", ("file",))

    def _read_as(self, names: Sequence[str], kind: str) -> pyarrow.Table:
        # "nan" is a number, if one that is refused, and not an empty cell.
        options = self._csv.ConvertOptions(
            include_columns=list(names), column_types=dict.fromkeys(names, kind), null_values=[""]
        )
        reading = self._csv.ReadOptions(column_names=self._header, skip_rows=1)
        try:
            return self._csv.read_csv(self._path, read_options=reading, convert_options=options)
        except self._invalid as error:
            if kind == "string":
                self._explain_shape(str(error))
            raise

    def _explain_shape(self, message: str) -> None:
        for number, line in enumerate(self._path.read_text(encoding="utf-8-sig").splitlines(), start=1):
            if line and line.count(",") + 1 != len(self._header):
                cells = line.count(",") + 1
                raise ImportFileError(
                    f"must have the {len(self._header)} columns of the header, has {cells}", None, "row", line, number
                ) from None
        raise ImportFileError(f"is not CSV: {message}", ("file",)) from None

    def read(self, names: Sequence[str]) -> dict[str, Floats]:
        try:
            table = self._read_as(names, "double")
        except self._invalid:
            table = None
        if table is None or any(table.column(name).null_count for name in names):
            self._explain(names)
        assert table is not None
        return {name: table.column(name).to_numpy().reshape(-1, 1) for name in names}

    def _explain(self, names: Sequence[str]) -> None:
        """Raise for the first cell that is not a number."""
        texts = {name: self._read_as([name], "string").column(name).to_pylist() for name in names}
        for row in range(self.count):
            for name in names:
                word = texts[name][row]
                try:
                    float(word if word is not None else "")
                except ValueError:
                    raise ImportFileError("must be a number", None, name, word or "", self.line(row)) from None
        raise ImportFileError("has cells that cannot be read as numbers", ("file",))

    def line(self, row: int) -> int:
        # Empty lines are no rows.
        lines = self._path.read_text(encoding="utf-8-sig").splitlines()
        full = [number for number, line in enumerate(lines, start=1) if line]
        return full[row + 1]

    def rounding(self, name: str, largest: float) -> float:
        numbers = self._read_as([name], "string").column(name).slice(0, DIGITS_SAMPLED).to_pylist()
        return text_rounding([number or "" for number in numbers], largest)


class GsdSource:
    """GSD with the hoomd schema: numbers in single precision, but for those that Carom itself logged in double."""

    def __init__(self, path: Path, frame: int) -> None:
        import gsd.hoomd

        try:
            with gsd.hoomd.open(path, "r") as trajectory:
                if not -len(trajectory) <= frame < len(trajectory):
                    frames = len(trajectory)
                    raise ImportFileError(f"the file has {frames} frame{'s' * (frames != 1)}", ("frame",))
                self._frame: Any = trajectory[frame]
        except (RuntimeError, OSError):
            raise ImportFileError("is not a GSD file that can be read", ("file",)) from None
        particles = self._frame.particles
        self.count = int(particles.N)
        if self.count == 0:
            raise ImportFileError("the frame has no particles", ("frame",))
        self._refuse_other_shapes()
        self._arrays: dict[str, NDArray[Any]] = {
            "position": particles.position,
            "velocity": particles.velocity,
            "mass": particles.mass,
            "diameter": self._diameters(),
            "charge": particles.charge,
            "typeid": particles.typeid,
        }
        for name, array in (self._frame.log or {}).items():
            if name.startswith("particles/") and len(array) == self.count and array.ndim in (1, 2):
                # Carom's own frames have in double precision what the schema has in single.
                self._arrays[name.removeprefix("particles/")] = array
        self.columns = {name: int(np.prod(array.shape[1:])) for name, array in self._arrays.items()}
        self.box = self._read_box()

    def _refuse_other_shapes(self) -> None:
        """Refuse what would silently become balls: the schema has the shapes of types, an import has radii alone."""
        particles = self._frame.particles
        used = set(np.unique(particles.typeid).tolist())
        for number, shape in enumerate(particles.type_shapes or []):
            kind = shape.get("type", "Sphere")
            if number in used and kind != "Sphere":
                name = particles.types[number]
                raise ImportFileError(f"has particles of type {name!r}, a {kind}: only spheres are imported", ("file",))

    def _diameters(self) -> NDArray[Any]:
        """The diameters of the particles, or of the spheres that are their types' shapes."""
        particles = self._frame.particles
        shapes = particles.type_shapes or []
        spheres = [shape.get("diameter", np.nan) if shape.get("type") == "Sphere" else np.nan for shape in shapes]
        if (particles.diameter == 1).all() and len(spheres) == len(particles.types):
            diameters = np.array(spheres, dtype=np.float64)[particles.typeid]
            if np.isfinite(diameters).all():
                return diameters
        return particles.diameter

    def _read_box(self) -> Box:
        box = np.asarray(self._frame.configuration.box, dtype=np.float32)
        if (box[3:] != 0).any():
            return TILTED
        size = box[:3].astype(float)
        flat = int(self._frame.configuration.dimensions or 3) == 2
        return Box(size, np.zeros(3), (True, True, not flat), float(np.spacing(box[:3].max())) / 2)

    def read(self, names: Sequence[str]) -> dict[str, Floats]:
        return {name: np.asarray(self._arrays[name], dtype=float).reshape(self.count, -1) for name in names}

    def line(self, row: int) -> None:
        """There are no lines."""
        del row

    def rounding(self, name: str, largest: float) -> float:
        kind = self._arrays[name].dtype
        return float(np.spacing(np.float32(largest))) / 2 if kind == np.float32 and largest > 0 else 0.0
