"""Exports of a run: its impacts as Parquet or CSV, its frames as extended XYZ."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from carom import impact_table
from carom.errors import RunFolderError
from carom.files import naming

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import pyarrow

    from carom.frames import Frame
    from carom.run_folder import RunFolder

Format = Literal["parquet", "csv", "extxyz"]
DEFAULT_NAMES: dict[Format, str] = {"parquet": "impacts.parquet", "csv": "impacts.csv", "extxyz": "frames.extxyz"}
"""File in the run folder that an export goes to if none is named."""


def export(folder: RunFolder, to: Format, path: str | Path | None = None) -> Path:
    """Write a run in another format.

    Parameters
    ----------
    folder
        The run.
    to
        "parquet" or "csv": every impact, one row each, fields as in `carom.Simulation.impacts` (vectors of CSV as three
        columns, `point_x`, `point_y`, `point_z`). "extxyz": the frames, as ASE and OVITO read them.
    path
        The file; left out: one in the run folder.

    Returns
    -------
    path
        What was written. Numbers are written so that they are read back to the last bit.

    Raises
    ------
    RunFolderError
        The file cannot be written, the run not be read, or it has no frames to export.
    """
    target = folder.path / DEFAULT_NAMES[to] if path is None else Path(path)
    writers: dict[Format, Callable[[RunFolder, Path], None]] = {
        "parquet": _write_parquet,
        "csv": _write_csv,
        "extxyz": _write_extended_xyz,
    }
    with _replacing(target) as temporary:
        writers[to](folder, temporary)
    return target


@contextlib.contextmanager
def _replacing(target: Path) -> Iterator[Path]:
    """Give a name to write to that becomes `target` only if all goes well."""
    temporary = target.with_name(target.name + ".part")
    try:
        with naming(target):
            yield temporary
            temporary.replace(target)
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def _write_parquet(folder: RunFolder, path: Path) -> None:
    import pyarrow.parquet as parquet

    batches = folder.impact_batches()
    first = next(batches, None)
    schema = impact_table.arrow_schema() if first is None else first.schema
    with parquet.ParquetWriter(path, schema, compression="zstd") as writer:
        if first is not None:
            writer.write_batch(first)
        for batch in batches:
            writer.write_batch(batch)


def _write_csv(folder: RunFolder, path: Path) -> None:
    import pyarrow as pa
    from pyarrow import csv

    nothing = pa.RecordBatch.from_pylist([], impact_table.arrow_schema())
    batches = folder.impact_batches()
    first = _flat(next(batches, nothing))
    options = csv.WriteOptions(quoting_style="needed")
    with csv.CSVWriter(path, first.schema, write_options=options) as writer:
        writer.write_batch(first)
        for batch in batches:
            writer.write_batch(_flat(batch))


def _flat(batch: pyarrow.RecordBatch) -> pyarrow.RecordBatch:
    """Vectors as three columns each, which is all that CSV can hold."""
    import pyarrow as pa

    columns: dict[str, pa.Array] = {}
    for name in batch.schema.names:
        column = batch.column(name)
        if pa.types.is_fixed_size_list(column.type):
            axes = "xyz" if column.type.list_size == 3 else "wxyz"
            values = column.flatten().to_numpy().reshape(-1, len(axes))
            columns.update(
                {f"{name}_{axis}": pa.array(np.ascontiguousarray(values[:, i])) for i, axis in enumerate(axes)}
            )
        elif pa.types.is_dictionary(column.type):
            columns[name] = column.dictionary_decode()
        else:
            columns[name] = column
    return pa.RecordBatch.from_pydict(columns)


def _write_extended_xyz(folder: RunFolder, path: Path) -> None:
    frames = folder.frames
    if not len(frames):
        raise RunFolderError(
            f"{folder.path}: there are no frames to export: the scene's output.frames or output.times asks for none"
        )
    periodic = ["T" if kind == "periodic" else "F" for kind in folder.scene.to_spec()["domain"]["axes"]]
    with path.open("w", encoding="ascii", newline="\n") as file:
        for frame in frames:
            file.write(_extended_xyz(frame, periodic))


def _extended_xyz(frame: Frame, periodic: list[str]) -> str:
    x, y, z = (float(length) for length in frame.box)
    # `momenta` and `masses` are what ASE takes velocities from, `velo` what OVITO does.
    properties = "species:S:1:type:S:1:pos:R:3:velo:R:3:momenta:R:3:masses:R:1:radius:R:1:id:I:1:fixed:L:1"
    # A box centred on the origin; a planar one has no height, but a cell without volume is of no use to readers.
    comment = (
        f'Lattice="{x!r} 0.0 0.0 0.0 {y!r} 0.0 0.0 0.0 {z or 1.0!r}" Origin="{-x / 2!r} {-y / 2!r} {-(z or 1.0) / 2!r}"'
        f' Properties={properties} pbc="{" ".join(periodic)}" Time={frame.time!r} time_low={frame.time_low!r}'
        f" impacts={frame.impacts}"
    )
    # A fixed ball's mass is infinite, which is no number to these readers; `fixed` tells.
    masses = np.where(frame.fixed, 1.0, frame.masses)
    columns = np.column_stack(
        [frame.positions, frame.velocities, frame.velocities * masses[:, None], masses, frame.radii]
    ).tolist()
    # ASE takes only symbols of elements for species, and X for what is none; a name with spaces would be two columns.
    types = ["_".join(frame.types[kind].split()) for kind in frame.type_ids.tolist()]
    rows = [
        f"X {name} {' '.join(map(repr, numbers))} {number} {'T' if fixed else 'F'}"
        for name, numbers, number, fixed in zip(types, columns, frame.ids.tolist(), frame.fixed.tolist(), strict=True)
    ]
    return f"{len(rows)}\n{comment}\n" + "".join(row + "\n" for row in rows)
