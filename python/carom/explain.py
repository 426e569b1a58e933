"""One impact of a scene, step by step as in the notes, with its numbers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import CaromError
from carom.simulation import ArgumentError, Simulation

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.impact import Impact
    from carom.scene import Scene


class NoImpactError(CaromError):
    """The scene has fewer impacts than that before its duration is over."""


def impact_of(scene: Scene, number: int) -> dict[str, Any]:
    """Run a scene to its impact `number` (counted from 1) and return what there is to say about it.

    Returns
    -------
    numbers
        Plain numbers, text and lists, in SI units: the impact's own fields, and the notes' quantities by name.

    Raises
    ------
    SceneError
        The scene cannot be run.
    ArgumentError
        `number` is not a whole number of at least 1.
    NoImpactError
        There are fewer impacts before the end of the scene's duration.
    CollapseError
        The scene collapses before.
    """
    if isinstance(number, bool) or not isinstance(number, int) or number < 1:
        raise ArgumentError(f"impact = {number!r} is not the number of an impact: they are counted from 1")
    # The impacts before it need not be kept.
    simulation = Simulation(scene.changed({"output.impacts": False}))
    if number > 1:
        simulation.run(until=simulation.end_time, events=number - 1)
    impact = simulation.step() if simulation.impact_count == number - 1 else None
    if impact is None:
        count = simulation.impact_count
        raise NoImpactError(
            f"there is no impact {number}: the scene has {count} before its duration ends at {simulation.end_time:g} s"
        )
    radii = dict(zip(simulation.ids.tolist(), simulation.radii.tolist(), strict=True))
    fixed = dict(zip(simulation.ids.tolist(), simulation.fixed.tolist(), strict=True))
    return numbers_of(impact, number, radii, fixed, scene.names)


def numbers_of(
    impact: Impact, number: int, radii: dict[int, float], fixed: dict[int, bool], names: dict[int, str]
) -> dict[str, Any]:
    """Return the notes' quantities of an impact as plain numbers, text and lists."""
    normal = impact.normal
    relative_before = impact.velocity_a_before - impact.velocity_b_before
    relative_after = impact.velocity_a - impact.velocity_b
    approach = _dot(relative_before, normal)
    inverse_a, inverse_b = _inverse(impact.mass_a), _inverse(impact.mass_b)
    restitution = impact.restitution
    bodies = (
        ("a", impact.a, impact.mass_a, impact.velocity_a_before, impact.velocity_a),
        ("b", impact.b, impact.mass_b, impact.velocity_b_before, impact.velocity_b),
    )
    free = [(mass, before, after) for _, _, mass, before, after in bodies if math.isfinite(mass)]
    zero = np.zeros(3)
    momentum_before = sum((mass * before for mass, before, _ in free), zero)
    momentum_after = sum((mass * after for mass, _, after in free), zero)
    energy_before = sum(0.5 * mass * _dot(before, before) for mass, before, _ in free)
    energy_after = sum(0.5 * mass * _dot(after, after) for mass, _, after in free)
    separation = impact.position_a - impact.position_b
    work = sum(
        # What a body in prescribed motion does to the other: force on it times its velocity.
        -sign * impact.impulse * _dot(normal, before)
        for sign, (_, _, mass, before, _) in zip((1.0, -1.0), bodies, strict=True)
        if not math.isfinite(mass)
    )
    ball_ball = impact.kind == "ball-ball"
    return {
        **impact.to_dict(),
        "number": number,
        "name_a": _name(impact.a, names, impact.kind, radii),
        "name_b": _name(impact.b, names, impact.kind, radii),
        "radius_a": _finite(radii.get(impact.a, math.nan)),
        "radius_b": _finite(radii.get(impact.b, math.nan)),
        "fixed_a": fixed.get(impact.a, True),
        "fixed_b": fixed.get(impact.b, True),
        "mass_a": _finite(impact.mass_a),
        "mass_b": _finite(impact.mass_b),
        "distance": float(np.sqrt(separation @ separation)) if ball_ball else abs(_dot(separation, normal)),
        "relative_velocity_before": relative_before.tolist(),
        "relative_velocity_after": relative_after.tolist(),
        "normal_velocity_before": approach,
        "normal_velocity_after": _dot(relative_after, normal),
        "class": "collision imminent" if approach < 0 else "resting contact" if approach == 0 else "moving away",
        "impulse_by_formula": -(1 + restitution) * approach / (inverse_a + inverse_b),
        "momentum_before": momentum_before.tolist(),
        "momentum_after": momentum_after.tolist(),
        "energy_before": energy_before,
        "energy_after": energy_after,
        "work": work,
        "reduced_mass": 1 / (inverse_a + inverse_b),
        "energy_lost_by_formula": 0.5 / (inverse_a + inverse_b) * (1 - restitution * restitution) * approach * approach,
    }


def _dot(u: NDArray[np.float64], v: NDArray[np.float64]) -> float:
    return float(u @ v)


def _inverse(mass: float) -> float:
    return 1 / mass if math.isfinite(mass) else 0.0


def _finite(value: float) -> float | None:
    """JSON has no infinity: what is infinite or has no value is null there."""
    return value if math.isfinite(value) else None


_WALLS = ("x low", "x high", "y low", "y high", "z low", "z high")


def _name(body: int, names: dict[int, str], kind: str, radii: dict[int, float]) -> str:
    if body < 0:
        return f"the wall {_WALLS[-body - 1]}"
    plane = kind == "ball-plane" and math.isnan(radii.get(body, math.nan))
    label = f"{'plane' if plane else 'ball'} {body}"
    return f'{label} "{names[body]}"' if body in names else label


def as_text(numbers: dict[str, Any]) -> str:
    """Tell an impact in the order of the notes, from what `impact_of` returns."""
    of = numbers
    plane = of["kind"] == "ball-plane"
    a, b = of["name_a"], of["name_b"]
    lines = [
        f"Impact {of['number']}: A = {a} and B = {b} at t = {_number(of['time'])} s",
        "",
        "The two bodies",
    ]
    for letter, row in (("A", "a"), ("B", "b")):
        mass = of[f"mass_{row}"]
        radius = of[f"radius_{row}"]
        lines += [
            f"  position   x_{letter} = {_vector(of[f'position_{row}'])} m"
            + ("" if radius is not None else "   (a plane: its point under the contact)"),
            f"  velocity   v_{letter} = {_vector(of[f'velocity_{row}_before'])} m/s",
            f"  mass       m_{letter} = "
            + ("infinite: it moves on as prescribed" if mass is None else f"{_number(mass)} kg"),
        ]
        if radius is not None:
            lines.append(f"  radius     r_{letter} = {_number(radius)} m")
    lines += ["", "Collision detection"]
    if plane:
        radius = of["radius_a"] if of["radius_a"] is not None else of["radius_b"]
        lines += [
            f"  distance   (x_A − x_B)·n = {_number(of['distance'])} m, radius {_number(radius)} m: they touch",
            f"  (i)   n = the plane's normal, turned to point from B to A = {_vector(of['normal'])}",
        ]
    else:
        lines += [
            f"  distance   |x_A − x_B| = {_number(of['distance'])} m,"
            f" r_A + r_B = {_number(of['radius_a'] + of['radius_b'])} m: they touch",
            f"  (i)   n = (x_A − x_B) / |x_A − x_B| = {_vector(of['normal'])}",
        ]
    approach = of["normal_velocity_before"]
    sign = "< 0" if approach < 0 else "= 0" if approach == 0 else "> 0"
    lines += [
        f"  (ii)  v_AB = v_A − v_B = {_vector(of['relative_velocity_before'])} m/s",
        f"        v_AB·n = {_number(approach)} m/s {sign}: {of['class']}",
        "",
        "Collision response",
        f"  e = {_number(of['restitution'])}",
        "  j = −(1 + e) v_AB·n / (1/m_A + 1/m_B)",
        f"    = −(1 + {_number(of['restitution'])}) × ({_number(approach)})"
        f" / ({_inverse_text(of['mass_a'])} + {_inverse_text(of['mass_b'])})",
        f"    = {_number(of['impulse'])} N s",
        f"  v_A after = v_A + j n/m_A = {_vector(of['velocity_a'])} m/s",
        f"  v_B after = v_B − j n/m_B = {_vector(of['velocity_b'])} m/s",
        f"  v_AB after·n = {_number(of['normal_velocity_after'])} m/s"
        f" = −e v_AB·n = {_number(-of['restitution'] * approach)} m/s",
        "",
        "What is kept and what is lost",
    ]
    prescribed = of["mass_a"] is None or of["mass_b"] is None
    whose = " (of the free body)" if prescribed else ""
    lines += [
        f"  momentum before{whose}  {_vector(of['momentum_before'])} kg m/s",
        f"  momentum after {whose}  {_vector(of['momentum_after'])} kg m/s",
    ]
    if prescribed:
        given = [of["momentum_after"][i] - of["momentum_before"][i] for i in range(3)]
        lines.append(f"  the other gave  {_vector(given)} kg m/s: it is booked as the impulse of walls")
    lines += [
        f"  energy before{whose}    {_number(of['energy_before'])} J",
        f"  energy after {whose}    {_number(of['energy_after'])} J",
    ]
    if of["work"] != 0:
        lines.append(f"  work done by the body in prescribed motion  {_number(of['work'])} J")
    lines += [
        f"  energy lost             {_number(of['energy_lost'])} J",
        f"  ½ μ (1 − e²) (v_AB·n)²  {_number(of['energy_lost_by_formula'])} J,"
        f" with μ = m_A m_B / (m_A + m_B) = {_number(of['reduced_mass'])} kg",
        "",
    ]
    return "\n".join(lines)


def _number(value: float) -> str:
    return f"{value:.12g}"


def _vector(values: list[float]) -> str:
    return "(" + ", ".join(_number(value) for value in values) + ")"


def _inverse_text(mass: float | None) -> str:
    return "0" if mass is None else f"1/{_number(mass)}"
