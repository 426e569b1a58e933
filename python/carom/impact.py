"""One impact, and the notes' three questions about two bodies: do they touch, when do they meet, what happens then.

classify(a, b)                          apart, collision imminent, resting contact, moving away
collide(a, b, restitution=e)            free flight to the first contact, and the impact there
resolve(a, b, point, normal, restitution=e)     the impact at a given contact
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import MISSING, dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import _carom
from carom.errors import ABSENT, OverlapError, Problem, SceneError, UndecidedError
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
    """What of the two surfaces meets, "ball-ball", "vertex-face", …; "contact" where `resolve` was told of it."""
    point: NDArray[np.float64]
    """Where they touch, m; where several points do, their mean, weighted by their impulses."""
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
    """Centre of mass of a at the impact, m; of a plane: the point of contact; of a mesh: the origin of its frame."""
    position_b: NDArray[np.float64]
    mass_a: float
    """kg; inf for fixed bodies."""
    mass_b: float
    points: NDArray[np.float64] | None = None
    """The points that touch, (k, 3), m, all with the one normal: of a face that lands flat its corners. None of an
    impact of a run, which records `point` alone."""
    impulses: NDArray[np.float64] | None = None
    """What acts at each of `points`, (k,), N s, none negative; their sum is `impulse`. From four points on it is one
    choice of several with the same velocities after."""
    certificate: str | None = None
    """How its time was certified, see `carom.impact_table.CERTIFICATES`; None where no contact had to be found."""

    @classmethod
    def from_native(cls, row: Mapping[str, Any]) -> Impact:
        """Make an impact from the dict that the native module gives; further entries are left aside."""
        values: dict[str, Any] = {}
        for field in fields(cls):
            if field.default is not MISSING and field.name not in row:
                continue
            value = row[field.name]
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
        """Return the same as plain numbers, text and lists, without what is None."""
        found = ((field.name, getattr(self, field.name)) for field in fields(self))
        told = ((name, value) for name, value in found if value is not None)
        return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in told}


def collide(a: Mapping[str, Any], b: Mapping[str, Any], *, restitution: float = 1.0) -> Impact | None:
    """Let two bodies fly freely, without gravity, to their first contact, and resolve the impact there.

    Until then bodies of any shape turn freely, as Euler's equations have it, in closed form. The contact of bodies that
    turn is found as in a run: none deeper than δ is missed, and what is found is within δ of touching. δ is 2⁻⁴⁰
    (9e-13) of the larger body's size, the distance of its farthest point from its centre of mass, or 64 ε times the
    distance of the centres (of a plane: its point nearest to the origin), if that is larger.

    Parameters
    ----------
    a, b
        Mappings with the fields of a scene's `[[body]]`, of any shape; `radius = r` is short for
        `shape = {kind = "ball", radius = r}`, and mesh files are named from the current folder. They are not changed.
        `material`, `name` and `id` are of no account. Fixed surroundings of triangles, `shape = {kind = "mesh", …}`,
        are a surface that can be touched from both sides.
    restitution
        e, from 0 to 1.

    Returns
    -------
    impact
        With `time` counted from the given state, a = 0 and b = 1; None if they never meet or only graze. Bodies that
        touch and approach collide at time 0. Where several points touch with one normal, they are resolved together, by
        reflections, and `points` and `impulses` have each. Compounds, and bodies on meshes, that touch in several
        directions at once get the impact in that in which they approach fastest; ask again with what came out for the
        next.

    Raises
    ------
    SceneError
        A field is unknown, missing or wrong, or both bodies are in prescribed motion.
    OverlapError
        The bodies are deeper in each other than touching, or concentric.
    UndecidedError
        Bodies that turn and do not move apart did not touch in a million steps of the search.
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
        Bodies as in `collide`; the shape may be left out where `inertia` is given.
    point
        Where they touch, (3,), m.
    normal
        From b to a, (3,); its length does not matter.
    restitution
        e, from 0 to 1.

    Returns
    -------
    impact
        At time 0. If the bodies do not approach at the contact the impulse is 0 and nothing changes. One point only:
        what lands flat is for `collide`.

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

    v_AB = (v_A + ω_A × r_A) − (v_B + ω_B × r_B) is the relative velocity of their points there. Balls and planes touch
    when their gap is within 4 units in the last place of the largest coordinate or radius; bodies that turn, and all on
    meshes, when it is within δ (see `collide`), to which such contacts are known. v_AB·n is zero when within 4 ε of the
    speeds that make it up. Of several points that touch, the one that approaches fastest decides: a face that tips up
    about an edge at rest rests.

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
        The bodies are deeper in each other than touching, or concentric.
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
    except _carom.UndecidedError as error:
        raise UndecidedError(str(error), error.clear_until) from None
    except _carom.CheckError as error:
        raise _problem("", ABSENT, str(error)) from None
