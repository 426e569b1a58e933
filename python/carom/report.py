"""The report of a run: one self-contained page with its replay, plots, ledger and impacts.

The page itself is built from `viewer/` and lies in `page/report.html`; here the data of a run is put into it.
"""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass, replace
from importlib import resources
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import impact_table
from carom.errors import CaromError
from carom.files import write_whole

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from carom.run_folder import RunFolder
    from carom.simulation import Simulation
    from carom.solids import Solids

PLACE_OF_DATA = "<!--CAROM-DATA-->"
MOST_BODIES = 20_000
"""More bodies than this are not replayed: a browser could not draw them smoothly."""
MOST_IMPACTS = 50_000
"""More impacts than this are not put into the page; the replay ends with the last one that is."""


class PageMissingError(CaromError):
    """The page template has not been built."""


@dataclass(frozen=True, eq=False)
class Start:
    """What a replay needs to know of a run's beginning."""

    time: float
    ids: NDArray[np.int64]
    radii: NDArray[np.float64]
    masses: NDArray[np.float64]
    fixed: NDArray[np.bool_]
    positions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    planes: list[dict[str, Any]]
    axes: list[str]
    size: list[float]
    solids: Solids | None = None
    """Shapes of the bodies, if they are not all balls; its rows are those of `ids`."""
    orientations: NDArray[np.float64] | None = None
    """With `angular_velocities`, if anything turns."""
    angular_velocities: NDArray[np.float64] | None = None

    @classmethod
    def of(cls, simulation: Simulation) -> Start:
        """Take down the state of a simulation that has not run yet."""
        solids = simulation.solids
        ball = ~simulation.is_plane
        if solids is not None:
            # Surroundings are drawn by themselves, as planes are.
            ball &= ~np.isin(simulation.ids, [mesh.id for mesh in solids.meshes])
            solids = replace(solids, geometry_of=solids.geometry_of[ball], moments=solids.moments[ball])
        spins = simulation.angular_velocities[ball]
        turning = solids is not None or bool(spins.any())
        place = dict(zip(simulation.ids.tolist(), simulation.positions, strict=True))
        planes: list[dict[str, Any]] = []
        for plane in simulation.planes:
            normal = [float(x) for x in plane["normal"]]
            # The page counts time from the start of the run; that is where the plane's row says it is.
            offset = float(np.dot(normal, place[plane["id"]])) if plane["id"] >= 0 else float(plane["offset"])
            planes.append(
                {
                    "id": int(plane["id"]),
                    "normal": normal,
                    "offset": offset,
                    "velocity": [float(x) for x in plane["velocity"]],
                    "wall": int(plane["id"]) < 0,
                }
            )
        return cls(
            time=simulation.time,
            ids=simulation.ids[ball],
            radii=simulation.radii[ball],
            masses=simulation.masses[ball],
            fixed=simulation.fixed[ball],
            positions=simulation.positions[ball],
            velocities=simulation.velocities[ball],
            planes=planes,
            axes=simulation.axes,
            size=[0.0 if length is None else length for length in simulation.size],
            solids=solids,
            orientations=simulation.orientations[ball] if turning else None,
            angular_velocities=spins if turning else None,
        )


def write(folder: RunFolder, *, start: Start | None = None) -> Path:
    """Write the report of a run into its folder and return its path.

    Parameters
    ----------
    folder
        The run.
    start
        How it began; left out, the scene is set up again to find out.

    Raises
    ------
    PageMissingError
        The page has not been built.
    RunFolderError
        Something in the folder cannot be read, or the report not be written.
    """
    page = template()
    # "</script>" inside the data would end it: every "<" is written as its escape.
    data = json.dumps(collect(folder, start=start), allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    before, after = page.split(PLACE_OF_DATA, 1)
    write_whole(folder.report, f'{before}<script type="application/json" id="carom-data">{data}</script>{after}')
    return folder.report


def template() -> str:
    """Return the page that the data goes into. Raises PageMissingError if it has not been built."""
    file = resources.files("carom").joinpath("page", "report.html")
    advice = "build it with `make page` in the project's folder, then write the report with `carom report RUN`"
    if not file.is_file():
        raise PageMissingError(f"{file}: the page of the report has not been built; {advice}")
    page = file.read_text(encoding="utf-8")
    if PLACE_OF_DATA not in page:
        raise PageMissingError(f"{file}: the page has no place for the data ({PLACE_OF_DATA}); {advice}")
    return page


def collect(folder: RunFolder, *, start: Start | None = None) -> dict[str, Any]:
    """Return the data of the page (format 1) as plain numbers, lists and base64 text."""
    if start is None:
        from carom.simulation import Simulation

        start = Start.of(Simulation(folder.scene))
    summary = folder.summary
    scene = folder.scene
    bodies = _bodies(start, scene.names)
    impacts, last = _impacts(folder, start.time)
    time_end = float(summary["time_end"])
    complete = impacts["count"] == summary["impacts"] and bodies["count"] == len(start.ids)
    return {
        "format": 1,
        "title": scene.title,
        "version": summary["carom"],
        "dimensions": scene.dimensions,
        "gravity": [float(x) for x in scene.gravity],
        "domain": {"axes": start.axes, "size": start.size},
        "time_start": start.time,
        "time_end": time_end,
        "replay_until": time_end if complete else max(start.time, last),
        "bodies": bodies,
        "planes": start.planes,
        **_shapes(start),
        "impacts": impacts,
        "series": _series(folder, start.time),
        "summary": summary,
    }


def _packed(array: NDArray[Any], dtype: str) -> str:
    return base64.b64encode(np.ascontiguousarray(array, dtype).tobytes()).decode("ascii")


def _bodies(start: Start, names: dict[int, str]) -> dict[str, Any]:
    shown = slice(0, len(start.ids) if len(start.ids) <= MOST_BODIES else 0)
    ids = start.ids[shown]
    return {
        "count": len(ids),
        "total": len(start.ids),
        "id": _packed(ids, "<i4"),
        "name": [names.get(int(body)) for body in ids] if names else None,
        "radius": _packed(start.radii[shown], "<f8"),
        "mass": _packed(start.masses[shown], "<f8"),
        "position": _packed(start.positions[shown], "<f8"),
        "velocity": _packed(start.velocities[shown], "<f8"),
        "fixed": _packed(start.fixed[shown], "u1"),
        **_turning(start, shown),
    }


def _turning(start: Start, shown: slice) -> dict[str, Any]:
    """How bodies stand and turn at the start; nothing if none does. A body of geometry −1 is a ball."""
    if start.orientations is None or start.angular_velocities is None:
        return {}
    count = len(start.ids)
    solids = start.solids
    return {
        "geometry": _packed(np.full(count, -1)[shown] if solids is None else solids.geometry_of[shown], "<i4"),
        "moments": _packed(np.ones((count, 3))[shown] if solids is None else solids.moments[shown], "<f8"),
        "orientation": _packed(start.orientations[shown], "<f8"),
        "angular_velocity": _packed(start.angular_velocities[shown], "<f8"),
    }


def _shapes(start: Start) -> dict[str, Any]:
    """The shapes, each once, and the surroundings; nothing where there are balls and planes only."""
    if start.solids is None:
        return {}
    meshes = [
        {
            "id": mesh.id,
            "vertices": _packed(mesh.vertices, "<f8"),
            "triangles": _packed(mesh.triangles, "<i4"),
            **{
                name: getattr(mesh, name).tolist()
                for name in ("position", "orientation", "velocity", "angular_velocity")
            },
        }
        for mesh in start.solids.meshes
    ]
    return {"geometries": [geometry.to_dict() for geometry in start.solids.geometries], "meshes": meshes}


def _impacts(folder: RunFolder, time_start: float) -> tuple[dict[str, Any], float]:
    """The first impacts of the run, and the time up to which they are complete."""
    chunks: list[dict[str, NDArray[Any]]] = []
    missing = MOST_IMPACTS
    for batch in folder.impact_batches():
        chunks.append(impact_table.columns(batch.slice(0, missing)))
        missing -= len(chunks[-1]["time"])
        if missing == 0:
            break
    columns = impact_table.joined(chunks)
    widths = {"a": "<i4", "b": "<i4", "kind": "u1", "certificate": "u1"}
    last = float(columns["time"][-1]) if len(columns["time"]) else time_start
    # Both parts of the clock count: the difference is small where the clock is large.
    columns["time"] = (columns["time"] - time_start) + columns["time_low"]
    return {
        "total": folder.summary["impacts"],
        "count": len(columns["time"]),
        "kinds": list(impact_table.KINDS),
        **{name: _packed(column, widths.get(name, "<f8")) for name, column in columns.items() if name != "time_low"},
    }, last


def _series(folder: RunFolder, time_start: float) -> dict[str, Any]:
    table = folder.series()
    names = ("kinetic_energy", "potential_energy", "dissipated", "work", "momentum", "energy_error")
    return {
        "time": [when - time_start for when in table.column("time").to_pylist()],
        **{name: table.column(name).to_pylist() for name in names},
    }
