"""The command `carom`.

Exit status: 0 done, 1 the run failed, 2 the input was wrong, 130 interrupted. Messages go to standard error, results to
standard output; with `--json` a result is one JSON object.
"""

from __future__ import annotations

import contextlib
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import App, CycloptsError, Parameter
from rich.console import Console

from carom.errors import CaromError, CollapseError, RunFolderError, SceneError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from carom.recording import Progress
    from carom.run_folder import RunFolder
    from carom.scene import Scene

DONE, FAILED, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130

_errors = Console(stderr=True, soft_wrap=True, highlight=False, markup=False, emoji=False)


def _version() -> str:
    from carom.version import __version__

    return __version__


app = App(
    name="carom",
    help="Exact event-driven simulation of rigid bodies that fly and collide.",
    version=_version,
    error_console=_errors,
)

SceneName = Annotated[str, Parameter(help="A scene file (TOML or JSON), or the name of a scene that comes with Carom.")]
RunPath = Annotated[Path, Parameter(help="A run folder.")]
Set = Annotated[
    list[str] | None,
    Parameter(
        name="--set",
        help="Another value for a field of the scene, as in `--set body.heavy.mass=10000`; may be given several times.",
        negative=(),
    ),
]
Json = Annotated[bool, Parameter(name="--json", help="Print one JSON object, for machines.", negative=())]


class _WrongInputError(CaromError):
    """What was typed cannot be meant."""


@app.command
def run(
    scene: SceneName,
    /,
    *,
    out: Path | None = None,
    until: float | None = None,
    impacts: int | None = None,
    threads: int = 1,
    set_: Set = None,
    force: Annotated[bool, Parameter(negative=())] = False,
    json_: Json = False,
) -> int:
    """Run a scene and write its run folder.

    Parameters
    ----------
    out
        The run folder. Left out: runs/NAME, or runs/NAME-2 and so on if that is there.
    until
        Time at which to stop, s, on the scene's clock. Left out: the end of the scene's duration.
    impacts
        Number of impacts after which to stop, if the time does not come first.
    threads
        How many threads Carom may use. The result is the same for any number.
    force
        Replace the run that is in OUT.
    """
    from carom.recording import run as write_run
    from carom.run_folder import choose_folder

    loaded, name = _load(scene, set_)
    path = choose_folder(name) if out is None else out
    with _progress_bar(loaded.title or name, quiet=json_) as progress, _telling_where(path):
        folder = write_run(loaded, path, until=until, impacts=impacts, threads=threads, force=force, progress=progress)
    _print_run(folder, json_)
    return DONE


@app.command
def resume(
    run: RunPath,
    /,
    *,
    until: float | None = None,
    impacts: int | None = None,
    threads: int = 1,
    json_: Json = False,
) -> int:
    """Go on with a run from its checkpoint; the result is that of a run never interrupted.

    Parameters
    ----------
    until
        Time at which to stop, s, on the scene's clock. Left out: the one the run was asked for.
    impacts
        Number of impacts, from the start of the run, after which to stop.
    threads
        How many threads Carom may use. The result is the same for any number.
    """
    from carom.recording import resume as go_on

    with _progress_bar(run.name, quiet=json_) as progress, _telling_where(run):
        folder = go_on(run, until=until, impacts=impacts, threads=threads, progress=progress)
    _print_run(folder, json_)
    return DONE


@contextlib.contextmanager
def _telling_where(path: Path) -> Iterator[None]:
    """Whatever ends a run early, say where what there is has been written."""
    try:
        yield
    except CollapseError:
        _errors.print(f"The state of the last valid event is in {path}.")
        raise
    except KeyboardInterrupt:
        if (path / "summary.json").exists():
            _errors.print(f"Interrupted. What there is so far is in {path}; `carom resume {path}` goes on.")
        raise


def _print_run(folder: RunFolder, as_json: bool) -> None:
    summary = folder.summary
    _notes(summary["notes"])
    if as_json:
        _print_json({"folder": str(folder.path), **summary})
        return
    ledger = summary["ledger"]
    seconds = summary["timings"]["simulate_seconds"]
    count = summary["impacts"]
    lines = [
        f"{count:,} impact{'s' if count != 1 else ''} of {summary['bodies']:,} bodies"
        f" from {summary['time_start']:g} s to {summary['time_end']:g} s, computed in {seconds:.3g} s",
        f"energy: {ledger['kinetic_energy']:.6g} J kinetic, {ledger['potential_energy'] + 0.0:.6g} J potential,"
        f" {ledger['dissipated']:.6g} J lost at impacts; the ledger closes to {abs(ledger['energy_error']):.1e}",
    ]
    asked = summary["asked"]["impacts"]
    if asked is not None and summary["impacts"] < asked:
        lines.append(
            f"{asked:,} impacts were asked for: the time ended first, at {summary['time_end']:g} s;"
            " --until sets another"
        )
    lines.append(f"run folder: {folder.path}")
    if folder.report.exists():
        lines.append(f"look at it: {folder.report}")
    _print("\n".join(lines))


@app.command
def check(scene: SceneName, /, *, set_: Set = None, json_: Json = False) -> int:
    """Check a scene as far as can be without running it: fields, values, overlaps."""
    from carom.simulation import Simulation

    loaded, name = _load(scene, set_)
    simulation = Simulation(loaded)
    ledger = simulation.ledger
    if json_:
        _print_json(
            {
                "scene": scene,
                "title": loaded.title,
                "bodies": len(simulation.ids),
                "duration": loaded.duration,
                "ledger": ledger.to_dict(),
                "rules": simulation.rules,
                "notes": simulation.notes,
            }
        )
        return DONE
    _notes(simulation.notes)
    _print(
        f"{loaded.title or name}: no problem found\n"
        f"{len(simulation.ids):,} bodies for {loaded.duration:g} s;"
        f" energy {ledger.kinetic_energy:.6g} J kinetic, {ledger.potential_energy:.6g} J potential"
    )
    return DONE


@app.command
def explain(scene: SceneName, /, *, impact: int = 1, set_: Set = None, json_: Json = False) -> int:
    """Walk through one impact of a scene, step by step as in the notes, with its numbers.

    Parameters
    ----------
    impact
        Which impact, counted from 1.
    """
    from carom import explain as explanation

    loaded, _ = _load(scene, set_)
    numbers = explanation.impact_of(loaded, impact)
    if json_:
        _print_json(numbers)
    else:
        _print(explanation.as_text(numbers).rstrip("\n"))
    return DONE


@app.command
def report(run: RunPath, /, *, json_: Json = False) -> int:
    """Write the report of a run again: one page with replay, plots, ledger and impacts."""
    from carom import report as page
    from carom.run_folder import RunFolder

    path = page.write(RunFolder.open(run))
    _print_result(str(path), {"report": str(path)}, json_)
    return DONE


@app.command
def view(
    what: Annotated[str, Parameter(help="A run folder; or a scene, which is run first.")],
    /,
    *,
    open_: Annotated[
        bool, Parameter(name="--open", help="Open the page in the browser, or only print its path.")
    ] = True,
    set_: Set = None,
    json_: Json = False,
) -> int:
    """Look at a run, or run a scene and look at it, in the browser."""
    from carom import report as page
    from carom.recording import run as write_run
    from carom.run_folder import RunFolder, choose_folder, is_run_folder

    if is_run_folder(Path(what)):
        folder = RunFolder.open(what)
    elif Path(what).is_dir():
        raise _WrongInputError(f"{what}: not a run folder")
    else:
        loaded, name = _load(what, set_)
        with _progress_bar(loaded.title or name, quiet=json_) as progress:
            folder = write_run(loaded, choose_folder(name), progress=progress)
    _notes(folder.summary["notes"])
    path = folder.report if folder.report.exists() else page.write(folder)
    _print_result(str(path), {"report": str(path), "folder": str(folder.path)}, json_)
    if open_:
        import webbrowser

        webbrowser.open(path.absolute().as_uri())
    return DONE


@app.command
def export(
    run: RunPath, /, *, to: Literal["parquet", "csv", "extxyz"], out: Path | None = None, json_: Json = False
) -> int:
    """Write the impacts of a run as Parquet or CSV, or its frames as extended XYZ.

    Parameters
    ----------
    to
        Format.
    out
        File to write. Left out: impacts.parquet, impacts.csv or frames.extxyz in the run folder.
    """
    from carom import export as exports
    from carom.run_folder import RunFolder

    path = exports.export(RunFolder.open(run), to, out)
    _print_result(str(path), {"file": str(path), "format": to}, json_)
    return DONE


@app.command
def replay(
    run: RunPath,
    /,
    *,
    verify: Annotated[bool, Parameter(help="Compare bit by bit with what was recorded.", negative=())] = False,
    json_: Json = False,
) -> int:
    """Run the scene of a run folder again and compare with what was recorded, bit by bit."""
    from carom import replay as replays
    from carom.run_folder import RunFolder

    if not verify:
        raise _WrongInputError("replay does one thing so far: say --verify to compare; `carom view RUN` shows the run")
    verdict = replays.verify(RunFolder.open(run))
    if json_:
        _print_json(verdict.__dict__)
    elif verdict.same:
        _print(f"The same bits: {verdict.impacts:,} impacts and the final state.")
    if not verdict.same:
        _errors.print(f"Not the same: {verdict.difference}")
    return DONE if verdict.same else FAILED


@app.command
def bench(
    *,
    quick: Annotated[bool, Parameter(negative=())] = False,
    large: Annotated[bool, Parameter(negative=())] = False,
    out: Path | None = None,
    json_: Json = False,
) -> int:
    """Measure how fast Carom is here, in minutes: fluids of many sizes and densities, and what features cost.

    Parameters
    ----------
    quick
        Only the three standard fluids, 10,000 balls at packing 0.10, 0.30 and 0.49, in less than a minute.
    large
        Also fluids of a million balls.
    out
        Folder for the CSV files. Left out: benches/results/MACHINE of the checkout of Carom that one is in, or
        carom-bench/MACHINE in the current folder; MACHINE says which processor and how many cores.
    """
    from carom.bench import cases, measuring, results

    if quick and large:
        raise _WrongInputError("--quick and --large: one or the other")
    files = cases.quick() if quick else cases.full(large=large)
    folder = results.make_folder(out)
    planned = [case for of_file in files.values() for case in of_file]
    with _progress_bar("bench", quiet=json_) as progress:
        measured = measuring.measure(planned, progress)
    paths = results.write(folder, files, measured)
    notes = results.notes(planned)
    lines = [results.as_text(measured), "", *notes, "", *(f"written: {path}" for path in paths)]
    _print_result("\n".join(lines), results.as_json(measured, notes, paths), json_)
    return DONE


@app.command
def schema() -> int:
    """Print the JSON Schema of scene files."""
    from carom.scene import Scene

    _print_json(Scene.json_schema())
    return DONE


def _load(scene: str, changes: list[str] | None) -> tuple[Scene, str]:
    """The scene that is meant, and a name for its run."""
    from carom import shipped
    from carom.scene import Scene

    path = shipped.find(scene)
    loaded = Scene.load(path)
    if changes:
        loaded = loaded.changed(dict(_change(text) for text in changes))
    return loaded, path.stem


def _change(text: str) -> tuple[str, Any]:
    """`body.heavy.mass=100` as name and value; the value is written as in TOML, and text may do without quotes."""
    import tomllib

    name, equals, value = text.partition("=")
    if not equals or not name.strip():
        raise _WrongInputError(f"--set {text}: NAME=VALUE is needed, as in --set duration=3")
    try:
        parsed = tomllib.loads(f"value = {value}")["value"]
    except (tomllib.TOMLDecodeError, KeyError):
        parsed = value.strip()
    return name.strip(), parsed


@contextlib.contextmanager
def _progress_bar(title: str, *, quiet: bool) -> Iterator[Callable[[Progress], None] | None]:
    """A bar on standard error if a person watches."""
    if quiet or not _errors.is_terminal:
        yield None
        return
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    with Bar(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %  {task.fields[impacts]:,} impacts"),
        TimeRemainingColumn(),
        console=_errors,
        transient=True,
    ) as bar:
        task = bar.add_task(title, total=1.0, impacts=0)
        yield lambda progress: bar.update(task, completed=progress.fraction, impacts=progress.impacts)


def _notes(notes: list[str]) -> None:
    for note in notes:
        _errors.print(f"note: {note}")


def _print(text: str) -> None:
    sys.stdout.write(text + "\n")


def _print_json(content: object) -> None:
    _print(json.dumps(content, indent=2, allow_nan=False))


def _print_result(text: str, content: dict[str, Any], as_json: bool) -> None:
    if as_json:
        _print_json(content)
    else:
        _print(text)


def main(arguments: list[str] | None = None) -> int:
    """Run the command and return its exit status."""
    as_json = "--json" in (sys.argv[1:] if arguments is None else arguments)
    try:
        status = app(arguments, exit_on_error=False, print_error=True, result_action="return_value")
        sys.stdout.flush()
    except CycloptsError:
        return WRONG_INPUT
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # Whoever read our output (`| head`) has seen enough. Nothing more must be written, not even at exit.
        sys.stdout = None
        return DONE
    except CaromError as error:
        _tell(error, as_json)
        return FAILED if _failed(error) else WRONG_INPUT
    return status if isinstance(status, int) else DONE


def _failed(error: CaromError) -> bool:
    """Whether the run is to blame, not what was asked for."""
    from carom.bench.measuring import MeasurementError
    from carom.report import PageMissingError
    from carom.run_folder import WrongFolderError

    return isinstance(error, CollapseError | MeasurementError | PageMissingError | RunFolderError) and not isinstance(
        error, WrongFolderError
    )


def _tell(error: CaromError, as_json: bool) -> None:
    if as_json:
        content: dict[str, Any] = {"error": type(error).__name__, "message": str(error)}
        if isinstance(error, SceneError):
            content["problems"] = [_problem(problem) for problem in error.problems]
        elif isinstance(error, CollapseError):
            content |= {"bodies": error.bodies, "time": error.time, "cause": error.cause, "advice": error.advice}
        _print_json(content)
    _errors.print(f"error: {error}")


def _problem(problem: Any) -> dict[str, Any]:
    from carom.errors import ABSENT

    fields = {name: getattr(problem, name) for name in ("file", "line", "field", "value", "reason", "who")}
    if fields["value"] is ABSENT:
        del fields["value"]
    # A value may be what JSON does not know: infinity, a date.
    return json.loads(json.dumps(fields, default=str).replace("NaN", '"nan"'))


if __name__ == "__main__":
    sys.exit(main())
