"""Every example runs as a reader would run it, and says what it promises to say."""

import math
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def run_script(script: Path, *arguments: str) -> str:
    """Run a script in a Python of its own; its standard output."""
    environment = {**os.environ, "PYTHONWARNINGS": "error"}
    done = subprocess.run(
        [sys.executable, str(script), *arguments],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def numbers(text: str) -> list[float]:
    return [float(word) for word in re.findall(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?", text)]


def check_two_balls(output: str) -> None:
    # They touch when (2 - t)^2 + 0.25 = 1: t = 2 - sqrt(3)/2, and n = (-sqrt(3)/2, -1/2, 0).
    meets, parts, impulse = output.splitlines()[:3]
    assert f"{2 - math.sqrt(3) / 2:.14f}"[:-1] in meets
    # Approach sqrt(3)/2, parting half of it (e = 1/2), impulse (1 + e) sqrt(3)/2 / (1 + 1/2); printed to 15 digits.
    assert numbers(parts)[:2] == pytest.approx([math.sqrt(3) / 2, math.sqrt(3) / 4], abs=2e-15)
    assert numbers(impulse)[0] == pytest.approx(math.sqrt(3) / 2, abs=2e-15)


def check_pi_collisions(output: str) -> None:
    counts = [int(count) for count in re.findall(r"(\d+) impacts \(theory", output)]
    assert counts == [3, 31, 314, 3141, 31415]


def check_gas_pressure(output: str) -> None:
    measured, theory = map(float, re.findall(r"pV/NkT = ([\d.]+), Carnahan-Starling gives ([\d.]+)", output)[0])
    # 1e5 impacts of 500 balls: a statistical error of some 0.3 %, finite size 0.2 %; six times both.
    assert measured == pytest.approx(theory, rel=0.02)


def check_own_file(output: str) -> None:
    balls, impacts = map(int, re.findall(r"(\d+) balls, (\d+) impacts", output)[0])
    assert balls == 64
    assert impacts > 100


CHECKS = {
    "two_balls.py": check_two_balls,
    "pi_collisions.py": check_pi_collisions,
    "gas_pressure.py": check_gas_pressure,
    "own_file.py": check_own_file,
}


def test_every_example_is_checked():
    assert sorted(path.name for path in (ROOT / "examples").glob("*.py")) == sorted(CHECKS)


@pytest.mark.parametrize("name", sorted(CHECKS))
def test_example(name: str):
    CHECKS[name](run_script(ROOT / "examples" / name))


def test_readme_program():
    """The ten lines of Python in the README run."""
    (program,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), flags=re.DOTALL)
    environment = {**os.environ, "PYTHONWARNINGS": "error"}
    subprocess.run([sys.executable, "-c", program], cwd=ROOT, env=environment, check=True, timeout=120)


def test_known_answers():
    """The row of ours in the README's comparison."""
    output = run_script(ROOT / "validation" / "known_answers.py")
    errors = {line[0]: float(re.findall(r"off by ([-+.e\d]+)", line)[0]) for line in output.splitlines()}
    # A: 22 bounces, each rounding the height and the speed once: some 50 epsilon. B and C: exact products of 1 and 2.
    # D: the energy is a random walk of rounding over some thousand impacts.
    assert errors["A"] <= 2e-14
    assert errors["B"] <= 4e-16
    assert errors["C"] <= 4e-15
    assert errors["D"] <= 1e-13
