"""One impact of two rigid bodies at a contact: every quantity of Newton's law, by name.

Pure functions of the two bodies' states, the contact point and the normal. The engine resolves impacts; this only says
with which numbers, so that a person can follow (`carom explain`), and it is checked against the same vectors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carom.solids import rotation_matrix

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RigidState:
    """A body at an instant; of one in prescribed motion the mass and the moments are inf. SI units, world axes."""

    mass: float
    moments: Floats
    """Principal moments of inertia, (3,), kg m²."""
    axes: Floats
    """Principal frame to world: unit quaternion (w, x, y, z)."""
    position: Floats
    """Centre of mass, m."""
    velocity: Floats
    """Of the centre of mass, m/s."""
    angular_velocity: Floats = field(default_factory=lambda: np.zeros(3))
    """rad/s."""

    @property
    def free(self) -> bool:
        """Whether it gives way."""
        return math.isfinite(self.mass)

    @property
    def inverse_mass(self) -> float:
        """1/m, 0 in prescribed motion."""
        return 1 / self.mass if self.free else 0.0

    @property
    def inverse_inertia(self) -> Floats:
        """I⁻¹ in world axes, 0 in prescribed motion."""
        if not self.free:
            return np.zeros((3, 3))
        turn = rotation_matrix(self.axes)
        return turn @ np.diag(1 / self.moments) @ turn.T

    def velocity_at(self, point: Floats) -> Floats:
        """Velocity of the body's point there, v + ω × r, m/s."""
        return self.velocity + np.cross(self.angular_velocity, point - self.position)

    def energies(self) -> tuple[float, float]:
        """Kinetic energy of translation and of rotation, J; 0 in prescribed motion."""
        if not self.free:
            return 0.0, 0.0
        along = rotation_matrix(self.axes).T @ self.angular_velocity
        return 0.5 * self.mass * float(self.velocity @ self.velocity), 0.5 * float(along @ (self.moments * along))

    def momenta(self) -> tuple[Floats, Floats]:
        """Momentum, and angular momentum about the origin, x × p + I ω; 0 in prescribed motion."""
        if not self.free:
            return np.zeros(3), np.zeros(3)
        turn = rotation_matrix(self.axes)
        spin = turn @ (self.moments * (turn.T @ self.angular_velocity))
        momentum = self.mass * self.velocity
        return momentum, np.cross(self.position, momentum) + spin

    def struck(self, point: Floats, impulse: Floats) -> RigidState:
        """The same body after an impulse, N s, at a point."""
        turned = self.inverse_inertia @ np.cross(point - self.position, impulse)
        return replace(
            self,
            velocity=self.velocity + self.inverse_mass * impulse,
            angular_velocity=self.angular_velocity + turned,
        )


def explained(
    a: RigidState, b: RigidState, point: Floats, normal: Floats, restitution: float, impulse: float | None = None
) -> dict[str, Any]:
    """Return the quantities of an impact as plain numbers and lists, those of a body with `_a` or `_b` at their end.

    Parameters
    ----------
    a, b
        The bodies right before.
    point
        Where they touch, m; where several points do, where the whole impulse acts.
    normal
        Unit vector from b to a.
    restitution
        e.
    impulse
        j, N s, if it is known, as it is where several points touch; left out: j of the law for one point.
    """
    relative = a.velocity_at(point) - b.velocity_at(point)
    approach = float(relative @ normal)
    sides = {"a": a, "b": b}
    numbers: dict[str, Any] = {}
    denominator = 0.0
    for side, body in sides.items():
        arm = point - body.position
        lever = np.cross(arm, normal)
        answer = body.inverse_inertia @ lever
        term = float(normal @ np.cross(answer, arm))
        denominator += body.inverse_mass + term
        numbers |= {
            f"arm_{side}": arm.tolist(),
            f"arm_cross_normal_{side}": lever.tolist(),
            f"inverse_inertia_arm_cross_normal_{side}": answer.tolist(),
            f"inverse_mass_{side}": body.inverse_mass,
            f"inertia_term_{side}": term,
            f"point_velocity_{side}_before": body.velocity_at(point).tolist(),
        }
    by_formula = -(1 + restitution) * approach / denominator
    j = by_formula if impulse is None else impulse
    after = {"a": a.struck(point, j * normal), "b": b.struck(point, -j * normal)}
    for side, body in after.items():
        before = sides[side]
        numbers |= {
            f"velocity_{side}_before": before.velocity.tolist(),
            f"angular_velocity_{side}_before": before.angular_velocity.tolist(),
            f"velocity_{side}": body.velocity.tolist(),
            f"angular_velocity_{side}": body.angular_velocity.tolist(),
            f"velocity_change_{side}": (body.velocity - before.velocity).tolist(),
            f"angular_velocity_change_{side}": (body.angular_velocity - before.angular_velocity).tolist(),
            f"point_velocity_{side}": body.velocity_at(point).tolist(),
        }
    relative_after = after["a"].velocity_at(point) - after["b"].velocity_at(point)
    for when, states in (("before", sides), ("after", after)):
        energies = [body.energies() for body in states.values()]
        momenta = [body.momenta() for body in states.values()]
        numbers |= {
            f"translational_energy_{when}": sum(moving for moving, _ in energies),
            f"rotational_energy_{when}": sum(turning for _, turning in energies),
            f"energy_{when}": sum(moving + turning for moving, turning in energies),
            f"momentum_{when}": sum((momentum for momentum, _ in momenta), np.zeros(3)).tolist(),
            f"angular_momentum_{when}": sum((angular for _, angular in momenta), np.zeros(3)).tolist(),
        }
    # What a body in prescribed motion does to the other: force on it times the velocity of its point.
    work = sum(
        -sign * j * float(normal @ body.velocity_at(point))
        for sign, body in ((1, a), (-1, b))
        if not body.free
    )  # fmt: skip
    return numbers | {
        "restitution": restitution,
        "point": point.tolist(),
        "normal": normal.tolist(),
        "relative_velocity_before": relative.tolist(),
        "relative_velocity_after": relative_after.tolist(),
        "normal_velocity_before": approach,
        "normal_velocity_after": float(relative_after @ normal),
        "approach_speed": -approach,
        "inverse_effective_mass": denominator,
        "impulse": j,
        "impulse_by_formula": by_formula,
        "work": work,
        "energy_lost_by_formula": 0.5 * (1 - restitution * restitution) * approach * approach / denominator,
    }
