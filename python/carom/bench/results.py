"""Telling what was measured: a table with its notes, and CSV files in a folder named after the machine."""

from __future__ import annotations

import csv
import io
import itertools
import os
import platform
import re
import subprocess
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom.files import naming, write_whole
from carom.run_folder import WrongFolderError
from carom.version import __version__

if TYPE_CHECKING:
    from carom.bench.cases import Case
    from carom.bench.measuring import Measured


def machine() -> str:
    """Model of the processor and number of cores, as the name of a folder."""
    name = re.sub(r"\((r|tm)\)", "", _processor().lower())
    cores = os.cpu_count() or 1
    return re.sub(r"[^a-z0-9]+", "-", f"{name} {cores} core{'s' * (cores > 1)}").strip("-")


def _processor() -> str:
    """The model of the processor, or its architecture where the system does not tell."""
    processors = Path("/proc/cpuinfo")
    if processors.exists():
        found = re.search(r"model name\s*:\s*(.+)", processors.read_text(encoding="utf-8"))
        return platform.machine() if found is None else found[1]
    if platform.system() == "Darwin":
        command = ["sysctl", "-n", "machdep.cpu.brand_string"]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    return platform.processor() or platform.machine()


def make_folder(out: Path | None) -> Path:
    """Make the folder for the results, if it is not there, and return it.

    Parameters
    ----------
    out
        The folder. None: benches/results/MACHINE in the checkout of Carom that one is in, or else
        carom-bench/MACHINE in the current folder.

    Raises
    ------
    WrongFolderError
        There is a file of that name.
    RunFolderError
        It cannot be made.
    """
    if out is None:
        here = Path.cwd()
        above = (here, *here.parents)
        checkout = next((folder for folder in above if (folder / "crates" / "carom" / "Cargo.toml").is_file()), None)
        results = "carom-bench" if checkout is None else Path(os.path.relpath(checkout), "benches", "results")
        out = Path(results, machine())
    if out.exists() and not out.is_dir():
        raise WrongFolderError(f"{out}: a file of that name is in the way; the results need a folder")
    with naming(out, "cannot make the folder"):
        out.mkdir(parents=True, exist_ok=True)
    return out


def write(folder: Path, files: dict[str, list[Case]], rows: list[Measured]) -> list[Path]:
    """Write the rows, which are in the order of the cases, as one CSV file for each name in `files`.

    Raises
    ------
    RunFolderError
        A file cannot be written.
    """
    paths = []
    rest = iter(rows)
    for name, cases in files.items():
        path = folder / f"{name}.csv"
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        of_file = [{**asdict(row), "carom": __version__} for row in itertools.islice(rest, len(cases))]
        writer.writerow(of_file[0])
        # Six digits are more than any of this repeats to.
        writer.writerows([f"{x:.6g}" if isinstance(x, float) else x for x in row.values()] for row in of_file)
        write_whole(path, text.getvalue())
        paths.append(path)
    return paths


def notes(cases: list[Case]) -> list[str]:
    """What a reader of the table has to know."""
    several = [
        "Collisions a second of the processor's time: the median of the windows; collisions with walls count.",
        "Settled: collisions of each ball before measuring. Set-up: the processor's time before the first event.",
        "Bytes a ball: by how much the process grew, what growing a dense fluid leaves behind included.",
    ]
    if any(case.compared for case in cases):
        equal = "elastic equal balls, as many and as densely packed, in a periodic box"
        several.append(f"Ratio: to {equal}; the two run in turn, window by window.")
    return list(dict.fromkeys([*several, *(case.note for case in cases if case.note)]))


def as_text(rows: list[Measured]) -> str:
    """The rows as a table; what none of them tells is left out."""
    from rich.console import Console
    from rich.table import Table

    lines = [
        {
            "": row.case,
            "balls": f"{row.balls:,}",
            "packing": f"{row.packing:.2f}",
            "settled": f"{row.settled:g}",
            "collisions/s": f"{row.rate:,.0f}",
            "lowest": f"{row.rate_lowest:,.0f}",
            "highest": f"{row.rate_highest:,.0f}",
            "ratio": "" if row.ratio is None else f"{row.ratio:.3f}",
            "bytes/ball": "" if row.bytes_per_ball is None else f"{row.bytes_per_ball:.0f}",
            "set-up s": f"{row.setup_seconds:.2f}",
            "energy error": f"{abs(row.energy_error):.1e}",
        }
        for row in rows
    ]
    table = Table(box=None, pad_edge=False)
    told = [name for name in lines[0] if any(line[name] for line in lines)]
    for name in told:
        table.add_column(name, justify="right" if name else "left")
    for line in lines:
        table.add_row(*(line[name] for name in told))
    text = io.StringIO()
    Console(file=text, width=200).print(table)
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines())


def as_json(rows: list[Measured], notes: list[str], paths: list[Path]) -> dict[str, Any]:
    """The same for machines."""
    return {
        "carom": __version__,
        "machine": machine(),
        "files": [str(path) for path in paths],
        "measured": [asdict(row) for row in rows],
        "notes": notes,
    }
