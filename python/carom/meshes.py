"""Triangles from mesh files (STL, OBJ, PLY, GLB), read by trimesh, and their decomposition into convex parts by CoACD.

Both packages are extras. How many triangles a file has is looked up before it is read, so that one that is too large is
refused at once; whether the triangles can be a body is the core's to tell.
"""

from __future__ import annotations

import io
import json
import re
import struct
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from carom import _carom

__all__ = ["FORMATS", "MOST_TRIANGLES", "Mesh", "MeshFileError", "convex_parts", "read_mesh"]

FORMATS: Final = (".stl", ".obj", ".ply", ".glb")

MOST_TRIANGLES: Final = _carom.MOST_TRIANGLES
"""A mesh has no more triangles than this."""

MOST_BYTES: Final = 1 << 31
"""A file is no longer than this; the triangles of a binary format would take a fifth of it."""

CONCAVITY: Final = 0.05
"""CoACD splits until no part is further from its hull than this; its measure, of a mesh scaled to a length of 2."""

_STL_HEADER, _STL_TRIANGLE = 84, 50
_HEADER_BYTES: Final = 1 << 16


class Mesh(NamedTuple):
    """Triangles, counter-clockwise seen from outside."""

    vertices: NDArray[np.float64]
    """(n, 3), in the file's unit."""
    triangles: NDArray[np.uint32]
    """(m, 3), which vertices; a place may have several."""


class MeshFileError(Exception):
    """A mesh file cannot be used."""


def read_mesh(path: Path) -> Mesh:
    """Read all triangles of a file.

    Raises
    ------
    MeshFileError
        There is no such file, it is none of the known formats, damaged, empty or too large, or trimesh is missing.
    """
    kind = path.suffix.lower()
    if kind not in FORMATS:
        raise MeshFileError(f"has no known suffix ({', '.join(FORMATS)})")
    if not path.is_file():
        raise MeshFileError("there is no such file")
    try:
        size = path.stat().st_size
        if size == 0:
            raise MeshFileError("the file is empty")
        with path.open("rb") as file:
            _check_count(_declared(kind, file.read(_HEADER_BYTES), size))
            if size > MOST_BYTES:
                raise MeshFileError(f"the file has {size} bytes; it may have {MOST_BYTES}")
            file.seek(0)
            content = file.read()
    except OSError as error:
        raise MeshFileError(f"cannot be read: {error.strerror or error}") from None
    _check_count(_counted(kind, content))
    return _parsed(kind, content)


def _check_count(count: int | None) -> None:
    if count is not None and count > MOST_TRIANGLES:
        raise MeshFileError(f"the file has {count} triangles; a mesh may have {MOST_TRIANGLES}")


def _declared(kind: str, head: bytes, size: int) -> int | None:
    """The number of triangles that the beginning of a file declares, if it does."""
    match kind:
        case ".stl" if not _is_text_stl(head, size):
            if len(head) < _STL_HEADER:
                raise MeshFileError(f"is cut short: a binary STL file has a header of {_STL_HEADER} bytes")
            (count,) = struct.unpack_from("<I", head, _STL_HEADER - 4)
            _check_count(count)
            if size < _STL_HEADER + count * _STL_TRIANGLE:
                whole = (size - _STL_HEADER) // _STL_TRIANGLE
                raise MeshFileError(f"is cut short: it declares {count} triangles and has {whole}")
            return count
        case ".ply":
            found = re.search(rb"^element face (\d+)\s*$", head, re.MULTILINE)
            return int(found[1]) if found else None
        case _:
            return None


def _is_text_stl(head: bytes, size: int) -> bool:
    # Some binary files begin with the word of the text ones; their length gives them away.
    if len(head) >= _STL_HEADER:
        (count,) = struct.unpack_from("<I", head, _STL_HEADER - 4)
        if size == _STL_HEADER + count * _STL_TRIANGLE:
            return False
    return head.lstrip().startswith(b"solid") and b"\0" not in head


def _counted(kind: str, content: bytes) -> int | None:
    """The number of triangles of a format that does not begin with it."""
    match kind:
        case ".stl" if _is_text_stl(content[:_HEADER_BYTES], len(content)):
            return content.count(b"endfacet")
        case ".obj":
            return content.count(b"\nf ") + content.startswith(b"f ")
        case ".glb":
            return _count_of_glb(content)
        case _:
            return None


def _count_of_glb(content: bytes) -> int | None:
    try:
        length = struct.unpack_from("<I", content, 12)[0]
        tree = json.loads(content[20 : 20 + length])
        accessors, count = tree["accessors"], 0
        for mesh in tree["meshes"]:
            for primitive in mesh["primitives"]:
                place = primitive.get("indices", primitive["attributes"]["POSITION"])
                count += accessors[place]["count"] // 3
    except (struct.error, ValueError, KeyError, IndexError, TypeError, AttributeError):
        return None  # trimesh will say that it cannot be read
    return count


def _parsed(kind: str, content: bytes) -> Mesh:
    try:
        import trimesh
    except ModuleNotFoundError:
        raise MeshFileError('needs the package trimesh to be read: pip install "carom[mesh]"') from None
    name = kind[1:].upper()
    try:
        # From memory: no other file, be it beside this one or elsewhere, is opened whatever this one says. Nothing is
        # merged or mended: what is wrong is to be told.
        scene: Any = trimesh.load_scene(io.BytesIO(content), file_type=kind[1:], process=False)
        meshes = [mesh for mesh in scene.geometry.values() if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces)]
        whole: Any = scene.to_mesh() if meshes else None
    except Exception:  # whatever trimesh stumbles over
        raise MeshFileError(f"cannot be read as {name}") from None
    if whole is None:
        raise MeshFileError("the file has no triangles")
    vertices, triangles = (np.asarray(whole.vertices, dtype=np.float64), np.asarray(whole.faces, dtype=np.uint32))
    return Mesh(np.ascontiguousarray(vertices), np.ascontiguousarray(triangles))


def convex_parts(mesh: Mesh) -> list[NDArray[np.float64]]:
    """Split a closed mesh into parts that are nearly convex: the corners of the hull of each, (n, 3).

    The same mesh gives the same parts. Their union is near the mesh, not the mesh itself.

    Raises
    ------
    MeshFileError
        CoACD is missing, or finds no parts.
    """
    try:
        import coacd
    except ModuleNotFoundError:
        raise MeshFileError('needs the package coacd to be split: pip install "carom[decompose]"') from None
    # CoACD cuts along planes through vertices that neighbours share.
    places, inverse = np.unique(mesh.vertices, axis=0, return_inverse=True)
    triangles = inverse.reshape(-1)[mesh.triangles].astype(np.int32)
    coacd.set_log_level("off")
    parts = coacd.run_coacd(coacd.Mesh(places, triangles), threshold=CONCAVITY, preprocess_mode="off", seed=0)
    if not parts:
        raise MeshFileError("could not be split into convex parts")
    return [np.ascontiguousarray(vertices, dtype=np.float64) for vertices, _ in parts]
