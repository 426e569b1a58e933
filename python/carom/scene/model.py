"""The fields of a scene file as pydantic models: which there are, of which form, with which defaults.

Each type says in its own words what a value must be; whatever pydantic would say is not shown to anybody.
What concerns more than one field is checked in ``check.py``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, GetCoreSchemaHandler, GetJsonSchemaHandler, Tag
from pydantic_core import CoreSchema, core_schema

AXIS_KINDS: Final = ("open", "walls", "periodic")
LARGEST_ID: Final = 2**31 - 1
LARGEST_COUNT: Final = 2**30 - 1
"""So many bodies at most: what the simulator can number."""


def quoted(names: tuple[str, ...] | list[str], last: str = "or") -> str:
    """``"a", "b" or "c"``."""
    texts = [f'"{name}"' for name in names]
    return texts[0] if len(texts) == 1 else ", ".join(texts[:-1]) + f" {last} {texts[-1]}"


class _Number:
    """A number: first that it is one at all (text and booleans are not), then its range, each with its own reason."""

    def __init__(self, reason: str, kind: Literal["number", "integer"] = "number", **limits: float) -> None:
        self.reason, self.kind, self.limits = reason, kind, limits

    def __get_pydantic_core_schema__(self, _source: object, _handler: GetCoreSchemaHandler) -> CoreSchema:
        limits: dict[str, Any] = self.limits
        if self.kind == "integer":
            form, value = core_schema.int_schema(strict=True), core_schema.int_schema(strict=True, **limits)
        else:
            form = core_schema.float_schema(strict=True)
            value = core_schema.float_schema(strict=True, allow_inf_nan=False, **limits)
        what = "whole number" if self.kind == "integer" else "number"
        return core_schema.chain_schema(
            [_reasoned(form, f"must be a {what}: {self.reason}"), _reasoned(value, f"must be {self.reason}")]
        )

    def __get_pydantic_json_schema__(self, _schema: CoreSchema, _handler: GetJsonSchemaHandler) -> dict[str, Any]:
        keys = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
        return {"type": self.kind, **{keys[name]: limit for name, limit in self.limits.items()}}


class _Reason:
    """Whatever is wrong with a value of this type is said in these words."""

    def __init__(self, reason: str) -> None:
        self.reason = reason

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        return _reasoned(handler(source), self.reason)


def _reasoned(schema: CoreSchema, reason: str) -> CoreSchema:
    # Braces would be taken for places to fill in.
    return core_schema.custom_error_schema(schema, "reason", custom_error_message=reason.replace("{", "{{"))


class _Choice:
    """One of a few words; some that do not work yet are named as such."""

    def __init__(self, words: tuple[str, ...], later: tuple[str, ...] = ()) -> None:
        self.words, self.reason = words, f"must be {quoted(words)}"
        if later:
            self.reason += f"; {quoted(later, 'and')} will come later"

    def __get_pydantic_core_schema__(self, _source: object, _handler: GetCoreSchemaHandler) -> CoreSchema:
        return _reasoned(core_schema.literal_schema(list(self.words)), self.reason)


class _PointList:
    """A list of points: first that it is one at all, then each point for itself."""

    def __get_pydantic_core_schema__(self, _source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        form = core_schema.list_schema(core_schema.any_schema(), strict=True)
        points = core_schema.list_schema(handler.generate_schema(_Point), strict=True)
        return core_schema.chain_schema([_reasoned(form, "must be a list of points, [[x, y, z], ...]"), points])

    def __get_pydantic_json_schema__(self, _schema: CoreSchema, _handler: GetJsonSchemaHandler) -> dict[str, Any]:
        point = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
        return {"type": "array", "items": point}


class _OnlyValue:
    """A number that has one possible value so far."""

    def __init__(self, value: float, reason: str) -> None:
        self.value, self.reason = value, reason

    def __get_pydantic_core_schema__(self, _source: object, _handler: GetCoreSchemaHandler) -> CoreSchema:
        limits = core_schema.float_schema(strict=True, allow_inf_nan=False, ge=self.value, le=self.value)
        return _reasoned(limits, self.reason)

    def __get_pydantic_json_schema__(self, _schema: CoreSchema, _handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"const": self.value}


Number = Annotated[float, _Number("finite")]
Positive = Annotated[float, _Number("positive and finite", gt=0)]
NotNegative = Annotated[float, _Number("finite and not negative", ge=0)]
Share = Annotated[float, _Number("from 0 to 1", ge=0, le=1)]
Packing = Annotated[float, _Number("between 0 and 1", gt=0, lt=1)]
Count = Annotated[int, _Number(f"from 1 to {LARGEST_COUNT}", "integer", ge=1, le=LARGEST_COUNT)]
Identity = Annotated[int, _Number(f"from 0 to {LARGEST_ID}", "integer", ge=0, le=LARGEST_ID)]
Seed = Annotated[int, _Number("from 0 to 2^63 - 1", "integer", ge=0, le=2**63 - 1)]
Whole = Annotated[int, _Number("from -2^31 to 2^31 - 1", "integer", ge=-(2**31), le=LARGEST_ID)]
Text = Annotated[str, Field(strict=True), _Reason("must be text")]
Name = Annotated[str, Field(strict=True, min_length=1), _Reason("must be text, and not empty")]
Switch = Annotated[bool, Field(strict=True), _Reason("must be true or false")]
_Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Vector = Annotated[
    list[_Finite],
    Field(min_length=2, max_length=3, strict=True),
    _Reason("must be three finite numbers, [x, y, z] (two will do where dimensions = 2)"),
]
Quaternion = Annotated[
    list[_Finite],
    Field(min_length=4, max_length=4, strict=True),
    _Reason("must be four finite numbers, the unit quaternion [w, x, y, z]"),
]
_PositiveFinite = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0)]
PositiveList = Annotated[
    list[_PositiveFinite],
    Field(min_length=1, strict=True),
    _Reason("must be a list of positive, finite numbers"),
]
NumberList = Annotated[list[_Finite], Field(strict=True), _Reason("must be a list of finite numbers")]
_Point = Annotated[
    list[_Finite], Field(min_length=3, max_length=3, strict=True), _Reason("must be three finite numbers, [x, y, z]")
]
Points = Annotated[list[list[float]], _PointList()]
Lengths = Annotated[
    list[_PositiveFinite],
    Field(min_length=3, max_length=3, strict=True),
    _Reason("must be three positive, finite lengths, along x, y and z"),
]
Inertia = Annotated[
    _PositiveFinite | Annotated[list[_PositiveFinite], Field(min_length=3, max_length=3, strict=True)],
    _Reason("must be positive and finite: one number, or three about the principal axes"),
]
AxisKinds = Annotated[
    Annotated[Literal["open", "walls", "periodic"], Field()]
    | Annotated[list[Literal["open", "walls", "periodic"]], Field(min_length=2, max_length=3, strict=True)],
    _Reason('must be "open", "walls" or "periodic", or a list of one of these an axis'),
]
TwoNames = Annotated[
    list[Annotated[str, Field(strict=True, min_length=1)]],
    Field(min_length=2, max_length=2, strict=True),
    _Reason("must be two names of materials"),
]
NameOrNames = Annotated[
    Annotated[str, Field(strict=True, min_length=1)]
    | Annotated[list[Annotated[str, Field(strict=True, min_length=1)]], Field(min_length=2, max_length=3, strict=True)],
    _Reason("must be the name of a column or, for a vector, a list of three names"),
]


class Part(BaseModel):
    """A table of a scene file: no field but its own, nothing that changes afterwards."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=False, hide_input_in_errors=True)


class BallShape(Part):
    """A ball; where ``dimensions = 2`` it stands for a disc."""

    kind: Literal["ball"]
    radius: Positive = Field(description="m")


class PlaneShape(Part):
    """A plane without end; bodies are on the side to which its normal points."""

    kind: Literal["plane"]
    normal: Vector = Field(description="Points to the free side; its length does not matter")
    offset: Number = Field(default=0.0, description="Distance from the origin along the normal, m")


class BoxShape(Part):
    """A box, its middle at the origin of its frame, its edges along the axes."""

    kind: Literal["box"]
    size: Lengths = Field(description="Edge lengths along x, y, z, m")


class CapsuleShape(Part):
    """The points within a distance of a line along z whose middle is the origin: a cylinder with half balls as ends."""

    kind: Literal["capsule"]
    radius: Positive = Field(description="m")
    length: Positive = Field(description="Of the straight part, between the centres of the two ends, m")


class CylinderShape(Part):
    """A cylinder along z, its middle at the origin."""

    kind: Literal["cylinder"]
    radius: Positive = Field(description="m")
    length: Positive = Field(description="m")


class EllipsoidShape(Part):
    """An ellipsoid, its middle at the origin."""

    kind: Literal["ellipsoid"]
    semi_axes: Lengths = Field(description="Along x, y, z, m")


class PlatonicShape(Part):
    """A regular polyhedron, its middle at the origin."""

    kind: Literal["tetrahedron", "cube", "octahedron", "dodecahedron", "icosahedron"]
    edge: Positive = Field(description="Length of an edge, m")


class ConvexShape(Part):
    """A convex polyhedron, of points or of a mesh file; a mesh that is not convex gives its hull or convex parts."""

    kind: Literal["convex"]
    points: Points | None = Field(default=None, description="The body is their convex hull, m; or mesh")
    mesh: Name | None = Field(default=None, description="STL, OBJ, PLY or GLB file, in the scene's folder or below")
    scale: Positive | None = Field(default=None, description="The mesh's numbers times this are m; default 1")
    hull: Switch | None = Field(default=None, description="Take the convex hull of a mesh that is not convex")
    parts: Annotated[str, _Choice(("auto",))] | None = Field(
        default=None, description="Split a mesh that is not convex into convex parts (approximately, by CoACD)"
    )


class MeshShape(Part):
    """Surroundings of triangles, open or closed, from a mesh file; always fixed."""

    kind: Literal["mesh"]
    mesh: Name = Field(description="STL, OBJ, PLY or GLB file, in the scene's folder or below")
    scale: Positive | None = Field(default=None, description="The mesh's numbers times this are m; default 1")


_Solid = BoxShape | CapsuleShape | CylinderShape | EllipsoidShape | ConvexShape | PlatonicShape
PartShape = Annotated[BallShape | _Solid, Field(discriminator="kind")]


class ShapePart(Part):
    """One convex part of a compound."""

    shape: PartShape
    position: Vector | None = Field(
        default=None, description="Of the origin of the part's frame, m; default the origin"
    )
    orientation: Quaternion | None = Field(
        default=None, description="Unit quaternion [w, x, y, z], the part's frame to the compound's"
    )


class CompoundShape(Part):
    """Several convex parts that move as one body."""

    kind: Literal["compound"]
    parts: Annotated[list[ShapePart], Field(min_length=1)] = Field(description="Where parts overlap, mass counts twice")


# The discriminator of pydantic's own costs a scene of 100,000 bodies less than one in Python.
Shape = Annotated[BallShape | PlaneShape | _Solid | CompoundShape | MeshShape, Field(discriminator="kind")]
FillShape = Annotated[_Solid | CompoundShape, Field(discriminator="kind")]
SolidShape = _Solid | CompoundShape
"""The shapes of bodies that turn."""

PLATONIC: Final = ("tetrahedron", "cube", "octahedron", "dodecahedron", "icosahedron")
SHAPES: Final[dict[str, type[Part]]] = {
    "ball": BallShape,
    "box": BoxShape,
    "capsule": CapsuleShape,
    "cylinder": CylinderShape,
    "ellipsoid": EllipsoidShape,
    "convex": ConvexShape,
    **dict.fromkeys(PLATONIC, PlatonicShape),
    "compound": CompoundShape,
    "plane": PlaneShape,
    "mesh": MeshShape,
}
"""All kinds of shapes."""

SHAPE_KINDS: Final[dict[str, tuple[str, ...]]] = {
    "body": tuple(SHAPES),
    "fill": tuple(kind for kind in SHAPES if kind not in ("ball", "plane", "mesh")),
    "part": tuple(kind for kind in SHAPES if kind not in ("compound", "plane", "mesh")),
}
"""Which of them a body, the bodies of a fill, and a part of a compound can have."""


class ConstantRadius(Part):
    """All radii alike."""

    kind: Literal["constant"]
    value: Positive = Field(description="m")


class UniformRadius(Part):
    """Radii evenly spread between two limits."""

    kind: Literal["uniform"]
    low: Positive = Field(description="m")
    high: Positive = Field(description="m")


class NormalRadius(Part):
    """Normally distributed radii, cut at three deviations from the mean."""

    kind: Literal["normal"]
    mean: Positive = Field(description="m")
    deviation: NotNegative = Field(description="Less than a third of the mean, m")


class LognormalRadius(Part):
    """Radii whose logarithms are normally distributed; mean and deviation are those of the radii."""

    kind: Literal["lognormal"]
    mean: Positive = Field(description="m")
    deviation: NotNegative = Field(description="m")


class MixtureRadius(Part):
    """A few sizes, each with its share of the number of bodies."""

    kind: Literal["mixture"]
    radii: PositiveList = Field(description="m")
    shares: PositiveList = Field(description="One a radius; divided by their sum")


RADIUS_KINDS: Final = ("constant", "uniform", "normal", "lognormal", "mixture")


def _radius_kind(value: object) -> str:
    if isinstance(value, Mapping):
        return str(value.get("kind"))
    return getattr(value, "kind", "number")


Radius = Annotated[
    Annotated[Positive, Tag("number")]
    | Annotated[ConstantRadius, Tag("constant")]
    | Annotated[UniformRadius, Tag("uniform")]
    | Annotated[NormalRadius, Tag("normal")]
    | Annotated[LognormalRadius, Tag("lognormal")]
    | Annotated[MixtureRadius, Tag("mixture")],
    Discriminator(_radius_kind, custom_error_type="kind", custom_error_message=f"must be {quoted(RADIUS_KINDS)}"),
]


class Rules(Part):
    """What is done where the notes leave a choice; left out: what the notes assume."""

    simultaneous: Annotated[str, _Choice(("pairwise", "reflections"), ("lcp", "refuse"))] = Field(
        default="pairwise", description="Several pairs at one instant: one by one, or all together by reflections"
    )
    collapse: Annotated[str, _Choice(("stop",), ("rest", "contact-time"))] = Field(
        default="stop", description="Collisions that lose energy accumulate: the run stops"
    )
    law: Annotated[str, _Choice(("newton",), ("stronge", "poisson"))] = Field(
        default="newton", description="The law of impact: Newton's restitution"
    )


class Output(Part):
    """What a run records."""

    frames: NotNegative | None = Field(default=None, description="States recorded a second; 0: none. Default 60")
    times: NumberList | None = Field(default=None, description="Instead of frames: the times of the states recorded, s")
    impacts: Switch = Field(default=True, description="Whether every impact is recorded")


class Domain(Part):
    """Where the bodies are; centred on the origin."""

    kind: AxisKinds = Field(description='"open", "walls" or "periodic", or one of these an axis')
    size: Vector | None = Field(default=None, description="Lengths along x, y, z, m; along open axes of no account")
    material: Name | None = Field(default=None, description="Material of the walls")


def axis_kinds(domain: Domain, dimensions: int) -> list[str]:
    """The kind of each of the three axes; where ``dimensions = 2``, z is open."""
    kinds = [domain.kind] * dimensions if isinstance(domain.kind, str) else list(domain.kind)
    return kinds + ["open"] * (3 - len(kinds))


class Material(Part):
    """A material that bodies can be made of."""

    name: Name


class Pair(Part):
    """What happens between two materials."""

    materials: TwoNames = Field(description="Two names, in any order; the same twice: that material with itself")
    restitution: Share = Field(description="0: no rebound, 1: no loss")
    friction: Annotated[float, _OnlyValue(0, "must be 0: friction will come later")] = 0.0
    tangential_restitution: Annotated[float, _OnlyValue(-1, "must be -1 (smooth): others will come later")] = -1.0


class Body(Part):
    """One body."""

    id: Identity | None = Field(default=None, description="Unique; left out: the place in the order of the file")
    name: Name | None = Field(default=None, description="Unique, for messages and plots")
    shape: Shape
    mass: Positive | None = Field(default=None, description="kg; or density")
    density: Positive | None = Field(default=None, description="kg/m³, kg/m² where dimensions = 2; or mass")
    inertia: Inertia | None = Field(
        default=None, description="About the principal axes, kg m², if that of a homogeneous body is not meant"
    )
    position: Vector | None = Field(default=None, description="Centre of mass, m; of a mesh, its own origin")
    orientation: Quaternion | None = Field(
        default=None, description="Unit quaternion [w, x, y, z], the frame in which the shape is given to world"
    )
    velocity: Vector | None = Field(default=None, description="m/s")
    angular_velocity: Vector | None = Field(default=None, description="rad/s, in world axes")
    material: Name | None = None
    fixed: Switch | None = Field(default=None, description="Infinite mass; moves on at its velocity whatever hits it")


class Fill(Part):
    """Many bodies at once: balls, or alike bodies of another shape, each turned at random."""

    placement: Annotated[str, _Choice(("cubic", "fcc", "random"))] = "random"
    count: Count | None = Field(default=None, description="Number of bodies")
    packing: Packing | None = Field(
        default=None,
        description="Fraction of the region that the bodies take up; with count, all radii are scaled to it",
    )
    spacing: Positive | None = Field(
        default=None, description="Of bodies with a shape: distance of neighbouring sites of the lattice, m"
    )
    radius: Radius | None = Field(default=None, description="Of balls, m, or a distribution; or shape")
    shape: FillShape | None = Field(default=None, description="Of bodies other than balls; or radius")
    mass: Positive | None = Field(default=None, description="Of each, kg; or density")
    density: Positive | None = Field(default=None, description="kg/m³, kg/m² where dimensions = 2; or mass")
    temperature: NotNegative = Field(
        default=0.0, description="kT in J: the kinetic energy is d/2 (N - 1) kT, that of rotation 3/2 N kT"
    )
    velocity: Vector | None = Field(default=None, description="Drift, added to all, m/s")
    center: Vector | None = Field(default=None, description="Middle of the region, m; default the origin")
    size: Vector | None = Field(default=None, description="Region, m; default the domain")
    material: Name | None = None


class Columns(Part):
    """Which columns of a file hold what."""

    position: NameOrNames | None = None
    velocity: NameOrNames | None = None
    momentum: NameOrNames | None = None
    radius: NameOrNames | None = None
    diameter: NameOrNames | None = None
    mass: NameOrNames | None = None
    id: NameOrNames | None = None


class Import(Part):
    """Bodies from a file that another program wrote."""

    file: Name = Field(description="Relative to the scene's folder, and inside it")
    format: Annotated[str, _Choice(("xyz", "gsd", "csv"))] | None = Field(
        default=None, description="Default: by the suffix"
    )
    frame: Whole = Field(default=-1, description="Which frame of several, from 0; negative: from the end")
    columns: Columns = Field(default_factory=Columns)
    origin: Vector | None = Field(default=None, description="The point of the file that becomes the scene's origin, m")
    radius: Positive | None = Field(default=None, description="For all, instead of the file's, m")
    mass: Positive | None = Field(default=None, description="For all, instead of the file's, kg")
    density: Positive | None = Field(default=None, description="For all, instead of the file's mass, kg/m³")
    velocity: Vector | None = Field(default=None, description="For all, instead of the file's, m/s")
    material: Name | None = None
    box: Switch = Field(default=False, description="Take the domain from the file")
    shrink: Switch = Field(
        default=False, description="Shrink overlaps away that are no deeper than the file's own rounding"
    )


class SceneFields(Part):
    """A scene: bodies, where they are, what they are made of, for how long they fly and collide."""

    version: Text | None = Field(
        default=None, description="The version of Carom that wrote this; of no account when reading"
    )
    title: Text = ""
    duration: Positive = Field(description="s")
    time: Number = Field(default=0.0, description="The clock at the start, s")
    dimensions: Annotated[int, _Number("2 or 3", "integer", ge=2, le=3)] = 3
    gravity: Vector = Field(default_factory=lambda: [0.0, 0.0, 0.0], description="m/s²")
    restitution: Share = Field(default=1.0, description="Of the pairs of materials that are not listed under [[pair]]")
    friction: Annotated[float, _OnlyValue(0, "must be 0: friction will come later")] = 0.0
    seed: Seed = Field(default=1, description="For whatever is drawn at random")
    rules: Rules = Field(default_factory=Rules)
    output: Output = Field(default_factory=Output)
    domain: Domain | None = Field(default=None, description="Left out: open space")
    materials: list[Material] = Field(default_factory=list, alias="material")
    pairs: list[Pair] = Field(default_factory=list, alias="pair")
    bodies: list[Body] = Field(default_factory=list, alias="body")
    fills: list[Fill] = Field(default_factory=list, alias="fill")
    imports: list[Import] = Field(default_factory=list, alias="import")


LISTS: Final = ("material", "pair", "body", "fill", "import")
"""The sections that are lists of tables, in the order in which they are written."""

TABLES: Final[dict[tuple[str, ...], type[Part]]] = {
    (): SceneFields,
    ("rules",): Rules,
    ("output",): Output,
    ("domain",): Domain,
    ("material",): Material,
    ("pair",): Pair,
    ("body",): Body,
    **{("body", "shape", kind): SHAPES[kind] for kind in SHAPE_KINDS["body"]},
    ("part",): ShapePart,
    **{("part", "shape", kind): SHAPES[kind] for kind in SHAPE_KINDS["part"]},
    ("fill",): Fill,
    **{("fill", "shape", kind): SHAPES[kind] for kind in SHAPE_KINDS["fill"]},
    ("fill", "radius", "constant"): ConstantRadius,
    ("fill", "radius", "uniform"): UniformRadius,
    ("fill", "radius", "normal"): NormalRadius,
    ("fill", "radius", "lognormal"): LognormalRadius,
    ("fill", "radius", "mixture"): MixtureRadius,
    ("import",): Import,
    ("import", "columns"): Columns,
}
"""Which model is at which place; places in lists are left out. The parts of a compound are "part", wherever it is."""


def field_names(model: type[Part]) -> list[str]:
    """The names of a table's fields, as in the file."""
    return [field.alias or name for name, field in model.model_fields.items()]
