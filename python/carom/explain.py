"""One impact of a scene, step by step as in the notes, with its numbers."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import CaromError
from carom.rigid import RigidState, explained
from carom.simulation import ArgumentError, Simulation

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from carom.impact import Impact
    from carom.scene import Scene


SEVERAL = 1e-9
"""An impulse this far, relatively, from that of one point is that of several: rounding is far below, and points that
touch at one instant are not so nearly one."""


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
    solids = simulation.solids
    rigid = set() if solids is None else {mesh.id for mesh in solids.meshes}
    if solids is not None:
        rigid |= set(simulation.ids[solids.geometry_of >= 0].tolist())
    if not rigid.isdisjoint((impact.a, impact.b)):
        return numbers_of_turning(impact, number, simulation, scene.names)
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


def numbers_of_turning(impact: Impact, number: int, simulation: Simulation, names: dict[int, str]) -> dict[str, Any]:
    """Return the quantities of an impact in which a body turns, whose simulation stands right after it."""
    solids = simulation.solids
    assert solids is not None
    rows = {body: row for row, body in enumerate(simulation.ids.tolist())}
    orientations = simulation.orientations
    told: dict[str, Any] = {}
    states: dict[str, RigidState] = {}
    for side, sign in (("a", 1.0), ("b", -1.0)):
        body, row = getattr(impact, side), rows.get(getattr(impact, side))
        shape = -1 if row is None else int(solids.geometry_of[row])
        geometry = None if shape < 0 else solids.geometries[shape]
        mesh = body in {mesh.id for mesh in solids.meshes}
        turn = np.array([1.0, 0.0, 0.0, 0.0]) if row is None else orientations[row]
        after = RigidState(
            mass=getattr(impact, f"mass_{side}"),
            moments=np.full(3, np.inf) if row is None else solids.moments[row],
            axes=turn if geometry is None else product(turn, geometry.principal_axes),
            position=getattr(impact, f"position_{side}"),
            velocity=getattr(impact, f"velocity_{side}"),
            angular_velocity=getattr(impact, f"angular_velocity_{side}"),
        )
        # The impulse taken back: an impact tells the angular velocities after it only.
        before = after.struck(impact.point, -sign * impact.impulse * impact.normal)
        states[side] = replace(before, velocity=getattr(impact, f"velocity_{side}_before"))
        plane = row is None or bool(simulation.is_plane[row])
        kind = geometry.kind if geometry is not None else "plane" if plane else "mesh" if mesh else "ball"
        label = f"the wall {_WALLS[-body - 1]}" if body < 0 else f"{kind} {body}"
        told |= {
            f"name_{side}": f'{label} "{names[body]}"' if body in names else label,
            f"shape_{side}": kind,
            f"orientation_{side}": turn.tolist(),
            f"moments_{side}": [_finite(float(moment)) for moment in after.moments],
            f"mass_{side}": _finite(after.mass),
            f"fixed_{side}": not after.free,
        }
    quantities = explained(states["a"], states["b"], impact.point, impact.normal, impact.restitution, impact.impulse)
    approach = quantities["normal_velocity_before"]
    return {
        **quantities,
        **impact.to_dict(),
        **told,
        "number": number,
        "class": "collision imminent" if approach < 0 else "resting contact" if approach == 0 else "moving away",
    }


def product(p: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the quaternion that turns first by q, then by p."""
    w, v = p[0], p[1:]
    return np.array([w * q[0] - v @ q[1:], *(w * q[1:] + q[0] * v + np.cross(v, q[1:]))])


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
    if "arm_a" in numbers:
        return _text_of_turning(numbers)
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


def _text_of_turning(of: dict[str, Any]) -> str:
    """Tell an impact in which a body turns."""
    lines = [
        f"Impact {of['number']}: A = {of['name_a']} and B = {of['name_b']} at t = {_number(of['time'])} s,"
        f" {of['kind']}",
        "",
        "The two bodies",
    ]
    for letter, row in (("A", "a"), ("B", "b")):
        prescribed = of[f"mass_{row}"] is None
        lines += [
            f"  position   x_{letter} = {_vector(of[f'position_{row}'])} m",
            f"  velocity   v_{letter} = {_vector(of[f'velocity_{row}_before'])} m/s",
            f"  spin       ω_{letter} = {_vector(of[f'angular_velocity_{row}_before'])} rad/s",
        ]
        if prescribed:
            lines.append(f"  mass       m_{letter} = infinite: it moves on as prescribed")
            continue
        lines += [
            f"  turned by  q_{letter} = {_vector(of[f'orientation_{row}'])}, w x y z",
            f"  mass       m_{letter} = {_number(of[f'mass_{row}'])} kg",
            f"  inertia    I_{letter} = {_vector(of[f'moments_{row}'])} kg m², about its principal axes",
        ]
    approach = of["normal_velocity_before"]
    sign = "< 0" if approach < 0 else "= 0" if approach == 0 else "> 0"
    lines += [
        "",
        "Collision detection",
        f"  they touch at  p = {_vector(of['point'])} m",
        f"  (i)   n, from B to A, = {_vector(of['normal'])}",
    ]
    for letter, row in (("A", "a"), ("B", "b")):
        lines += [
            f"        r_{letter} = p − x_{letter} = {_vector(of[f'arm_{row}'])} m",
            f"        v_{letter} + ω_{letter} × r_{letter} = {_vector(of[f'point_velocity_{row}_before'])} m/s",
        ]
    lines += [
        f"  (ii)  v_AB = {_vector(of['relative_velocity_before'])} m/s, of the points in contact",
        f"        v_AB·n = {_number(approach)} m/s {sign}: {of['class']}",
        "",
        "Collision response",
        f"  e = {_number(of['restitution'])}",
    ]
    for letter, row in (("A", "a"), ("B", "b")):
        if of[f"mass_{row}"] is None:
            lines.append(f"  1/m_{letter} = 0, and nothing turns {letter}")
            continue
        lines += [
            f"  r_{letter} × n = {_vector(of[f'arm_cross_normal_{row}'])} m",
            f"  1/m_{letter} = {_number(of[f'inverse_mass_{row}'])} /kg,"
            f"  n·[(I_{letter}⁻¹ (r_{letter} × n)) × r_{letter}] = {_number(of[f'inertia_term_{row}'])} /kg",
        ]
    formula, impulse = of["impulse_by_formula"], of["impulse"]
    single = abs(formula - impulse) <= SEVERAL * abs(impulse)
    lines += [
        "  j = −(1 + e) v_AB·n / (1/m_A + 1/m_B + n·[(I_A⁻¹ (r_A × n)) × r_A] + n·[(I_B⁻¹ (r_B × n)) × r_B])",
        f"    = −(1 + {_number(of['restitution'])}) × ({_number(approach)}) / {_number(of['inverse_effective_mass'])}"
        f" = {_number(formula)} N s",
    ]
    if not single:
        lines.append(f"  several points touch: their impulses are together j = {_number(impulse)} N s, at p")
    for letter, row, sign in (("A", "a", ""), ("B", "b", "−")):
        if of[f"mass_{row}"] is None:
            continue
        lines += [
            f"  Δv_{letter} = {sign}j n/m_{letter} = {_vector(of[f'velocity_change_{row}'])} m/s",
            f"  v_{letter} after = {_vector(of[f'velocity_{row}'])} m/s",
            f"  Δω_{letter} = {sign}I_{letter}⁻¹ (r_{letter} × j n)"
            f" = {_vector(of[f'angular_velocity_change_{row}'])} rad/s",
            f"  ω_{letter} after = {_vector(of[f'angular_velocity_{row}'])} rad/s",
        ]
    lines += [
        f"  v_AB after·n = {_number(of['normal_velocity_after'])} m/s"
        + (f" = −e v_AB·n = {_number(-of['restitution'] * approach)} m/s" if single else ", of the mean point p"),
        "",
        "What is kept and what is lost",
    ]
    prescribed = of["mass_a"] is None or of["mass_b"] is None
    whose = " (of the free body)" if prescribed else ""
    lines += [
        f"  momentum before{whose}          {_vector(of['momentum_before'])} kg m/s",
        f"  momentum after {whose}          {_vector(of['momentum_after'])} kg m/s",
        f"  angular momentum before{whose}  {_vector(of['angular_momentum_before'])} kg m²/s, about the origin",
        f"  angular momentum after {whose}  {_vector(of['angular_momentum_after'])} kg m²/s",
    ]
    for when in ("before", "after "):
        of_when = {
            part: of[f"{part}_{when.strip()}"] for part in ("energy", "translational_energy", "rotational_energy")
        }
        lines.append(
            f"  energy {when}{whose}            {_number(of_when['energy'])} J ="
            f" {_number(of_when['translational_energy'])} J of translation"
            f" + {_number(of_when['rotational_energy'])} J of rotation"
        )
    if of["work"] != 0:
        lines.append(f"  work done by the body in prescribed motion  {_number(of['work'])} J")
    lines.append(f"  energy lost  {_number(of['energy_lost'])} J")
    if single:
        lines.append(f"  ½ (1 − e²) (v_AB·n)² / (1/m_A + … )  {_number(of['energy_lost_by_formula'])} J")
    lines.append("")
    return "\n".join(lines)


def _number(value: float) -> str:
    return f"{value:.12g}"


def _vector(values: list[float]) -> str:
    return "(" + ", ".join(_number(value) for value in values) + ")"


def _inverse_text(mass: float | None) -> str:
    return "0" if mass is None else f"1/{_number(mass)}"
