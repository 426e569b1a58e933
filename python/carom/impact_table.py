"""The table of impacts: one row an impact, in the order in which they happened.

The simulator hands over columns (a dict of arrays). Here they become a NumPy structured array, an Arrow table (without
a copy) or a digest. The names and the order of the fields are those of the run folder's `impacts.arrow`.
"""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import pyarrow
    from numpy.typing import NDArray

KINDS = (
    "ball-ball",
    "ball-plane",
    "ball-vertex",
    "ball-edge",
    "ball-rim",
    "ball-side",
    "ball-surface",
    "ball-face",
    "vertex-vertex",
    "vertex-edge",
    "vertex-rim",
    "vertex-side",
    "vertex-surface",
    "vertex-face",
    "vertex-plane",
    "edge-edge",
    "edge-rim",
    "edge-side",
    "edge-surface",
    "edge-face",
    "edge-plane",
    "rim-rim",
    "rim-side",
    "rim-surface",
    "rim-face",
    "rim-plane",
    "side-side",
    "side-surface",
    "side-face",
    "side-plane",
    "surface-surface",
    "surface-face",
    "surface-plane",
    "face-face",
    "face-plane",
)
"""Names of the kinds of impact, by what of the two surfaces meets; the simulator's code of a kind is its place here."""

CERTIFICATES = ("closed-form", "transversal", "within-tolerance")
"""How the time of an impact may be certified; the simulator's code of one is its place here. Closed form: balls among
themselves and with planes, certain up to rounding. Transversal: bodies that turn, crossing so fast that the time is
certain up to rounding. Within tolerance: they come within the stated tolerance, about 1e-12 of their size, so slowly or
so near a corner or edge that a touch cannot be told from a miss by less; the time is when they do."""

_NAMES = {"kind": KINDS, "certificate": CERTIFICATES}
"""Fields that hold a name, whose code is one byte."""

_WIDTHS = {
    "point": 3,
    "normal": 3,
    "orientation_a": 4,
    "orientation_b": 4,
    "angular_velocity_a": 3,
    "angular_velocity_b": 3,
}

# `kind` is text of fixed width: `impacts["kind"] == "ball-plane"` is what people write. 15 characters hold the longest
# name ("surface-surface").
DTYPE = np.dtype(
    [
        ("time", "<f8"),
        ("time_low", "<f8"),
        ("a", "<i8"),
        ("b", "<i8"),
        ("kind", "<U15"),
        ("point", "<f8", (3,)),
        ("normal", "<f8", (3,)),
        ("approach_speed", "<f8"),
        ("separation_speed", "<f8"),
        ("impulse", "<f8"),
        ("restitution", "<f8"),
        ("energy_lost", "<f8"),
    ]
)
"""Fields of a row: times in s, ids, point in m, normal (unit, b to a), speeds in m/s, impulse in N s, energy in J."""

FIELDS: tuple[str, ...] = DTYPE.names or ()
"""Their names, in order."""

TURNING_FIELDS = ("orientation_a", "orientation_b", "angular_velocity_a", "angular_velocity_b", "certificate")
"""Fields that the table of a scene with bodies that turn has besides, all of them. Right after the impact: unit
quaternions (w, x, y, z), the frame in which a shape was given to world, and rad/s in world axes; of a plane, a wall
or a mesh (1, 0, 0, 0) and 0. How its time was certified: see `CERTIFICATES`."""


def fields(*, turning: bool) -> tuple[str, ...]:
    """Names of the fields of a table, in order."""
    return FIELDS + TURNING_FIELDS if turning else FIELDS


def has_turns(chunks: Iterable[Mapping[str, NDArray[Any]]]) -> bool:
    """Whether chunks are of a table with bodies that turn."""
    return any(TURNING_FIELDS[0] in chunk for chunk in chunks)


def dtype(*, turning: bool) -> np.dtype[np.void]:
    """Type of a row: `DTYPE`, and with bodies that turn their fields at its end."""
    if not turning:
        return DTYPE
    added: list[tuple[str, Any]] = [
        (name, "<U16" if name in _NAMES else np.dtype(("<f8", (_WIDTHS[name],)))) for name in TURNING_FIELDS
    ]
    return np.dtype([(name, DTYPE[name]) for name in FIELDS] + added)


# What is digested: the same row with the kind's code, packed, little-endian, so that the digest depends on nothing
# else.
def _digest_dtype(*, turning: bool) -> np.dtype[np.void]:
    row = dtype(turning=turning)
    return np.dtype([(name, "u1" if name in _NAMES else row[name]) for name in fields(turning=turning)])


def empty(*, turning: bool = False) -> dict[str, NDArray[Any]]:
    """Return the columns of a table without rows."""
    rows = np.empty(0, _digest_dtype(turning=turning))
    return {name: np.ascontiguousarray(rows[name]) for name in fields(turning=turning)}


def joined(chunks: Iterable[Mapping[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    """Rows of all chunks as one."""
    # A chunk without rows may be one that nobody filled, and say nothing of the columns.
    chunks = [chunk for chunk in chunks if len(chunk["time"])]
    nothing = empty(turning=has_turns(chunks))
    return {name: np.concatenate([column, *(chunk[name] for chunk in chunks)]) for name, column in nothing.items()}


def structured(chunks: Iterable[Mapping[str, NDArray[Any]]]) -> NDArray[np.void]:
    """Rows of all chunks as one structured array of `DTYPE`, or with bodies that turn of `dtype(turning=True)`."""
    chunks = [chunk for chunk in chunks if len(chunk["time"])]
    rows = np.empty(sum(len(chunk["time"]) for chunk in chunks), dtype(turning=has_turns(chunks)))
    names = {field: np.array(named) for field, named in _NAMES.items()}
    start = 0
    for chunk in chunks:
        part = rows[start : start + len(chunk["time"])]
        for name in rows.dtype.names or ():
            part[name] = names[name][chunk[name]] if name in _NAMES else chunk[name]
        start += len(part)
    return rows


def arrow_schema(metadata: Mapping[str, str] | None = None, *, turning: bool = False) -> pyarrow.Schema:
    """Arrow schema of the table. `metadata` is stored with it."""
    import pyarrow as pa

    def arrow_type(name: str) -> pa.DataType:
        if name in _NAMES:
            return pa.dictionary(pa.int8(), pa.string())
        if name in _WIDTHS:
            return pa.list_(pa.field("item", pa.float64(), nullable=False), _WIDTHS[name])
        return pa.int64() if name in {"a", "b"} else pa.float64()

    columns = [pa.field(name, arrow_type(name), nullable=False) for name in fields(turning=turning)]
    return pa.schema(columns, metadata=dict(metadata) if metadata else None)


def record_batch(chunk: Mapping[str, NDArray[Any]], schema: pyarrow.Schema) -> pyarrow.RecordBatch:
    """One chunk of columns as an Arrow record batch on the same memory."""
    import pyarrow as pa

    rows = len(chunk["time"])

    def flat(array: NDArray[Any], arrow_type: pa.DataType) -> pa.Array:
        return pa.Array.from_buffers(arrow_type, array.size, [None, pa.py_buffer(np.ascontiguousarray(array))])

    arrays: list[pa.Array] = []
    for field in schema:
        column = chunk[field.name]
        if field.name in _NAMES:
            # A code is one byte whether it counts as signed or not; Arrow tools expect signed indices.
            names = pa.array(_NAMES[field.name], pa.string())
            arrays.append(pa.DictionaryArray.from_arrays(flat(column.view(np.int8), pa.int8()), names))
        elif field.name in _WIDTHS:
            values = flat(column, pa.float64())
            arrays.append(pa.Array.from_buffers(field.type, rows, [None], children=[values]))
        else:
            arrays.append(flat(column, field.type))
    return pa.RecordBatch.from_arrays(arrays, schema=schema)


def columns(batch: pyarrow.RecordBatch) -> dict[str, NDArray[Any]]:
    """Columns of a record batch, the other way round from `record_batch`."""
    found: dict[str, NDArray[Any]] = {}
    for name in fields(turning=TURNING_FIELDS[0] in batch.schema.names):
        array = batch.column(name)
        if name in _NAMES:
            codes = {kind: code for code, kind in enumerate(_NAMES[name])}
            lookup = np.array([codes[kind] for kind in array.dictionary.to_pylist()], np.uint8)
            found[name] = lookup[array.indices.to_numpy()]
        elif name in _WIDTHS:
            found[name] = array.flatten().to_numpy().reshape(-1, _WIDTHS[name])
        else:
            found[name] = array.to_numpy()
    return found


class Digest:
    """SHA-256 over the rows of the table, in order; how the rows are cut into chunks does not matter."""

    def __init__(self) -> None:
        self._hash = hashlib.sha256()

    def update(self, chunk: Mapping[str, NDArray[Any]]) -> None:
        """Add the rows of a chunk."""
        rows = np.empty(len(chunk["time"]), _digest_dtype(turning=has_turns([chunk])))
        for name in rows.dtype.names or ():
            rows[name] = chunk[name]
        self._hash.update(rows.tobytes())

    def hexdigest(self) -> str:
        """Return the digest of all rows so far."""
        return self._hash.hexdigest()
