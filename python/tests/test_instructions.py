"""`make instructions`: what it prints, and that it fails nothing for being slow."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "benches" / "instructions.py"

# Counts 1000 instructions to set up and 50 for each impact, whatever the fluid; its last two arguments are the number
# of impacts and the word "impacts".
VALGRIND = """#!/bin/sh
for word in "$@"; do [ "$word" = impacts ] || impacts=$word; done
echo "==1== Collected : $((1000 + 50 * impacts))" >&2
"""


def compare(*arguments: str | Path, path: str) -> str:
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "fluid_speed", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PATH": path},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def path(tmp_path: Path) -> str:
    """A PATH on which valgrind counts as above."""
    valgrind = tmp_path / "valgrind"
    valgrind.write_text(VALGRIND)
    valgrind.chmod(0o755)
    return f"{tmp_path}{os.pathsep}{os.environ['PATH']}"


def test_it_says_so_where_valgrind_is_not_installed(tmp_path: Path):
    assert "valgrind is not installed" in compare(path=str(tmp_path))


@pytest.mark.skipif(os.name == "nt", reason="a shell script of POSIX")
def test_more_than_three_per_cent_is_marked(tmp_path: Path, path: str):
    baseline = tmp_path / "instructions.txt"
    baseline.write_text("# a remark\n0.10 50\n0.30 49\n0.49 48\n")
    lines = compare("--baseline", baseline, path=path).splitlines()
    rows = {line.split()[0]: line.split(maxsplit=4) for line in lines[2:5]}
    assert rows["0.10"] == ["0.10", "50", "50", "+0.0%"]
    assert rows["0.30"] == ["0.30", "50", "49", "+2.0%"]
    assert rows["0.49"][:4] == ["0.49", "50", "48", "+4.2%"]
    assert "MORE THAN 3% SLOWER" in rows["0.49"][4]


@pytest.mark.skipif(os.name == "nt", reason="a shell script of POSIX")
def test_the_baseline_can_be_written_anew(tmp_path: Path, path: str):
    baseline = tmp_path / "instructions.txt"
    assert "none" in compare("--baseline", baseline, "--rewrite", path=path)
    assert [line for line in baseline.read_text().splitlines() if line[0] != "#"] == ["0.10 50", "0.30 50", "0.49 50"]
    assert "+0.0%" in compare("--baseline", baseline, path=path)
