"""The checkpoint: one file that holds a simulation, to go on from bit for bit.

Layout: one line of text (`carom checkpoint 1`), one line of JSON (version of Carom, lengths, SHA-256 of what follows),
the scene as JSON, the state as the simulator wrote it.
"""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING

from carom.errors import RunFolderError
from carom.files import naming, write_whole

if TYPE_CHECKING:
    from pathlib import Path

_FIRST_LINE = b"carom checkpoint 1\n"


def write(path: Path, scene: bytes, state: bytes, version: str) -> None:
    """Write the scene (JSON text) and the state (bytes of the simulator). Raises RunFolderError."""
    header = {
        "carom": version,
        "scene_bytes": len(scene),
        "state_bytes": len(state),
        "sha256": hashlib.sha256(scene + state).hexdigest(),
    }
    write_whole(path, _FIRST_LINE + json.dumps(header).encode() + b"\n" + scene + state)


def read(path: Path) -> tuple[bytes, bytes]:
    """Scene (JSON text) and state (bytes of the simulator) of a checkpoint.

    Raises
    ------
    RunFolderError
        The file cannot be read, is not a checkpoint, or is damaged.
    """
    with naming(path, "cannot read"):
        content = path.read_bytes()
    if not content.startswith(_FIRST_LINE):
        raise RunFolderError(
            f"{path}: not a checkpoint of this version of Carom (its first line should be 'carom checkpoint 1')"
        )
    try:
        end = content.index(b"\n", len(_FIRST_LINE))
        header = json.loads(content[len(_FIRST_LINE) : end])
        scene_bytes, state_bytes = int(header["scene_bytes"]), int(header["state_bytes"])
        digest = header["sha256"]
    except (ValueError, KeyError, TypeError) as error:
        raise RunFolderError(f"{path}: damaged checkpoint: its header cannot be read") from error
    body = content[end + 1 :]
    if len(body) != scene_bytes + state_bytes or hashlib.sha256(body).hexdigest() != digest:
        raise RunFolderError(f"{path}: damaged checkpoint: the content does not match its SHA-256")
    return body[:scene_bytes], body[scene_bytes:]
