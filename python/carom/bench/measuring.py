"""Measuring: collisions a second of the processor's time, memory, set-up.

Each case has a process of its own, so that its memory can be told and nothing is left of the case before. What a case
is compared with runs in turn with it, window by window: a machine whose speed drifts is as slow for the one as for the
other.
"""

from __future__ import annotations

import multiprocessing
import re
import signal
import statistics
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.bench.cases import equal_balls
from carom.errors import CaromError
from carom.recording import Progress
from carom.scene import Scene
from carom.simulation import Simulation

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection

    from numpy.typing import NDArray

    from carom.bench.cases import Case, Fluid

FEWEST_FOR_MEMORY = 10_000
"""With fewer balls their memory is lost in that of the interpreter."""


class MeasurementError(CaromError):
    """A case could not be measured: its process ended before it."""


@dataclass(frozen=True)
class Measured:
    """What a case gave, a row of the table. Rates are in collisions a CPU second."""

    case: str
    balls: int
    packing: float
    settled: float
    """Collisions of each ball before measuring."""
    windows: int
    window_collisions: int
    rate: float
    """The median of the windows."""
    rate_lowest: float
    rate_highest: float
    equal_rate: float | None
    """Of the equal balls with which this ran in turn; None if it ran alone."""
    ratio: float | None
    """`rate` / `equal_rate`."""
    bytes_per_ball: float | None
    """By how much setting up and settling made the process grow; None where that cannot be told."""
    setup_seconds: float
    """CPU time from the scene's fields to a simulation ready to run, s."""
    energy_error: float
    """That of the ledger at the end."""


def measure(cases: list[Case], progress: Callable[[Progress], None] | None = None) -> list[Measured]:
    """Measure one case after the other, each in a process of its own.

    Raises
    ------
    MeasurementError
        A process came to an end before its case was measured: killed, perhaps because memory ran out.
    """
    total = sum(case.impacts for case in cases)
    done = 0

    def advance(impacts: int) -> None:
        nonlocal done
        done += impacts
        if progress is not None:
            progress(Progress(time=0.0, impacts=done, fraction=done / total))

    return [_measure_apart(case, advance) for case in cases]


def _measure_apart(case: Case, advance: Callable[[int], None]) -> Measured:
    """Measure in another process, which tells how many impacts it has done and, last, what it measured."""
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send_measured, args=(case, sender), daemon=True)
    process.start()
    sender.close()
    try:
        while isinstance(told := receiver.recv(), int):
            advance(told)
    except EOFError:
        process.join()
        raise MeasurementError(
            f"{case.name}, {case.fluid.count:,} balls at packing {case.fluid.packing}: the process that measured it"
            f" ended with {process.exitcode}"
        ) from None
    else:
        return told
    finally:
        process.terminate()
        process.join()
        receiver.close()


def _send_measured(case: Case, sender: Connection) -> None:
    # A terminal sends Ctrl-C here too; whoever started this ends it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sender.send(_measured(case, sender.send))


def _measured(case: Case, advance: Callable[[int], None]) -> Measured:
    """Measure in this process."""
    _warm_up()
    memory = _resident_memory()
    simulations: list[Simulation] = []
    setup_seconds: list[float] = []
    grown: list[int] = []
    for fluid, settle in case.runs:
        simulation, seconds = _begin(fluid, advance)
        _advance(simulation, settle, advance)
        simulations.append(simulation)
        setup_seconds.append(seconds)
        grown.append(_resident_memory() - memory)
    rates: list[list[float]] = [[] for _ in simulations]
    resolution = time.get_clock_info("process_time").resolution
    for _ in range(case.windows):
        for simulation, of_windows in zip(simulations, rates, strict=True):
            of_windows.append(case.window / max(_advance(simulation, case.window, advance), resolution))
    rate = statistics.median(rates[0])
    equal_rate = statistics.median(rates[1]) if case.compared else None
    # A fluid that began from another first fills the memory that the other left, and rows of impacts are no ball's.
    told = case.fluid.count >= FEWEST_FOR_MEMORY and case.fluid.source is None and not case.fluid.impacts_recorded
    return Measured(
        case=case.name,
        balls=case.fluid.count,
        packing=case.fluid.packing,
        settled=case.settle,
        windows=case.windows,
        window_collisions=case.window,
        rate=rate,
        rate_lowest=min(rates[0]),
        rate_highest=max(rates[0]),
        equal_rate=equal_rate,
        ratio=None if equal_rate is None else rate / equal_rate,
        bytes_per_ball=grown[0] / case.fluid.count if memory > 0 and told else None,
        setup_seconds=setup_seconds[0],
        energy_error=simulations[0].ledger.energy_error,
    )


def _begin(fluid: Fluid, advance: Callable[[int], None]) -> tuple[Simulation, float]:
    """The fluid at its start, and the CPU time that setting it up took, s."""
    if fluid.source is None:
        start = time.process_time()
        simulation = Simulation(Scene.from_dict(fluid.scene()))
        return simulation, time.process_time() - start
    settled, _ = _begin(fluid.source, advance)
    _advance(settled, fluid.source.impacts(fluid.source.settling), advance)
    with tempfile.TemporaryDirectory() as folder:
        file = "settled.gsd"
        _write_tiled(settled, fluid, Path(folder, file))
        del settled
        start = time.process_time()
        simulation = Simulation(Scene.from_dict(fluid.scene(**{"import": [{"file": file}]}), folder))
        return simulation, time.process_time() - start


def _write_tiled(settled: Simulation, fluid: Fluid, path: Path) -> None:
    """Write the balls of `settled`, once for each tile of `fluid`."""
    import gsd.hoomd

    tiles = fluid.tiles
    corners = np.indices((tiles, tiles, tiles)).reshape(3, -1).T - (tiles - 1) / 2
    positions = settled.positions + corners[:, None, :] * (fluid.side / tiles)
    masses = np.tile(settled.masses, tiles**3)
    velocities = settled.velocities if tiles == 1 else _thermal_velocities(masses)
    frame: Any = gsd.hoomd.Frame()
    frame.particles.N = len(masses)
    frame.log = {
        # Logged, because GSD's own columns are of single precision.
        "particles/position": positions.reshape(-1, 3),
        "particles/velocity": velocities,
        "particles/radius": np.tile(settled.radii, tiles**3),
        "particles/mass": masses,
    }
    with gsd.hoomd.open(str(path), "w") as file:
        file.append(frame)


def _thermal_velocities(masses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Velocities at kT = 1 J without total momentum, (n, 3), m/s. Copies with the same ones would collide in step."""
    momenta = np.random.default_rng(1).normal(size=(len(masses), 3)) * np.sqrt(masses)[:, None]
    return momenta / masses[:, None] - momenta.sum(axis=0) / masses.sum()


def _advance(simulation: Simulation, impacts: int, advance: Callable[[int], None]) -> float:
    """Run for so many impacts and hand over what they recorded; the CPU time of that, s."""
    start = time.process_time()
    simulation.run(events=impacts)
    simulation.take_impacts()
    seconds = time.process_time() - start
    advance(impacts)
    return seconds


def _warm_up() -> None:
    """Have everything loaded that a simulation needs."""
    Simulation(Scene.from_dict(equal_balls(100, 0.10).scene())).run(events=1_000)


def _resident_memory() -> int:
    """Memory of this process, bytes; 0 where the system does not tell it as Linux does."""
    status = Path("/proc/self/status")
    found = re.search(r"VmRSS:\s+(\d+) kB", status.read_text()) if status.exists() else None
    return 0 if found is None else 1024 * int(found[1])
