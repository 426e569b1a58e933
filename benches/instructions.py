"""Instructions a collision, against what they were: the one measure of speed that does not depend on who else works.

    make instructions                       compares with benches/instructions.txt
    make instructions OPTIONS=--rewrite     writes that file anew

Three fluids of 10,000 balls are run under callgrind, which counts instructions; each twice, for two numbers of impacts,
so that setting up cancels in the difference. A count repeats to about one part in a million on one machine, with one
compiler. It says nothing of memory, which large fluids wait for; `carom bench` does. Callgrind also has to know the
instructions that it counts: where it lacks the widest ones of a processor, the simulator takes narrower ones.

Nothing here fails for being slow.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
from pathlib import Path

COUNT = 10_000
PACKINGS = (0.10, 0.30, 0.49)
IMPACTS = (50_000, 100_000)
"""After the first the balls have made ten collisions each, and nothing is left of the lattice that they start from."""
TOLERATED = 0.03
"""Part of the baseline up to which a change is not remarked on."""
BASELINE = Path(__file__).with_name("instructions.txt")
COUNTED_WITH = "# counted with "


def instructions(program: str, packing: float, impacts: int) -> int:
    """How many instructions a run takes, from its first to its last."""
    run = [program, str(COUNT), str(packing), str(impacts), "impacts"]
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", *run]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    counted = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode != 0 or counted is None:
        sys.exit(f"{' '.join(command)}\nended with {done.returncode}:\n{done.stderr}")
    return int(counted[1])


def instructions_per_collision(program: str, packing: float) -> int:
    """The same for one collision of a fluid, to the nearest."""
    fewer, more = (instructions(program, packing, impacts) for impacts in IMPACTS)
    return round((more - fewer) / (IMPACTS[1] - IMPACTS[0]))


def tools() -> str:
    """What a count depends on besides the code."""
    commands = (["rustc", "--version"], ["valgrind", "--version"], ["uname", "-m"])
    found = [subprocess.run(command, capture_output=True, text=True, check=False).stdout for command in commands]
    return ", ".join(text.strip() for text in found)


def read_baseline(path: Path) -> tuple[dict[float, int], str]:
    """Instructions a collision by packing, and what they were counted with."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    rows = [line.split() for line in lines if line and not line.startswith("#")]
    used = [line.removeprefix(COUNTED_WITH) for line in lines if line.startswith(COUNTED_WITH)]
    return {float(packing): int(count) for packing, count in rows}, "".join(used)


def write_baseline(path: Path, counts: dict[float, int]) -> None:
    """Write what was counted as what later counts are compared with."""
    lines = [
        f"# Instructions a collision of {COUNT:,} equal balls: packing, instructions. Made by benches/instructions.py.",
        COUNTED_WITH + tools(),
        *(f"{packing:.2f} {count}" for packing, count in counts.items()),
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def compared(count: int, baseline: int | None) -> str:
    """The part of a line that says what changed."""
    if baseline is None:
        return f"{'none':>9}"
    change = count / baseline - 1
    line = f"{baseline:9,} {change:+8.1%}"
    if change > TOLERATED:
        line += f"   <== MORE THAN {TOLERATED:.0%} SLOWER"
    elif change < -TOLERATED:
        line += "   faster: time for a new baseline (--rewrite)"
    return line


def main() -> None:
    """Count, compare, print."""
    parser = argparse.ArgumentParser(description="Instructions a collision, by callgrind.")
    parser.add_argument("program", help="the built example fluid_speed")
    parser.add_argument("--rewrite", action="store_true", help="make what is counted the baseline")
    parser.add_argument("--baseline", type=Path, default=BASELINE, help="default: %(default)s")
    arguments = parser.parse_args()
    if shutil.which("valgrind") is None:
        print("Left out: instructions a collision, because valgrind is not installed here.")
        return
    baseline, used = read_baseline(arguments.baseline)
    print(f"Instructions a collision of {COUNT:,} equal balls:")
    print(f"packing {'now':>9} {'baseline':>9} {'change':>8}")
    counts = {}
    for packing in PACKINGS:
        counts[packing] = instructions_per_collision(arguments.program, packing)
        print(f"{packing:7.2f} {counts[packing]:9,} {compared(counts[packing], baseline.get(packing))}", flush=True)
    if used and used != tools():
        print(f"The baseline was counted with {used}; this with {tools()}.")
    if arguments.rewrite:
        write_baseline(arguments.baseline, counts)
        print(f"These are the baseline now: {arguments.baseline}")


if __name__ == "__main__":
    main()
