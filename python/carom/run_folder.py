"""A run is a folder of standard files (`carom.run` writes it); `RunFolder` reads it.

scene.json      the scene as given, with version, seed and defaults
impacts.arrow   every impact, an Arrow IPC stream
frames.gsd      states at the times asked for
series.arrow    the ledger at some hundred times, an Arrow IPC stream
summary.json    how the run ended, ledger, counts, rules, timings, digests
checkpoint      to go on from, bit for bit
report.html     one page to look at
"""

from __future__ import annotations

import functools
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom import impact_table, series
from carom.errors import RunFolderError
from carom.files import naming
from carom.frames import Frames
from carom.simulation import Ledger, Simulation
from carom.streams import batches

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    import pyarrow
    from numpy.typing import NDArray

    from carom.scene import Scene

SCENE, IMPACTS, FRAMES, SERIES = "scene.json", "impacts.arrow", "frames.gsd", "series.arrow"
SUMMARY, CHECKPOINT, REPORT = "summary.json", "checkpoint", "report.html"


class WrongFolderError(RunFolderError):
    """The folder named is not one that can be used for this: not a run folder, or one that holds something."""


class RunFolder:
    """A run on the disk.

    Parameters
    ----------
    path
        The folder.

    Raises
    ------
    WrongFolderError
        It is not a run folder.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if not self.path.is_dir():
            raise WrongFolderError(f"{self.path}: there is no such folder")
        if not is_run_folder(self.path):
            raise WrongFolderError(f"{self.path}: not a run folder: it has no {SCENE} and {SUMMARY} written by Carom")

    @classmethod
    def open(cls, path: str | Path) -> RunFolder:
        """Open the run in a folder. Raises WrongFolderError if it is none."""
        return cls(path)

    @functools.cached_property
    def scene(self) -> Scene:
        """The scene that was run."""
        from carom.scene import Scene

        return Scene.load(self.path / SCENE)

    @functools.cached_property
    def summary(self) -> dict[str, Any]:
        """How the run ended, its ledger, counts, rules, timings and digests."""
        return _read_json(self.path / SUMMARY)

    @property
    def ledger(self) -> Ledger:
        """The ledger at the end."""
        return Ledger.from_dict(self.summary["ledger"])

    @functools.cached_property
    def impacts(self) -> NDArray[np.void]:
        """Every impact recorded, as a structured array (fields: `carom.impact_table.DTYPE`)."""
        return impact_table.structured(impact_table.columns(batch) for batch in self.impact_batches())

    def impacts_arrow(self) -> pyarrow.Table:
        """Return the same table for Arrow, mapped from the file."""
        import pyarrow as pa

        found = list(self.impact_batches())
        return pa.Table.from_batches(found, found[0].schema if found else impact_table.arrow_schema())

    def impact_batches(self) -> Iterator[pyarrow.RecordBatch]:
        """Yield the impacts batch by batch, for runs with more of them than memory."""
        return batches(self.path / IMPACTS)

    @functools.cached_property
    def frames(self) -> Frames:
        """States at the times that the scene asked for, as a sequence."""
        return Frames(self.path / FRAMES)

    def series(self) -> pyarrow.Table:
        """Return the ledger at some hundred times."""
        return series.read(self.path / SERIES)

    def simulation(self) -> Simulation:
        """Go on from where the run's checkpoint stands. Raises RunFolderError if there is none."""
        return Simulation.from_checkpoint(self.path / CHECKPOINT)

    @property
    def report(self) -> Path:
        """Path of the page to look at."""
        return self.path / REPORT

    def __repr__(self) -> str:
        return f"<carom.RunFolder {self.path}>"


def is_run_folder(path: Path) -> bool:
    """Whether a folder is one that a run wrote."""
    try:
        return path.is_dir() and "carom" in _read_json(path / SUMMARY) and (path / SCENE).is_file()
    except RunFolderError:
        return False


def _read_json(path: Path) -> dict[str, Any]:
    with naming(path, "cannot read"):
        text = path.read_text(encoding="utf-8")
    try:
        content = json.loads(text)
    except ValueError as error:
        raise RunFolderError(f"{path}: not JSON: {error}") from error
    if not isinstance(content, dict):
        raise RunFolderError(f"{path}: an object was expected")
    return content


def choose_folder(name: str, parent: str | Path = "runs") -> Path:
    """Return the first of runs/NAME, runs/NAME-2, runs/NAME-3, … that does not exist."""
    parent = Path(parent)
    number = 1
    while (path := parent / (name if number == 1 else f"{name}-{number}")).exists():
        number += 1
    return path
