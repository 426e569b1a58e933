"""Reading Arrow IPC streams, also those that a crash cut off."""

from __future__ import annotations

from typing import TYPE_CHECKING

from carom.errors import RunFolderError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import pyarrow

_FIRST_BYTES = b"\xff\xff\xff\xff"
"""Of every Arrow IPC stream: the mark of a message."""


def batches(path: Path) -> Iterator[pyarrow.RecordBatch]:
    """Yield the record batches of a stream as far as they are whole.

    Raises
    ------
    RunFolderError
        The file is not there, or is no Arrow stream.
    """
    import pyarrow as pa

    if not path.exists():
        raise RunFolderError(f"{path}: there is no such file")
    with pa.memory_map(str(path)) if path.stat().st_size else pa.BufferReader(b"") as source:
        try:
            reader = pa.ipc.open_stream(source)
        except (pa.ArrowInvalid, OSError) as error:
            if _cut_off(path):
                return
            raise RunFolderError(f"{path}: not an Arrow IPC stream: {error}") from error
        while True:
            try:
                batch = reader.read_next_batch()
            except StopIteration:
                return
            except (pa.ArrowInvalid, OSError):
                # The last batch was being written when the run was cut off; all before it are whole.
                return
            yield batch


def _cut_off(path: Path) -> bool:
    """Whether the file may be the beginning of a stream that did not get as far as its schema."""
    with path.open("rb") as file:
        start = file.read(len(_FIRST_BYTES))
    return _FIRST_BYTES.startswith(start)
