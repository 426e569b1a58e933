"""The series of a run: the ledger at some hundred times, for plots and to see drifts.

`series.arrow` is an Arrow IPC stream, written while the run goes on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from carom.files import naming

if TYPE_CHECKING:
    from pathlib import Path

    import pyarrow

    from carom.simulation import Simulation

SCALARS = ("kinetic_energy", "potential_energy", "dissipated", "work", "energy_error", "momentum_error")
VECTORS = ("momentum", "angular_momentum", "wall_impulse", "gravity_impulse")


def schema() -> pyarrow.Schema:
    """Arrow schema: time (s), impacts (number so far), then the entries of the ledger."""
    import pyarrow as pa

    vector = pa.list_(pa.field("item", pa.float64(), nullable=False), 3)
    return pa.schema(
        [
            pa.field("time", pa.float64(), nullable=False),
            pa.field("impacts", pa.int64(), nullable=False),
            *(pa.field(name, pa.float64(), nullable=False) for name in SCALARS),
            *(pa.field(name, vector, nullable=name == "angular_momentum") for name in VECTORS),
        ]
    )


def sample(simulation: Simulation) -> dict[str, Any]:
    """One row: the clock, the number of impacts and the ledger."""
    ledger = simulation.ledger.to_dict()
    return {
        "time": simulation.time,
        "impacts": simulation.impact_count,
        **{name: ledger[name] for name in (*SCALARS, *VECTORS)},
    }


class SeriesWriter:
    """Appends rows to a series; they are on their way to the disk when `flush` returns."""

    def __init__(self, path: Path) -> None:
        import pyarrow as pa

        self._path = path
        self._schema = schema()
        self._rows: list[dict[str, Any]] = []
        with naming(path):
            self._file = path.open("wb")
            self._writer = pa.ipc.new_stream(self._file, self._schema)
            self._file.flush()

    def append(self, row: dict[str, Any]) -> None:
        """Append one row."""
        self._rows.append(row)

    def flush(self) -> None:
        """Write the rows appended since the last time. Raises RunFolderError if they cannot be written."""
        import pyarrow as pa

        if self._rows:
            with naming(self._path):
                self._writer.write_batch(pa.RecordBatch.from_pylist(self._rows, self._schema))
                self._file.flush()
            self._rows = []

    def close(self) -> None:
        """Write what is left and the end of the stream, and close the file."""
        self.flush()
        with naming(self._path):
            self._writer.close()
            self._file.close()


def read(path: Path) -> pyarrow.Table:
    """Read a series; one that was cut off by a crash is read as far as it goes."""
    import pyarrow as pa

    from carom.streams import batches

    found = list(batches(path))
    return pa.Table.from_batches(found, found[0].schema if found else schema())
