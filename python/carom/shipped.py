"""The scenes that come with Carom, by name."""

from __future__ import annotations

from pathlib import Path

from carom.errors import CaromError

_PACKAGE = Path(__file__).parent


def folder() -> Path | None:
    """Where the shipped scenes are: in a checkout in the project's folder, in an installed package beside this file."""
    # A build leaves copies beside this file in a checkout too; there the originals count.
    project = _PACKAGE.parent.parent
    path = project / "scenes" if (project / "crates" / "carom").is_dir() else _PACKAGE / "scenes"
    return path if path.is_dir() else None


def names() -> list[str]:
    """Names of the shipped scenes."""
    found = folder()
    return [] if found is None else sorted(path.stem for path in found.glob("*.toml"))


def find(scene: str) -> Path:
    """Return the file that `scene` means: a path, or the name of a shipped scene.

    Raises
    ------
    CaromError
        It is neither.
    """
    path = Path(scene)
    if path.exists() or path.suffix or len(path.parts) != 1:
        return path
    found = folder()
    if found is not None and scene in names():
        return found / f"{scene}.toml"
    import difflib

    known = names()
    guess = difflib.get_close_matches(scene, known, n=1)
    hint = f"; the nearest is {guess[0]}" if guess else f"; there are {', '.join(known)}" if known else ""
    raise CaromError(f"{scene}: neither a file nor the name of a scene that comes with Carom{hint}")
