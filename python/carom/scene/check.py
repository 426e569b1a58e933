"""What one field alone cannot tell: bodies that need a mass, names that must be known, numbers that must agree.

Geometry (overlaps, balls outside their walls) is checked by the core, which knows what touching is.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import PurePosixPath, PureWindowsPath

from carom import _carom
from carom.scene.fill import FCC_PACKING, fill_count, region
from carom.scene.model import (
    LARGEST_COUNT,
    BallShape,
    Body,
    CompoundShape,
    ConstantRadius,
    ConvexShape,
    Fill,
    Import,
    LognormalRadius,
    MeshShape,
    MixtureRadius,
    NormalRadius,
    PlaneShape,
    SceneFields,
    Shape,
    UniformRadius,
    axis_kinds,
)
from carom.scene.problems import Findings, Path, nearest

UNIT_TOLERANCE = 1e-12
"""How far an orientation's length may be from 1: the error of a quaternion computed in double precision and written
with 13 digits is below this, that of one typed with 6 digits far above."""

INERTIA_TOLERANCE = 1e-12
"""Relative; what a moment of inertia written with 13 digits may exceed the largest possible one by."""

Places = Mapping[str, Sequence[int]]
"""For each list of the scene, the place in the file of each of its items that is left."""


def check(fields: SceneFields, places: Places, findings: Findings, domain_by_import: bool) -> None:
    """Note in ``findings`` whatever does not fit together; ``domain_by_import``: an import says where the walls are."""
    _check_top(fields, findings)
    _check_domain(fields, findings)
    _check_materials(fields, places, findings)
    flat = fields.dimensions == 2
    numbers: dict[int, int] = {}
    names: dict[str, int] = {}
    for body, place in zip(fields.bodies, places["body"], strict=True):
        _check_body(body, ("body", place), flat, findings)
        number = place if body.id is None else body.id
        if number in numbers:
            findings.add(("body", place, "id"), _same_id(number, numbers[number], body.id is None), number)
        numbers[number] = place
        if body.name is not None and body.name in names:
            findings.add(("body", place, "name"), f"body[{names[body.name]}] has this name too")
        names[body.name or ""] = place
    for fill, place in zip(fields.fills, places["fill"], strict=True):
        _check_fill(fill, ("fill", place), fields, findings, domain_by_import)
    for item, place in zip(fields.imports, places["import"], strict=True):
        _check_import(item, ("import", place), fields, findings)
    boxes = [place for item, place in zip(fields.imports, places["import"], strict=True) if item.box]
    for place in boxes[1:]:
        findings.add(("import", place, "box"), f"import[{boxes[0]}] gives the domain already")


def _same_id(number: int, other: int, implied: bool) -> str:
    if implied:
        return f"is left out, so it is the place in the file, and body[{other}] has the id {number}"
    return f"body[{other}] has this id too"


def _check_vector(vector: list[float] | None, path: Path, flat: bool, findings: Findings) -> None:
    if vector is None:
        return
    if not flat and len(vector) == 2:
        findings.add(path, "must have three components, [x, y, z] (dimensions = 3)")
    elif flat and len(vector) == 3 and vector[2] != 0:
        findings.add(path, "the z component must be 0 (dimensions = 2)")


def _check_top(fields: SceneFields, findings: Findings) -> None:
    _check_vector(fields.gravity, ("gravity",), fields.dimensions == 2, findings)
    end = fields.time + fields.duration
    if not end > fields.time:
        findings.add(("duration",), f"adds nothing to a clock that starts at time = {fields.time!r}")
    if not math.isfinite(end):
        findings.add(("duration",), "the end, time + duration, must be finite")
    output = fields.output
    if output.frames is not None and output.times is not None:
        findings.add(("output", "times"), "give frames (states a second) or times, not both")
    previous = -math.inf
    for place, time in enumerate(output.times or []):
        if not fields.time <= time <= end:
            findings.add(
                ("output", "times", place), f"must be between the start, {fields.time!r}, and the end, {end!r}"
            )
        elif time <= previous:
            findings.add(("output", "times", place), f"must be later than the time before it, {previous!r}")
        previous = time
    if not (findings.data.get("body") or findings.data.get("fill") or findings.data.get("import")):
        findings.add((), "there are no bodies: add a [[body]], a [[fill]] or an [[import]]")


def _check_domain(fields: SceneFields, findings: Findings) -> None:
    domain = fields.domain
    if domain is None:
        return
    flat = fields.dimensions == 2
    if not isinstance(domain.kind, str):
        if len(domain.kind) == 2 and not flat:
            findings.add(("domain", "kind"), "must have three kinds, one an axis (dimensions = 3)")
            return
        if flat and len(domain.kind) == 3 and domain.kind[2] != "open":
            findings.add(("domain", "kind"), 'the z axis must be "open" (dimensions = 2)')
    kinds = axis_kinds(domain, fields.dimensions)
    if domain.material is not None and "walls" not in kinds:
        findings.add(("domain", "material"), 'is the material of walls, but no axis has the kind "walls"')
    if domain.size is None:
        if kinds != ["open"] * 3:
            findings.add(("domain", "size"), "is missing: the lengths along x, y and z")
        return
    if not flat and len(domain.size) == 2:
        findings.add(("domain", "size"), "must have three lengths, [x, y, z] (dimensions = 3)")
    for axis, (kind, length) in enumerate(zip(kinds, domain.size, strict=False)):
        if kind == "open" and length < 0:
            findings.add(("domain", "size", axis), "must not be negative")
        if kind != "open" and length <= 0:
            findings.add(("domain", "size", axis), "must be positive and finite")


def _check_materials(fields: SceneFields, places: Places, findings: Findings) -> None:
    declared: dict[str, int] = {}
    for material, place in zip(fields.materials, places["material"], strict=True):
        if material.name in declared:
            findings.add(("material", place, "name"), f"material[{declared[material.name]}] has this name too")
        declared.setdefault(material.name, place)
    listed = {name for pair in fields.pairs for name in pair.materials}
    used: list[tuple[Path, str]] = []
    if fields.domain is not None and fields.domain.material is not None:
        used.append((("domain", "material"), fields.domain.material))
    for section, items in (("body", fields.bodies), ("fill", fields.fills), ("import", fields.imports)):
        for item, place in zip(items, places[section], strict=True):
            if item.material is not None:
                used.append(((section, place, "material"), item.material))
    # With a [[material]] that could not be read, nobody knows which names are missing.
    whole = not findings.problems_in("material")
    # Known is what [[material]] declares; without that, what [[pair]] speaks of; without both a name is a mere label.
    known = set(declared) or listed
    if known and whole:
        for path, name in used:
            if name not in known:
                where = "[[material]] declares it" if declared else "[[pair]] speaks of it"
                findings.add(path, f"is not a known material: no {where}{_guess(name, known)}")
    pairs: dict[frozenset[str], int] = {}
    for pair, place in zip(fields.pairs, places["pair"], strict=True):
        known_here = set(declared) or {name for _, name in used}
        for which, name in enumerate(pair.materials):
            if name not in known_here and whole:
                where = (
                    "no [[material]] declares it" if declared else "nothing is made of it and no [[material]] has it"
                )
                findings.add(
                    ("pair", place, "materials", which), f"is not a known material: {where}{_guess(name, known_here)}"
                )
        key = frozenset(pair.materials)
        if key in pairs:
            findings.add(("pair", place, "materials"), f"pair[{pairs[key]}] is the same pair")
        pairs.setdefault(key, place)


def _guess(name: str, known: Iterable[str]) -> str:
    guess = nearest(name, known) or next((word for word in known if word.lower() == name.lower()), None)
    return "" if guess is None else f'; the nearest is "{guess}"'


def _check_body(body: Body, path: Path, flat: bool, findings: Findings) -> None:
    if isinstance(body.shape, PlaneShape):
        _check_plane(body, body.shape, path, flat, findings)
        return
    _check_shape(body.shape, (*path, "shape"), flat, findings)
    if body.position is None and not isinstance(body.shape, MeshShape):
        findings.add((*path, "position"), "is missing")
    for name in ("position", "velocity"):
        _check_vector(getattr(body, name), (*path, name), flat, findings)
    _check_spin(body, path, flat, findings)
    if isinstance(body.shape, MeshShape):
        _check_surroundings(body, path, findings)
        return
    if body.fixed:
        if body.inertia is not None:
            findings.add((*path, "inertia"), "a fixed body has none")
        return
    check_mass(body.mass, body.density, path, findings)
    if isinstance(body.shape, BallShape):
        if body.inertia is not None and (body.mass is None) != (body.density is None):
            _check_inertia(body, body.shape.radius, path, flat, findings)
    elif body.inertia is not None:
        _check_moments(three_moments(body.inertia), path, findings)


def three_moments(inertia: float | list[float]) -> list[float]:
    """The moments about the three principal axes, kg m², of one number for all or three."""
    return inertia if isinstance(inertia, list) else [inertia] * 3


def _check_moments(moments: list[float], path: Path, findings: Findings) -> None:
    try:
        _carom.check_inertia(moments)
    except _carom.ShapeError as error:
        findings.add((*path, "inertia"), str(error))


def _check_surroundings(body: Body, path: Path, findings: Findings) -> None:
    """A mesh of triangles, which need not bound anything, has no mass."""
    for name in ("mass", "density", "inertia"):
        if getattr(body, name) is not None:
            findings.add((*path, name), "a mesh has none: it is always fixed")
    if not body.fixed:
        reason = 'must be true: a mesh is surroundings, which bodies hit; a body that moves has the kind "convex"'
        findings.add((*path, "fixed"), reason if body.fixed is False else f"is missing: it {reason}")


def _check_shape(shape: Shape, path: Path, flat: bool, findings: Findings) -> None:
    """What one field of a shape alone cannot tell."""
    if flat and not isinstance(shape, BallShape):
        findings.add((*path, "kind"), 'must be "ball" (a disc) or "plane" (dimensions = 2)')
    if isinstance(shape, MeshShape):
        _check_place(shape.mesh, (*path, "mesh"), findings)
    if isinstance(shape, ConvexShape):
        _check_convex(shape, path, findings)
    if isinstance(shape, CompoundShape):
        for place, part in enumerate(shape.parts):
            where = (*path, "parts", place)
            _check_vector(part.position, (*where, "position"), False, findings)
            _check_unit(part.orientation, (*where, "orientation"), findings)
            if isinstance(part.shape, ConvexShape):
                _check_convex(part.shape, (*where, "shape"), findings)
                if part.shape.parts is not None:
                    reason = "a part is convex: it cannot have parts; take a convex body of its own, or hull = true"
                    findings.add((*where, "shape", "parts"), reason)


def _check_convex(shape: ConvexShape, path: Path, findings: Findings) -> None:
    if shape.points is None and shape.mesh is None:
        findings.add((*path, "points"), "is missing: give points or mesh")
    if shape.points is not None:
        if shape.mesh is not None:
            findings.add((*path, "mesh"), "give points or mesh, not both")
        for name in ("scale", "hull", "parts"):
            if getattr(shape, name) is not None and shape.mesh is None:
                findings.add((*path, name), "is for a mesh; of points the convex hull is taken as it is")
    if shape.mesh is not None:
        _check_place(shape.mesh, (*path, "mesh"), findings)
    if shape.hull and shape.parts is not None:
        findings.add((*path, "parts"), "give hull or parts, not both")


def check_mass(mass: float | None, density: float | None, path: Path, findings: Findings) -> None:
    """A free body has a mass or a density."""
    if mass is None and density is None:
        findings.add((*path, "mass"), "is missing: give mass or density")
    elif mass is not None and density is not None:
        findings.add((*path, "density"), f"give mass or density, not both (mass = {mass!r})")


def _check_spin(body: Body, path: Path, flat: bool, findings: Findings) -> None:
    spin = body.angular_velocity
    if spin is not None and len(spin) == 2:
        findings.add((*path, "angular_velocity"), "must have three components, [0, 0, z] where dimensions = 2")
    elif spin is not None and flat and (spin[0] != 0 or spin[1] != 0):
        findings.add((*path, "angular_velocity"), "the x and y components must be 0 (dimensions = 2)")
    turn = body.orientation
    if (
        _check_unit(turn, (*path, "orientation"), findings)
        and flat
        and turn is not None
        and (turn[1], turn[2]) != (0, 0)
    ):
        findings.add((*path, "orientation"), "must turn about z alone, [w, 0, 0, z] (dimensions = 2)")


def _check_unit(turn: list[float] | None, path: Path, findings: Findings) -> bool:
    length = 1.0 if turn is None else math.hypot(*turn)
    if not abs(length - 1) <= UNIT_TOLERANCE:
        findings.add(path, f"must be a unit quaternion [w, x, y, z]; its length is {length!r}")
        return False
    return True


def ball_mass(mass: float | None, density: float | None, radius: float, flat: bool) -> float:
    """Mass in kg of a ball (or disc) of which either the mass or the density is given."""
    if mass is not None:
        return mass
    volume = math.pi * radius * radius if flat else 4 / 3 * math.pi * radius * radius * radius
    return (density or math.nan) * volume


def _check_inertia(body: Body, radius: float, path: Path, flat: bool, findings: Findings) -> None:
    moments = body.inertia if isinstance(body.inertia, list) else [body.inertia or math.nan]
    if len(set(moments)) > 1:
        findings.add((*path, "inertia"), "the three moments of a ball must be equal")
        return
    # Of all mass within a radius, that of a hoop (2-D) or a hollow sphere resists turning most.
    most = (1 if flat else 2 / 3) * ball_mass(body.mass, body.density, radius, flat) * radius * radius
    if moments[0] > most * (1 + INERTIA_TOLERANCE):
        what = "a hoop, m r^2" if flat else "a hollow sphere, 2/3 m r^2"
        findings.add(
            (*path, "inertia"), f"is more than any ball of this mass and radius has: that of {what}, is {most!r}"
        )


def _check_plane(body: Body, shape: PlaneShape, path: Path, flat: bool, findings: Findings) -> None:
    for name in ("mass", "density", "inertia", "orientation", "angular_velocity"):
        if getattr(body, name) is not None:
            findings.add((*path, name), "a plane has none: it is always fixed and does not turn")
    if body.position is not None:
        findings.add((*path, "position"), "a plane has none: shape.offset says where it is")
    if body.fixed is False:
        findings.add((*path, "fixed"), "a plane is always fixed")
    _check_vector(shape.normal, (*path, "shape", "normal"), flat, findings)
    _check_vector(body.velocity, (*path, "velocity"), flat, findings)
    length = math.hypot(*shape.normal)
    if length == 0 or not math.isfinite(length):
        findings.add((*path, "shape", "normal"), "must have a direction: its length must be positive and finite")


def _check_fill(fill: Fill, path: Path, fields: SceneFields, findings: Findings, domain_by_import: bool) -> None:
    flat = fields.dimensions == 2
    before = len(findings.problems)
    for name in ("velocity", "center", "size"):
        _check_vector(getattr(fill, name), (*path, name), flat, findings)
    check_mass(fill.mass, fill.density, path, findings)
    if fill.shape is not None:
        _check_fill_of_solids(fill, fill.shape, path, flat, findings)
    else:
        _check_fill_of_balls(fill, path, flat, findings)
    if fill.size is not None:
        for axis, length in enumerate(fill.size[: fields.dimensions]):
            if length <= 0:
                findings.add((*path, "size", axis), "must be positive and finite")
    elif fields.domain is None and not domain_by_import:
        findings.add((*path, "size"), "is missing: there is no [domain] to fill")
    elif fields.domain is not None and "open" in axis_kinds(fields.domain, fields.dimensions)[: fields.dimensions]:
        findings.add((*path, "size"), "is missing: the domain is open, so it cannot be filled as a whole")
    if len(findings.problems) > before or domain_by_import or findings.problems_in("domain"):
        return
    _check_region(fill, path, fields, findings)
    if fill.shape is None:
        _check_room(fill, path, fields, findings)
        check_count(fill, path, fill_count(fill, fields.domain, fields.dimensions), findings)


def check_count(fill: Fill, path: Path, count: int, findings: Findings) -> None:
    """What packing or spacing come to must be a number of bodies that can be numbered."""
    name = "spacing" if fill.spacing is not None else "packing"
    if fill.count is None and getattr(fill, name) is not None and not 1 <= count <= LARGEST_COUNT:
        bodies = "balls" if fill.shape is None else "bodies"
        reason = f"comes to {count} {bodies} in this region; must come to 1 at least, {LARGEST_COUNT} at most"
        findings.add((*path, name), reason)


def _check_fill_of_balls(fill: Fill, path: Path, flat: bool, findings: Findings) -> None:
    if fill.count is None and fill.packing is None:
        findings.add((*path, "count"), "is missing: give count or packing")
    if fill.placement == "fcc" and flat:
        findings.add((*path, "placement"), 'must be "cubic" (a square lattice) or "random" (dimensions = 2)')
    if fill.spacing is not None:
        findings.add((*path, "spacing"), "is for bodies with a shape; balls have count or packing")
    # With a shape that could not be read, nobody knows whether a radius is missing.
    if fill.radius is None and not findings.problems_under((*path, "shape")):
        findings.add((*path, "radius"), "is missing: give radius, for balls, or shape")
    _check_radius(fill, path, findings)
    _check_packing(fill, path, flat, findings)


def _check_fill_of_solids(fill: Fill, shape: Shape, path: Path, flat: bool, findings: Findings) -> None:
    _check_shape(shape, (*path, "shape"), flat, findings)
    if fill.radius is not None:
        findings.add((*path, "radius"), "give radius, for balls, or shape, not both")
    if fill.placement == "random":
        reason = 'must be "cubic" or "fcc" with a shape: random places are found for balls only'
        given = "placement" in fill.model_fields_set
        findings.add((*path, "placement"), reason if given else f"is missing: it {reason}")
    if fill.count is None and fill.packing is None and fill.spacing is None:
        findings.add((*path, "count"), "is missing: give count, packing or spacing")
    if fill.packing is not None and fill.count is not None:
        findings.add((*path, "packing"), "give count or packing, not both: bodies with a shape are not scaled")
    elif fill.packing is not None and fill.spacing is not None:
        findings.add((*path, "packing"), "give packing or spacing, not both")


def _check_packing(fill: Fill, path: Path, flat: bool, findings: Findings) -> None:
    if fill.packing is None:
        return
    cubic, closest = (math.pi / 4, math.pi / math.sqrt(12)) if flat else (math.pi / 6, FCC_PACKING)
    if fill.placement == "cubic" and fill.packing > cubic:
        findings.add((*path, "packing"), f"is more than {'a square' if flat else 'a cubic'} lattice holds, {cubic:.6f}")
    elif fill.packing > closest and not isinstance(
        fill.radius, LognormalRadius | MixtureRadius | NormalRadius | UniformRadius
    ):
        findings.add(
            (*path, "packing"),
            f"is more than the closest packing of equal {'discs' if flat else 'balls'}, {closest:.6f}",
        )


def _check_radius(fill: Fill, path: Path, findings: Findings) -> None:
    radius = fill.radius
    if isinstance(radius, UniformRadius) and radius.high < radius.low:
        findings.add((*path, "radius", "high"), f"must not be less than low = {radius.low!r}")
    if isinstance(radius, NormalRadius) and 3 * radius.deviation >= radius.mean:
        findings.add(
            (*path, "radius", "deviation"), f"must be less than a third of mean = {radius.mean!r}: radii are positive"
        )
    if isinstance(radius, MixtureRadius) and len(radius.radii) != len(radius.shares):
        findings.add((*path, "radius", "shares"), f"must be as many as radii: {len(radius.radii)}")


def _check_region(fill: Fill, path: Path, fields: SceneFields, findings: Findings) -> None:
    """A region that sticks out of the walls would put balls outside them."""
    if fields.domain is None or fields.domain.size is None:
        return
    center, size = region(fill, fields.domain, fields.dimensions)
    kinds = axis_kinds(fields.domain, fields.dimensions)
    for axis in range(fields.dimensions):
        if kinds[axis] == "open":
            continue
        reach, half = abs(center[axis]) + size[axis] / 2, fields.domain.size[axis] / 2
        if reach > half * (1 + 1e-15):
            what = "size" if fill.size is not None else "center"
            findings.add(
                (*path, what),
                f"the region must be inside the domain: along {'xyz'[axis]} it reaches {reach!r}, the domain {half!r}",
            )
            return


def _check_room(fill: Fill, path: Path, fields: SceneFields, findings: Findings) -> None:
    """The largest ball must fit into the region."""
    if fill.packing is not None and fill.count is not None:
        return  # the radii will be scaled
    match fill.radius:
        case UniformRadius(low=radius) | ConstantRadius(value=radius):
            pass
        case MixtureRadius(radii=radii):
            radius = max(radii)
        case NormalRadius(mean=radius) | LognormalRadius(mean=radius):
            pass
        case radius:
            assert radius is not None
    side = min(region(fill, fields.domain, fields.dimensions)[1][: fields.dimensions])
    if 2 * radius > side:
        findings.add((*path, "radius"), f"is too large for the region, whose shortest side is {side!r} m")


def _check_import(item: Import, path: Path, fields: SceneFields, findings: Findings) -> None:
    flat = fields.dimensions == 2
    for name in ("velocity", "origin"):
        _check_vector(getattr(item, name), (*path, name), flat, findings)
    if item.mass is not None and item.density is not None:
        findings.add((*path, "density"), f"give mass or density, not both (mass = {item.mass!r})")
    if item.box and fields.domain is not None:
        findings.add((*path, "box"), "the scene has a [domain] already; take out one of them")
    given = item.columns.model_fields_set
    for left, right in (("radius", "diameter"), ("velocity", "momentum")):
        if left in given and right in given:
            findings.add((*path, "columns", right), f"give {left} or {right}, not both")
    for name, same in (
        ("radius", ("radius", "diameter")),
        ("mass", ("mass",)),
        ("velocity", ("velocity", "momentum")),
        ("density", ("mass",)),
    ):
        for column in same:
            if getattr(item, name) is not None and column in given and not (column == "mass" and "momentum" in given):
                findings.add((*path, "columns", column), f"{name} is given for all: take out one of them")
    _check_place(item.file, (*path, "file"), findings)


def _check_place(file: str, path: Path, findings: Findings) -> None:
    """Files are in the scene's folder or below, so that a scene can be given away with all that it needs."""
    if PureWindowsPath(file).is_absolute() or PurePosixPath(file).is_absolute() or PureWindowsPath(file).drive:
        findings.add(path, "must be relative to the folder of the scene")
    elif leaves_folder(file):
        findings.add(path, "must be inside the folder of the scene")


def leaves_folder(name: str) -> bool:
    """Whether a relative path goes up and out of the folder that it starts from."""
    depth = 0
    for part in name.replace("\\", "/").split("/"):
        depth += -1 if part == ".." else 0 if part in ("", ".") else 1
        if depth < 0:
            return True
    return False
