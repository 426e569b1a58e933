"""What is measured: fluids of balls over sizes, packings and features, and for how long each is run.

Units: the smallest radius is 1/2 m, a ball of that radius has 1 kg, all have one density, and kT = 1 J at the start.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

PACKINGS = (0.10, 0.30, 0.49)
STANDARD_COUNT = 10_000
RADIUS = 0.5
DENSITY = 6 / math.pi
"""kg/m³: a ball of `RADIUS` has 1 kg."""
GROWN = 0.30
"""Above this packing a random fill has to grow its balls: that takes long, and so does forgetting it."""
MOST_GROWN = 20_000
"""More balls than these are not grown but tiled."""


@dataclass(frozen=True)
class Fluid:
    """Balls at random places in a cube that they fill to `packing`, with thermal velocities."""

    sizes: tuple[tuple[float, int], ...]
    """Radius, m, and number of balls of each size, the largest first: small ones find places between large ones."""
    packing: float
    restitution: float = 1.0
    """Below 1 the fluid begins as the settled elastic one."""
    walls: bool = False
    """Walls all around instead of a periodic box."""
    gravity: bool = False
    """Along -z, so strong that a ball of 1 kg has the energy kT more at the top of the cube than at its bottom."""
    impacts_recorded: bool = False
    tiles: int = 1
    """Above 1 the fluid begins as so many settled smaller ones along each axis, with velocities drawn anew."""

    @property
    def count(self) -> int:
        """Number of balls."""
        return sum(count for _, count in self.sizes)

    @property
    def side(self) -> float:
        """Of the cube, m."""
        tile = sum(4 / 3 * math.pi * radius**3 * count for radius, count in self.sizes) / self.packing / self.tiles**3
        return self.tiles * tile ** (1 / 3)

    @property
    def source(self) -> Fluid | None:
        """The fluid that has to settle before this one can begin from it; None if this one begins at random."""
        if self.restitution == 1 and self.tiles == 1:
            return None
        sizes = tuple((radius, count // self.tiles**3) for radius, count in self.sizes)
        return replace(self, sizes=sizes, restitution=1.0, tiles=1)

    @property
    def settling(self) -> float:
        """Collisions of each ball after which its start is forgotten as far as speed goes."""
        return 100 if self.packing > GROWN and self.tiles == 1 else 20

    def impacts(self, collisions: float) -> int:
        """Return how many impacts are so many collisions of each ball, two balls each."""
        return round(collisions * self.count / 2)

    def scene(self, **bodies: Any) -> dict[str, Any]:
        """Return the fields of its scene; its bodies, if none are given, are a random fill for each size."""
        fills = [
            {"count": count, "radius": radius, "density": DENSITY, "temperature": 1.0} for radius, count in self.sizes
        ]
        return {
            "duration": 1e9,
            "restitution": self.restitution,
            "gravity": [0, 0, -1 / self.side if self.gravity else 0],
            "domain": {"kind": "walls" if self.walls else "periodic", "size": [self.side] * 3},
            "output": {"frames": 0, "impacts": self.impacts_recorded},
            **(bodies or {"fill": fills}),
        }


@dataclass(frozen=True)
class Case:
    """A fluid and how it is measured."""

    name: str
    fluid: Fluid
    settle: float
    """Collisions of each ball before measuring."""
    windows: int
    window: int
    """Impacts in a window."""
    compared: bool = False
    """Whether it runs in turn with elastic equal balls of the same number and packing in a periodic box."""
    note: str = ""

    @property
    def runs(self) -> list[tuple[Fluid, int]]:
        """What is run in turn, this fluid first, and for how many impacts each settles before."""
        runs = [(self.fluid, self.fluid.impacts(self.settle))]
        if self.compared:
            equal = equal_balls(self.fluid.count, self.fluid.packing)
            runs.append((equal, equal.impacts(equal.settling)))
        return runs

    @property
    def impacts(self) -> int:
        """How many impacts it takes to measure this."""
        sources = [fluid.source for fluid, _ in self.runs]
        settle = sum(source.impacts(source.settling) for source in sources if source is not None)
        return settle + sum(settle + self.windows * self.window for _, settle in self.runs)


def equal_balls(count: int, packing: float) -> Fluid:
    """Elastic balls of one size in a periodic box."""
    tiles = 1
    while packing > GROWN and count > MOST_GROWN * tiles**3 and count % (2 * tiles) ** 3 == 0:
        tiles *= 2
    return Fluid(((RADIUS, count),), packing, tiles=tiles)


def standard_fluids(counts: tuple[int, ...] = (STANDARD_COUNT,), windows: int = 7, window: int = 200_000) -> list[Case]:
    """Equal balls of the given numbers at the three standard packings."""
    tiled = (
        f"Dense fluids of more than {MOST_GROWN:,} balls begin as an imported file: copies of a smaller settled one."
    )
    cases = []
    for count in counts:
        for packing in PACKINGS:
            fluid = equal_balls(count, packing)
            settle = fluid.settling if count <= 100_000 else 5
            note = tiled if fluid.tiles > 1 else ""
            cases.append(Case("equal balls", fluid, settle, windows, window, note=note))
    return cases


def features(count: int = STANDARD_COUNT, windows: int = 7, window: int = 50_000) -> list[Case]:
    """What else a scene may ask for, one thing at a time, at the three standard packings."""
    before, while_measured = 2, 10
    cools = (
        f"e = 0.9: the settled elastic fluid, for {before + while_measured} collisions of each ball: it cools, and in"
        " time would grow vortices and clusters."
    )
    falls = "Gravity: between walls, m g L = kT for the box's height L."
    cases = []
    for packing in PACKINGS:
        equal = equal_balls(count, packing)
        lossy, short = replace(equal, restitution=0.9), equal.impacts(while_measured) // windows
        cases.append(Case("e = 0.9", lossy, before, windows, short, compared=True, note=cools))
        others = {
            "walls": replace(equal, walls=True),
            "gravity": replace(equal, walls=True, gravity=True),
            "impacts recorded": replace(equal, impacts_recorded=True),
        }
        for name, fluid in others.items():
            note = falls if fluid.gravity else ""
            cases.append(Case(name, fluid, fluid.settling, windows, window, compared=True, note=note))
    return cases


def mixtures(small: int = 100_000, windows: int = 7, window: int = 50_000) -> list[Case]:
    """Balls of two sizes and one density; where they are 1:3 there are `STANDARD_COUNT` in all."""
    half = STANDARD_COUNT // 2
    fluids = {
        "radii 1:3": Fluid(((3 * RADIUS, half), (RADIUS, half)), 0.45),
        "radii 1:10": Fluid(((10 * RADIUS, small // 1_000), (RADIUS, small)), 0.30),
        "radii 1:100": Fluid(((100 * RADIUS, 1), (RADIUS, small)), 0.30),
    }
    note = (
        "Mixtures: of one density. 1:3, half of the balls are large; 1:10, both sizes have the same volume;"
        f" 1:100, one ball is large, of {1e6 / small:g} times the volume of all small ones."
    )
    return [
        Case(name, fluid, fluid.settling, windows, window, compared=True, note=note) for name, fluid in fluids.items()
    ]


def full(*, large: bool = False) -> dict[str, list[Case]]:
    """Everything, by the file that it goes to; fluids of a million balls only if `large`."""
    counts = (1_000, STANDARD_COUNT, 100_000, *((1_000_000,) if large else ()))
    return {"fluids": standard_fluids(counts), "features": features() + mixtures()}


def quick() -> dict[str, list[Case]]:
    """The three standard fluids."""
    return {"quick": standard_fluids()}
