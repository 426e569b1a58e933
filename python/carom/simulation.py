"""A scene in motion: run it, look at it, keep it."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from carom import _carom, checkpoint, impact_table
from carom.errors import CaromError, CollapseError, RunFolderError, SceneError
from carom.impact import Impact
from carom.solids import Solids
from carom.version import __version__

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import pyarrow
    from numpy.typing import NDArray

    from carom.scene import Scene

Reason = Literal["time", "impacts", "exhausted"]
"""Why a run ended: the time asked for, the number of impacts asked for, or no impact will ever come."""


class ArgumentError(CaromError, ValueError):
    """A call that cannot be carried out: back in time, to a time that is not finite, for less than no impact."""


@dataclass(frozen=True, eq=False)
class Ledger:
    """What there is and where it went. Energies in J, momenta in kg m/s, angular momentum about the origin, kg m²/s."""

    kinetic_energy: float
    potential_energy: float
    """In uniform gravity; zero at the origin."""
    momentum: NDArray[np.float64]
    angular_momentum: NDArray[np.float64] | None
    """None in a periodic box, where it has no meaning."""
    dissipated: float
    """Energy lost at impacts since the start."""
    work: float
    """Work done by bodies in prescribed motion since the start."""
    energy_error: float
    """What is missing from (kinetic + potential + dissipated − work = its value at the start), relative to the largest
    energy so far."""
    wall_impulse: NDArray[np.float64]
    """Momentum given by walls, planes and fixed bodies since the start."""
    gravity_impulse: NDArray[np.float64]
    """Momentum given by gravity since the start."""
    momentum_error: float
    """What is missing from the balance of momentum, relative to the largest sum of |p| so far."""
    angular_momentum_error: float | None
    """The same for angular momentum; None in a periodic box."""
    energy_start: float
    """Kinetic and potential energy at the start."""

    def to_dict(self) -> dict[str, Any]:
        """Return the same as plain numbers and lists."""
        return {
            name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in self.__dict__.items()
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Ledger:
        """Make a ledger from the dict that `to_dict` or the simulator gives; further entries are left aside."""

        def value(name: str) -> Any:
            given = values[name]
            return np.asarray(given, float) if isinstance(given, list | tuple | np.ndarray) else given

        return cls(**{name: value(name) for name in cls.__dataclass_fields__})


@contextlib.contextmanager
def native_errors() -> Iterator[None]:
    """Turn the errors of the native module into ours."""
    try:
        yield
    except _carom.CollapseError as error:
        raise CollapseError(str(error), list(error.bodies), error.time, error.cause, error.advice) from None
    except ValueError as error:
        raise ArgumentError(str(error)) from None


class Simulation:
    """A scene in motion.

    Arrays have one row a body, sorted by id, all at `time`. A plane's row in `positions` is its point nearest to the
    origin. What a property returns is a fresh array: writing to it changes nothing here.

    Parameters
    ----------
    scene
        What there is at the start.

    Raises
    ------
    SceneError
        The scene cannot be run: bodies overlap, a ball is outside its walls, … Every problem is listed.
    """

    def __init__(self, scene: Scene) -> None:
        if not hasattr(scene, "engine"):
            raise ArgumentError(
                f"Simulation takes a scene, not a {type(scene).__name__}: carom.Scene.load(path) or "
                "carom.Scene.from_dict(fields) makes one"
            )
        self._begin(scene, scene.engine())

    def _begin(self, scene: Scene, engine: _carom.Engine) -> None:
        self._scene = scene
        self._engine = engine
        self._chunks: list[dict[str, NDArray[Any]]] = []
        self._structured: NDArray[np.void] | None = None

    @property
    def scene(self) -> Scene:
        """The scene that this started from."""
        return self._scene

    @property
    def time(self) -> float:
        """The clock, s. `time + time_low`, added without rounding, is the exact value."""
        return self._engine.time[0]

    @property
    def time_low(self) -> float:
        """What `time` leaves out of the clock, s."""
        return self._engine.time[1]

    @property
    def end_time(self) -> float:
        """Time at which the scene's duration is over, s."""
        return self._scene.end

    @property
    def ids(self) -> NDArray[np.int64]:
        """Ids of the bodies, (n,), in rising order; they name the rows of all other arrays."""
        return self._engine.ids

    @property
    def radii(self) -> NDArray[np.float64]:
        """Radii, (n,), m; nan for planes."""
        return self._engine.radii

    @property
    def masses(self) -> NDArray[np.float64]:
        """Masses, (n,), kg; inf for fixed bodies."""
        return self._engine.masses

    @property
    def fixed(self) -> NDArray[np.bool_]:
        """Whether a body moves as prescribed whatever hits it, (n,)."""
        return self._engine.fixed

    @property
    def is_plane(self) -> NDArray[np.bool_]:
        """Whether a body is a plane, (n,)."""
        return self._engine.is_plane

    @property
    def materials(self) -> NDArray[np.int64]:
        """Material of each body, (n,): places in `material_names`."""
        return self._engine.materials

    @property
    def material_names(self) -> list[str]:
        """Names of the materials; the first, without a name, is that of bodies that name none."""
        return list(self._spec["materials"])

    @property
    def axes(self) -> list[str]:
        """What bounds space along x, y and z: "open", "walls" or "periodic"."""
        return list(self._spec["domain"]["axes"])

    @property
    def size(self) -> list[float | None]:
        """Lengths of the domain along x, y and z, m; None along open axes."""
        return [
            None if kind == "open" else float(length)
            for kind, length in zip(self.axes, self._spec["domain"]["size"], strict=True)
        ]

    @functools.cached_property
    def _spec(self) -> dict[str, Any]:
        spec = self._scene.to_spec()
        return {name: spec[name] for name in ("domain", "materials")}

    @functools.cached_property
    def solids(self) -> Solids | None:
        """Shapes and moments of inertia of the bodies that turn; None if there are balls and planes only."""
        return Solids.of_engine(self._engine)

    @property
    def planes(self) -> list[dict[str, Any]]:
        """Planes and walls of the domain (negative ids): dicts with id, normal, offset, velocity, material."""
        return self._engine.planes

    @property
    def positions(self) -> NDArray[np.float64]:
        """Centres of mass, (n, 3), m; along periodic axes wrapped into the box (see `images`)."""
        return self._engine.positions()

    @property
    def velocities(self) -> NDArray[np.float64]:
        """Velocities of the centres of mass, (n, 3), m/s."""
        return self._engine.velocities()

    @property
    def orientations(self) -> NDArray[np.float64]:
        """Unit quaternions (w, x, y, z) from body to world axes, (n, 4)."""
        return self._engine.orientations()

    @property
    def angular_velocities(self) -> NDArray[np.float64]:
        """Angular velocities in world axes, (n, 3), rad/s."""
        return self._engine.angular_velocities()

    @property
    def images(self) -> NDArray[np.int64]:
        """How many box lengths to add to `positions` along each periodic axis, (n, 3)."""
        return self._engine.images()

    @property
    def ledger(self) -> Ledger:
        """Energy and momentum now, and what impacts, walls and gravity gave and took."""
        return Ledger.from_dict(self._engine.ledger())

    @property
    def counts(self) -> dict[str, int]:
        """How many impacts, by kind, and how much work finding them was."""
        return self._engine.counts()

    @property
    def impact_count(self) -> int:
        """Number of impacts since the scene's start, recorded or not."""
        return self._engine.impact_count

    @property
    def rules(self) -> dict[str, str]:
        """Names of the rules used where rigid-body theory leaves a choice."""
        return self._engine.rules()

    @property
    def notes(self) -> list[str]:
        """Remarks on the scene that a user should know of."""
        factor, overlaps, deepest = self._engine.shrunk
        if overlaps == 0:
            return self._scene.notes
        shrunk = (
            f"{overlaps} overlaps, the deepest of {deepest:.3g} m, were shrunk away:"
            f" all radii were multiplied by {factor!r}"
        )
        return [*self._scene.notes, shrunk]

    @property
    def impacts(self) -> NDArray[np.void]:
        """One row an impact since this simulation began, oldest first (fields: `carom.impact_table.DTYPE`). Read-only.

        A simulation from a checkpoint begins there. Nothing is recorded if the scene says `output.impacts = false`.
        `impacts_arrow` is the way without a copy.
        """
        self._collect()
        if self._structured is None:
            self._structured = impact_table.structured(self._chunks)
            self._structured.flags.writeable = False
        return self._structured

    def impacts_arrow(self) -> pyarrow.Table:
        """Return the same table as `impacts` for Arrow, on the memory in which it was recorded."""
        import pyarrow as pa

        self._collect()
        schema = impact_table.arrow_schema(turning=impact_table.has_turns(self._chunks))
        return pa.Table.from_batches([impact_table.record_batch(chunk, schema) for chunk in self._chunks], schema)

    def take_impacts(self) -> dict[str, NDArray[Any]]:
        """Return the rows not taken yet as columns and forget them, for runs with more impacts than memory.

        `kind` holds codes: places in `carom.impact_table.KINDS`.
        """
        self._collect()
        chunks, self._chunks, self._structured = self._chunks, [], None
        return chunks[0] if len(chunks) == 1 else impact_table.joined(chunks)

    def _collect(self) -> None:
        chunk = self._engine.take_impacts()
        if len(chunk["time"]):
            self._chunks.append(chunk)
            self._structured = None

    def run(self, until: float | None = None, *, events: int | None = None) -> Reason:
        """Run to a time, for a number of impacts, or both: whichever comes first.

        Without any, run to the end of the scene's duration. Ctrl-C raises KeyboardInterrupt and leaves the simulation
        between two impacts, as valid as ever: look at it, save it, run on.

        Parameters
        ----------
        until
            Time at which to stop, s, on the scene's clock (absolute).
        events
            Number of impacts after which to stop, counted from here. Without `until` there is no bound in time.

        Returns
        -------
        reason
            "time", "impacts", or "exhausted" if no impact will ever come and no time was given.

        Raises
        ------
        ArgumentError
            `until` is in the past or not finite, or `events` is not a whole number of at least 0. Nothing has changed.
        CollapseError
            Impacts that lose energy pile up at one time. The simulation stands at the last valid impact.
        """
        if until is None and events is None:
            until = self.end_time
        if until is not None:
            until = self.checked_time(until)
        if events is not None and (isinstance(events, bool) or not isinstance(events, int | np.integer) or events < 0):
            raise ArgumentError(
                f"events = {events!r} is not a number of impacts: a whole number of at least 0 is needed"
            )
        with native_errors():
            return self._engine.run(until, None if events is None else int(events))

    def checked_time(self, until: float) -> float:
        """Return `until` as a number if one can run to it. Raises ArgumentError."""
        try:
            checked = float(until)
        except (TypeError, ValueError):
            checked = math.nan
        if not math.isfinite(checked):
            raise ArgumentError(f"until = {until!r} is not a time: a finite number of seconds is needed")
        # The exact clock is time + time_low; the sum is compared without rounding it.
        time, time_low = self._engine.time
        if checked < time or (checked == time and time_low > 0):
            raise ArgumentError(
                f"until = {checked!r} s is in the past: the clock stands at {time!r} s and runs forward only"
            )
        return checked

    def step(self) -> Impact | None:
        """Run to the next impact and return it; None if there is none before the end of the scene's duration.

        Raises
        ------
        CollapseError
            As in `run`.
        """
        with native_errors():
            row = self._engine.step()
        return None if row is None else Impact.from_native(row)

    def state_sha256(self) -> str:
        """SHA-256 over the clock, the ids and the state of every body, by id: equal exactly if all bits are equal."""
        digest = hashlib.sha256(np.array(self._engine.time, "<f8").tobytes())
        digest.update(self.ids.astype("<i8").tobytes())
        for array in (self.positions, self.velocities, self.orientations, self.angular_velocities):
            digest.update(array.astype("<f8").tobytes())
        digest.update(self.images.astype("<i8").tobytes())
        return digest.hexdigest()

    def save(self, path: str | Path) -> None:
        """Write a checkpoint: a file to go on from, bit for bit. The recorded impacts are not part of it.

        Raises
        ------
        RunFolderError
            The file cannot be written.
        """
        self.save_beside(Path(path), str(self._scene.folder.absolute()))

    def save_beside(self, path: Path, folder: str) -> None:
        """Write a checkpoint whose imported files are in `folder`, relative to it. Raises RunFolderError."""
        scene = json.dumps({"scene": self._scene.to_dict(), "folder": folder})
        checkpoint.write(path, scene.encode(), self._engine.checkpoint(), __version__)

    @classmethod
    def from_checkpoint(cls, path: str | Path) -> Simulation:
        """Go on from a checkpoint that `save` or a run wrote.

        Raises
        ------
        RunFolderError
            The file cannot be read, is damaged, or is from a version whose checkpoints this one cannot read.
        SceneError
            A file that the scene imports is gone or has changed.
        """
        from carom.scene import Scene

        path = Path(path)
        text, state = checkpoint.read(path)
        content = json.loads(text)
        scene = Scene.from_dict(content["scene"], folder=path.parent / content["folder"])
        try:
            engine = scene.restore(state)
        except SceneError as error:
            raise RunFolderError(f"{path}: this checkpoint cannot be continued: {error}") from error
        simulation = cls.__new__(cls)
        simulation._begin(scene, engine)
        return simulation

    def __repr__(self) -> str:
        return f"<carom.Simulation of {len(self.ids)} bodies at {self.time!r} s after {self.impact_count} impacts>"
