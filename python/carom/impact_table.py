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

KINDS = ("ball-ball", "ball-plane")
"""Names of the kinds of impact; the simulator's code of a kind is its place here."""

_WIDTHS = {"point": 3, "normal": 3}

# `kind` is text of fixed width: `impacts["kind"] == "ball-plane"` is what people write. 11 characters hold the longest
# name there will be ("vertex-face").
DTYPE = np.dtype(
    [
        ("time", "<f8"),
        ("time_low", "<f8"),
        ("a", "<i8"),
        ("b", "<i8"),
        ("kind", "<U11"),
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

# What is digested: the same row with the kind's code, packed, little-endian, so that the digest depends on nothing
# else.
_DIGEST_DTYPE = np.dtype([(name, "u1" if name == "kind" else DTYPE[name]) for name in FIELDS])


def empty() -> dict[str, NDArray[Any]]:
    """Return the columns of a table without rows."""
    rows = np.empty(0, _DIGEST_DTYPE)
    return {name: np.ascontiguousarray(rows[name]) for name in FIELDS}


def structured(chunks: Iterable[Mapping[str, NDArray[Any]]]) -> NDArray[np.void]:
    """Rows of all chunks as one structured array of `DTYPE`."""
    chunks = list(chunks)
    rows = np.empty(sum(len(chunk["time"]) for chunk in chunks), DTYPE)
    names = np.array(KINDS, DTYPE["kind"])
    start = 0
    for chunk in chunks:
        part = rows[start : start + len(chunk["time"])]
        for name in FIELDS:
            part[name] = names[chunk["kind"]] if name == "kind" else chunk[name]
        start += len(part)
    return rows


def arrow_schema(metadata: Mapping[str, str] | None = None) -> pyarrow.Schema:
    """Arrow schema of the table. `metadata` is stored with it."""
    import pyarrow as pa

    def arrow_type(name: str) -> pa.DataType:
        if name == "kind":
            return pa.dictionary(pa.int8(), pa.string())
        if name in _WIDTHS:
            return pa.list_(pa.field("item", pa.float64(), nullable=False), _WIDTHS[name])
        return pa.int64() if name in {"a", "b"} else pa.float64()

    fields = [pa.field(name, arrow_type(name), nullable=False) for name in FIELDS]
    return pa.schema(fields, metadata=dict(metadata) if metadata else None)


def record_batch(chunk: Mapping[str, NDArray[Any]], schema: pyarrow.Schema) -> pyarrow.RecordBatch:
    """One chunk of columns as an Arrow record batch on the same memory."""
    import pyarrow as pa

    rows = len(chunk["time"])

    def flat(array: NDArray[Any], arrow_type: pa.DataType) -> pa.Array:
        return pa.Array.from_buffers(arrow_type, array.size, [None, pa.py_buffer(np.ascontiguousarray(array))])

    arrays: list[pa.Array] = []
    for field in schema:
        column = chunk[field.name]
        if field.name == "kind":
            # A code is one byte whether it counts as signed or not; Arrow tools expect signed indices.
            arrays.append(
                pa.DictionaryArray.from_arrays(flat(column.view(np.int8), pa.int8()), pa.array(KINDS, pa.string()))
            )
        elif field.name in _WIDTHS:
            values = flat(column, pa.float64())
            arrays.append(pa.Array.from_buffers(field.type, rows, [None], children=[values]))
        else:
            arrays.append(flat(column, field.type))
    return pa.RecordBatch.from_arrays(arrays, schema=schema)


def columns(batch: pyarrow.RecordBatch) -> dict[str, NDArray[Any]]:
    """Columns of a record batch, the other way round from `record_batch`."""
    found: dict[str, NDArray[Any]] = {}
    for name in FIELDS:
        array = batch.column(name)
        if name == "kind":
            codes = {kind: code for code, kind in enumerate(KINDS)}
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
        rows = np.empty(len(chunk["time"]), _DIGEST_DTYPE)
        for name in FIELDS:
            rows[name] = chunk[name]
        self._hash.update(rows.tobytes())

    def hexdigest(self) -> str:
        """Return the digest of all rows so far."""
        return self._hash.hexdigest()
