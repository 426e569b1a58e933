"""Ten million impacts of a cube and a 1 x 2 x 3 box in a periodic box: energy, momentum and overlaps.

    python validation/two_boxes.py            in some ten minutes
    python validation/two_boxes.py --quick    a hundredth of the impacts, in seconds

Two bodies alone: nothing averages out, and whatever impacts did wrong would add up in them. (Averages over time are of
little use here: now and then the two pass each other along an axis of the periodic box, a thousand times over.)
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
from numpy.typing import NDArray
from platonic_gas import drift, print_drift

import carom

IMPACTS, LOOKS = 10_000_000, 20_000
ALLOWED = 1e-11
SCENE = {
    "duration": 1.0,
    "domain": {"kind": "periodic", "size": [9.0, 9.0, 9.0]},
    "body": [
        {
            "shape": {"kind": "box", "size": [1.0, 1.0, 1.0]},
            "density": 1.0,
            "position": [-1.6, 0.3, -0.2],
            "velocity": [1.5, -0.75, 0.6],
            "angular_velocity": [0.9, 2.1, -1.3],
        },
        {
            "shape": {"kind": "box", "size": [1.0, 2.0, 3.0]},
            "density": 1.0,
            "position": [1.4, -0.1, 0.4],
            "velocity": [-0.25, 0.125, -0.1],
            "angular_velocity": [-0.4, 0.5, 0.3],
        },
    ],
}


def tenths(course: NDArray[np.float64]) -> NDArray[np.float64]:
    """Ten numbers of a long row, the last of each tenth."""
    return course[np.arange(1, 11) * len(course) // 10 - 1]


def main() -> None:
    """Print what came out; exit with 1 if anything is off."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a hundredth of the impacts and of the looks")
    part = 100 if parser.parse_args().quick else 1
    got = drift(carom.Scene.from_dict(SCENE), IMPACTS // part, LOOKS // part)
    print(f"A cube and a box in a periodic box: {got.impacts} impacts in {got.seconds:.0f} s.")
    print_drift(got, ALLOWED)
    print("after each tenth of the impacts: energy", *(f"{error:.0e}" for error in tenths(got.errors[:, 0])))
    print("                               momentum", *(f"{error:.0e}" for error in tenths(got.errors[:, 1])))
    if got.errors.max() > ALLOWED or got.overlap > 1 or abs(got.contacts).max() > 1:
        sys.exit("The run drifted, or the two overlapped.")


if __name__ == "__main__":
    main()
