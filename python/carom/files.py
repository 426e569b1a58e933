"""Writing files so that a crash leaves either the old file or the new one, and errors that name the path."""

from __future__ import annotations

import contextlib
import os
from typing import TYPE_CHECKING

from carom.errors import RunFolderError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@contextlib.contextmanager
def naming(path: Path, what: str = "cannot write") -> Iterator[None]:
    """Turn whatever the operating system says about `path` into a RunFolderError that names it."""
    try:
        yield
    except OSError as error:
        raise RunFolderError(f"{path}: {what}: {error.strerror or error}") from error


def write_whole(path: Path, content: bytes | str) -> None:
    """Write a file under another name, make sure it is on the disk, then give it its own name.

    Raises
    ------
    RunFolderError
        The file cannot be written; the old one, if any, is as it was.
    """
    temporary = path.with_name(path.name + ".part")
    with naming(path):
        try:
            with temporary.open("wb") as file:
                file.write(content.encode() if isinstance(content, str) else content)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
        except OSError:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
            raise
