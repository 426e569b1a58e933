"""Draw the picture of the README: the paths of the pool break, from its impacts. To be run in the repository's root."""

from pathlib import Path

import numpy as np

import carom

UNTIL = 2.0  # s
SCALE = 400  # picture units a metre
COLOURS = ["#f4f1de"] + ["#e9c46a", "#4f86c6", "#e76f51", "#9b72cf", "#f4a261", "#57a773", "#b5563c", "#d8b4e2"] * 2


def paths(simulation: carom.Simulation) -> dict[int, list[np.ndarray]]:
    """The corners of each ball's path until `UNTIL`: where it starts, each of its impacts, where it ends."""
    balls = ~simulation.is_plane
    radius = dict(zip(simulation.ids, simulation.radii, strict=True))
    corners = {int(i): [x] for i, x in zip(simulation.ids[balls], simulation.positions[balls], strict=True)}
    simulation.run(until=UNTIL)
    for impact in simulation.impacts:
        for body, side in ((int(impact["a"]), 1.0), (int(impact["b"]), -1.0)):
            if body in corners:
                # The normal points from B to A, so the centre of A lies along it from the point of contact.
                corners[body].append(impact["point"] + side * radius[body] * impact["normal"])
    for i, x in zip(simulation.ids[balls], simulation.positions[balls], strict=True):
        corners[int(i)].append(x)
    return corners


def main() -> None:
    """Write docs/pictures/pool_break.svg."""
    scene = carom.Scene.load("scenes/pool_break.toml")
    simulation = carom.Simulation(scene)
    width, height = (scene.to_dict()["domain"]["size"][axis] * SCALE for axis in (0, 1))
    radius = float(np.nanmin(simulation.radii)) * SCALE
    corners = paths(simulation)

    def at(x: np.ndarray) -> tuple[float, float]:
        return x[0] * SCALE + width / 2, height / 2 - x[1] * SCALE

    edge = 24
    outer = f'width="{width + 2 * edge:g}" height="{height + 2 * edge:g}"'
    title = f"A pool break: the paths of {len(corners)} balls over {UNTIL:g} s, {len(simulation.impacts)} impacts"
    box = f"{-edge} {-edge} {width + 2 * edge:g} {height + 2 * edge:g}"
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}">',
        f"<title>{title}</title>",
        f'<rect x="{-edge}" y="{-edge}" {outer} rx="16" fill="#4a2f1b"/>',
        f'<rect width="{width:g}" height="{height:g}" rx="3" fill="#1f5c4a"/>',
        '<g fill="none" stroke-width="2" stroke-opacity="0.75" stroke-linejoin="round">',
    ]
    coloured = [(path, COLOURS[k % len(COLOURS)]) for k, (_, path) in enumerate(sorted(corners.items()))]
    for path, colour in coloured:
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(at, path))
        lines.append(f'<polyline points="{points}" stroke="{colour}"/>')
        x, y = at(path[0])
        lines.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" stroke="{colour}"/>')
    lines.append("</g>")
    for path, colour in coloured:
        x, y = at(path[-1])
        lines.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="{colour}"/>')
    lines.append("</svg>")
    Path("docs/pictures/pool_break.svg").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
