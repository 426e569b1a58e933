"""One impact, and the notes' three questions about two bodies: do they touch, when do they meet, what happens then.

classify(a, b)                          apart, collision imminent, resting contact, moving away
collide(a, b, restitution=e)            free flight to the first contact, and the impact there
resolve(a, b, point, normal, restitution=e)     the impact at a given contact
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import _carom
from carom.errors import ABSENT, OverlapError, Problem, SceneError
from carom.impact_table import KINDS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, eq=False)
class Impact:
    """What happened when two bodies collided. SI units, world axes; vectors are read-only arrays (3,).

    The impulse j ≥ 0 acts as +j n on a and −j n on b, at `point`.
    """

    time: float
    """When, s. `time + time_low`, added without rounding, is the exact value."""
    time_low: float
    a: int
    """The smaller id of the two; that of a wall of the domain is negative."""
    b: int
    kind: str
    """"ball-ball" or "ball-plane"; "contact" where `resolve` was told of it."""
    point: NDArray[np.float64]
    """Where they touch, m."""
    normal: NDArray[np.float64]
    """Unit vector from b to a."""
    approach_speed: float
    """−v_AB·n before, m/s."""
    separation_speed: float
    """+v_AB·n after, m/s."""
    impulse: float
    """j, N s."""
    restitution: float
    """e of the pair."""
    energy_lost: float
    """Kinetic energy before less that after, J."""
    velocity_a_before: NDArray[np.float64]
    velocity_b_before: NDArray[np.float64]
    velocity_a: NDArray[np.float64]
    """Velocity of a's centre of mass after the impact, m/s."""
    velocity_b: NDArray[np.float64]
    angular_velocity_a: NDArray[np.float64]
    """Angular velocity of a after the impact, rad/s."""
    angular_velocity_b: NDArray[np.float64]
    position_a: NDArray[np.float64]
    """Centre of mass of a at the impact, m; of a plane: the point of contact."""
    position_b: NDArray[np.float64]
    mass_a: float
    """kg; inf for fixed bodies."""
    mass_b: float
    certificate: str | None = None
    """How its time was certified, see `carom.impact_table.CERTIFICATES`; None where no contact had to be found."""

    @classmethod
    def from_native(cls, row: Mapping[str, Any]) -> Impact:
        """Make an impact from the dict that the native module gives; further entries are left aside."""
        values: dict[str, Any] = {}
        for field in fields(cls):
            value: Any = row.get("certificate") if field.name == "certificate" else row[field.name]
            if field.name == "kind":
                values["kind"] = value if isinstance(value, str) else KINDS[value]
            elif isinstance(value, np.ndarray | list | tuple):
                vector = np.array(value, float)
                vector.flags.writeable = False
                values[field.name] = vector
            else:
                values[field.name] = value
        return cls(**values)

    def to_dict(self) -> dict[str, Any]:
        """Return the same as plain numbers, text and lists."""
        found = ((field.name, getattr(self, field.name)) for field in fields(self))
        return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in found}


def collide(a: Mapping[str, Any], b: Mapping[str, Any], *, restitution: float = 1.0) -> Impact | None:
    """Let two bodies fly freely, without gravity, to their first contact, and resolve the impact there.

    Parameters
    ----------
    a, b
        Balls and planes, not yet bodies of other shapes: mappings with the fields of a scene's `[[body]]`; `radius = r`
        is short for `shape = {kind = "ball", radius = r}`. They are not changed. `material`, `name` and `id` are of no
        account.
    restitution
        e, from 0 to 1.

    Returns
    -------
    impact
        With `time` counted from the given state, a = 0 and b = 1; None if they never meet. Bodies that touch and
        approach collide at time 0.

    Raises
    ------
    SceneError
        A field is unknown, missing or wrong.
    OverlapError
        The bodies are deeper in each other than touching, or concentric.
    """
    bodies = _native_body("a", a), _native_body("b", b)
    with _overlap():
        row = _carom.collide(*bodies, _checked_restitution(restitution))
    return None if row is None else Impact.from_native(row)


def resolve(
    a: Mapping[str, Any], b: Mapping[str, Any], point: ArrayLike, normal: ArrayLike, *, restitution: float = 1.0
) -> Impact:
    """Resolve the impact of two bodies, of any shape, at a given contact, without friction.

    Parameters
    ----------
    a, b
        Bodies as in `collide`, but of any shape; the shape may be left out where `inertia` is given.
    point
        Where they touch, (3,), m.
    normal
        From b to a, (3,); its length does not matter.
    restitution
        e, from 0 to 1.

    Returns
    -------
    impact
        At time 0. If the bodies do not approach at the contact the impulse is 0 and nothing changes.

    Raises
    ------
    SceneError
        A field is unknown, missing or wrong, or `point` or `normal` is no vector.
    """
    bodies = _native_body("a", a, needs_shape=False), _native_body("b", b, needs_shape=False)
    direction = _vector("normal", normal)
    # Scaling by the largest component first keeps lengths from over- and underflowing.
    largest = float(np.max(np.abs(direction)))
    if largest == 0.0:
        raise _problem("normal", normal, "must not be zero: it has to point from b to a")
    direction = direction / largest
    length = math.sqrt(float(direction @ direction))
    unit = (direction / length).tolist()
    row = _carom.resolve(*bodies, _vector("point", point).tolist(), unit, _checked_restitution(restitution))
    return Impact.from_native(row)


def classify(a: Mapping[str, Any], b: Mapping[str, Any]) -> str:
    """Tell how two bodies stand to each other, by the sign of v_AB·n where they touch.

    Parameters
    ----------
    a, b
        Bodies as in `collide`.

    Returns
    -------
    class
        "apart", "collision imminent" (v_AB·n < 0), "resting contact" (= 0) or "moving away" (> 0).

    Raises
    ------
    SceneError
        A field is unknown, missing or wrong.
    OverlapError
        The bodies are deeper in each other than touching.
    """
    bodies = _native_body("a", a), _native_body("b", b)
    with _overlap():
        return _carom.classify(*bodies)


_OF_NO_ACCOUNT = ("id", "name", "material")
_STATE = ("position", "velocity", "orientation", "angular_velocity")


def _native_body(name: str, body: Mapping[str, Any], *, needs_shape: bool = True) -> dict[str, Any]:
    """One body as the native module takes it, checked by the same rules as a scene's."""
    from carom.scene import Scene

    if not hasattr(body, "items"):
        raise _problem(name, body, "must be a mapping with the fields of a body")
    given = {key: _plain(value) for key, value in body.items() if key not in _OF_NO_ACCOUNT}
    short = "radius" in given and "shape" not in given
    if short:
        given["shape"] = {"kind": "ball", "radius": given.pop("radius")}
    # Of a body that turns the scene checks the inertia, that of a ball has three moments alike there.
    ball = not isinstance(given.get("shape"), dict) or given["shape"].get("kind") == "ball"
    inertia = None
    if ball and not needs_shape and "inertia" in given:
        inertia = _inertia(f"{name}.inertia", given.pop("inertia"))
    if inertia is not None and "shape" not in given:
        # Given the inertia, the impulse does not depend on the shape: any ball will do.
        given["shape"] = {"kind": "ball", "radius": 1.0}
    try:
        spec = Scene.from_dict({"duration": 1.0, "body": [given]}).to_spec()
    except SceneError as error:
        raise SceneError([_renamed(problem, name, short=short) for problem in error.problems]) from None
    if spec["planes"]:
        plane = spec["planes"][0]
        position = [n * plane["offset"] for n in plane["normal"]]
        return {"plane": plane, "position": position, "velocity": plane["velocity"], "mass": math.inf, "fixed": True}
    if spec["meshes"]:
        mesh = spec["meshes"][0]
        return {**{field: mesh[field] for field in ("mesh", *_STATE)}, "mass": math.inf, "fixed": True}
    if len(spec["solids"]["id"]):
        row = {field: values[0] for field, values in spec["solids"].items()}
        (geometry,) = spec["geometries"]
        shape: dict[str, Any] = {"geometry": geometry}
        inertia = row["inertia"]
        if np.isnan(inertia).any() and not row["fixed"]:
            inertia = np.array(geometry.moments(float(row["mass"])))
    else:
        row = {field: values[0] for field, values in spec["balls"].items()}
        shape = {"radius": float(row["radius"])}
        if inertia is None:
            inertia = np.full(3, float(row["inertia"]))
    return {
        **shape,
        "mass": float(row["mass"]),
        "inertia": inertia.tolist(),
        **{field: row[field].tolist() for field in _STATE},
        "fixed": bool(row["fixed"]),
    }


def _inertia(field: str, value: Any) -> NDArray[np.float64]:
    """Moments of inertia about the principal axes: of one number, or three."""
    try:
        inertia = np.array(np.broadcast_to(np.asarray(value, float), 3))
    except (TypeError, ValueError):
        inertia = np.full(3, math.nan)
    if not np.all(np.isfinite(inertia) & (inertia > 0)):
        raise _problem(field, value, "must be positive and finite: one number, or three about the principal axes")
    return inertia


def _plain(value: Any) -> Any:
    """Numbers and lists as a scene file has them, from NumPy's and from tuples."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    if hasattr(value, "items"):
        return {key: _plain(item) for key, item in value.items()}
    return value


def _renamed(problem: Problem, name: str, *, short: bool) -> Problem:
    field = problem.field.replace("body[0]", name, 1)
    if short:
        field = field.replace(f"{name}.shape.radius", f"{name}.radius")
    return replace(problem, field=field, who="")


def _problem(field: str, value: Any, reason: str) -> SceneError:
    return SceneError([Problem(None, None, field, value, reason)])


def _vector(name: str, value: ArrayLike) -> NDArray[np.float64]:
    try:
        vector = np.array(value, float)
    except (TypeError, ValueError):
        vector = np.full(0, math.nan)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise _problem(name, _plain(value), "must be three finite numbers, [x, y, z]")
    return vector


def _checked_restitution(restitution: float) -> float:
    if (
        isinstance(restitution, bool)
        or not isinstance(restitution, int | float | np.number)
        or not 0 <= restitution <= 1
    ):
        raise _problem("restitution", _plain(restitution), "must be from 0 to 1")
    return float(restitution)


@contextlib.contextmanager
def _overlap() -> Iterator[None]:
    try:
        yield
    except _carom.OverlapError as error:
        raise OverlapError(str(error)) from None
    except _carom.CheckError as error:
        raise _problem("", ABSENT, str(error)) from None
