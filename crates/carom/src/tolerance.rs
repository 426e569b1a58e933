//! Every tolerance of the simulator: a name, a unit, a reason. Nothing here moves a body or changes an impact.

/// Two surfaces touch when their gap is within this many units in the last place of the largest coordinate or radius
/// involved (pure number). It makes a row of balls at i·2r a row of touching balls; what is deeper is an overlap.
pub const TOUCHING_ULPS: f64 = 4.0;

/// The gap (m) that still counts as touching, for surfaces whose coordinates and radii are at most `largest` (m).
pub fn touching(largest: f64) -> f64 {
    TOUCHING_ULPS * (f64::from_bits(largest.to_bits() + 1) - largest)
}

/// Impacts whose times agree within this fraction of the clock's span belong to one instant (pure number; 8 units in the
/// last place of an offset). It decides only the order among impacts that rounding cannot tell apart.
pub const SAME_INSTANT: f64 = 1.0 / (1u64 << 50) as f64;

/// The residual of an elastic impact's energy is fed back along the normal by at most this fraction of the relative speed
/// (pure number: 4ε). A unit normal rounded in each component puts the speed after wrong by up to about 2ε, and by the same
/// amount each time if it is a wall's. More is never rounding of this impact alone; the rest waits, carried, for the next.
pub const ENERGY_FEEDBACK: f64 = 4.0 * f64::EPSILON;

/// Impacts that lose energy accumulate when one body has [`COLLAPSE_IMPACTS`] of them within this fraction of the clock's
/// span (pure number). A span is some 64 times the time in which the fastest ball crosses its radius, so this is 4e-9 of
/// that time; and it is half a million times the resolution of the clock, below which bounces can get no shorter.
pub const COLLAPSE_WINDOW: f64 = 1.0 / (1u64 << 34) as f64;

/// See [`COLLAPSE_WINDOW`] (a count). A touching row of dozens of balls settles in fewer; a collapse has no last impact.
pub const COLLAPSE_IMPACTS: u32 = 10_000;

/// Lengths, speeds and masses beyond these (in the scene's units) are refused: their squares, or the squares of their
/// squares, would over- or underflow.
pub const LIMITS: std::ops::RangeInclusive<f64> = 1e-75..=1e75;

/// Bodies may become this much faster than those for which the clock's span was made (pure number); a ball of a mass of
/// 1e-12 of its neighbour's becomes a million times as fast. Beyond, an instant's rounding would move them by more than
/// about 1e-8 radii: that is an error, not a slow decay.
pub const MOST_SPEEDUP: f64 = (1u64 << 22) as f64;

/// Cells are wider than the largest ball by this fraction (pure number), so that rounding of a cell's bounds cannot let
/// two balls touch across a whole cell.
pub const CELL_MARGIN: f64 = 1.0 / (1u64 << 20) as f64;

/// What is searched in bins in single precision is searched this much farther (pure number, 128 units in the last place of
/// the fractions of a bin), so that rounding cannot hide a neighbour.
pub const BIN_MARGIN: f64 = 1.0 / (1u64 << 17) as f64;

/// Bounds on times of impact are told for centres this much nearer (pure number, 128ε, in relation to the squares of the distance
/// and of the contact distance), so that rounding cannot make a bound later than the time itself.
pub const BOUND_MARGIN: f64 = 1.0 / (1u64 << 46) as f64;

/// More than any error of numbers too small for all their digits, and less than whatever counts of the fourth powers of lengths
/// and speeds that a scene may have (m⁴/s²).
pub const LEAST_SQUARE: f64 = 1e-306;

/// A touching pair rests when the speed v_AB·n is within this fraction of the two speeds (pure number: 4ε): it is then what
/// rounding of the velocities and of the normal leaves of zero. It names a contact for those who ask, tells an impact law
/// with e = 0 that the pair already is where the law wants it, and tells a collapse from an impact.
pub const RESTING: f64 = 4.0 * f64::EPSILON;

/// Bodies that come round are followed longer than their period by this fraction of it (pure number, 9e-10), for the rounding of
/// its length.
pub const PERIOD_MARGIN: f64 = 1.0 / (1u64 << 30) as f64;

/// A unit vector or quaternion given from outside may differ from length 1 by this much (pure number, about 2e-12): what
/// twelve written digits leave.
pub const UNIT_LENGTH: f64 = 1.0 / (1u64 << 39) as f64;

/// Balls placed by growing are grown beyond their size by this fraction (pure number), so that rounding leaves none of
/// them overlapping.
pub const GROWN: f64 = 1.0 / (1u64 << 36) as f64;

/// A polyhedron's vertices lie in one plane when they are within this fraction of its size (half the diagonal of its
/// bounding box) of it (pure number, 6e-14: 256ε). That is room for the rounding of points that were computed and
/// turned. Points are dropped, not moved; in [`FLATTENING_PASSES`] passes a body loses less than 7e-13 of its size,
/// within what motion resolves.
pub const COPLANAR: f64 = 256.0 * f64::EPSILON;

/// See [`COPLANAR`] (a count). One pass is enough unless details are as fine as the tolerance; after the last they stay.
pub const FLATTENING_PASSES: u32 = 6;

/// The ratio of volume to surface (between a third of the in-radius and the in-radius) of a convex polyhedron is at
/// least this fraction of its size (pure number, 1.5e-11). Thinner, its two sides could not be told apart by
/// [`COPLANAR`].
pub const THIN: f64 = 1.0 / (1u64 << 36) as f64;

/// A mesh is convex when it is nowhere deeper under its convex hull than this fraction of its size (pure number, 1e-6):
/// what coordinates in single precision, as in STL files, leave of a convex body (their steps are 1.2e-7). The hull is
/// the body.
pub const CONVEX: f64 = 1.0 / (1u64 << 20) as f64;

/// Moments and products of inertia that differ by less than this fraction of the largest moment are taken for equal (or
/// zero) (pure number, 1.4e-14: 64ε), so that a cube is a spherical top. It is what rounding of vertices leaves; where
/// a polyhedron was given far from the origin, as much more as its coordinates are coarser.
pub const EQUAL_MOMENTS: f64 = 64.0 * f64::EPSILON;

/// Coordinates far from the origin make [`EQUAL_MOMENTS`] at most so many times coarser (pure number, 7e10): moments
/// that differ by a thousandth are never taken for equal.
pub const COARSEST_MOMENTS: f64 = (1u64 << 36) as f64;

/// A centre of mass within this fraction of the size of the origin is at the origin (pure number: 8ε; a cube's,
/// computed, is within 1ε). A body that was given centred is then not shifted by rounding.
pub const CENTRED: f64 = 8.0 * f64::EPSILON;

/// Moments of inertia given from outside may break I1 + I2 >= I3 by this fraction of I3 (pure number, about 2e-12):
/// what twelve written digits leave. A flat body has I1 + I2 = I3 exactly.
pub const TRIANGLE_INEQUALITY: f64 = 1.0 / (1u64 << 39) as f64;

/// Lengths of shapes beyond these (in the scene's units) are refused: moments of inertia go by the fifth power of a
/// length.
pub const SHAPE_LIMITS: std::ops::RangeInclusive<f64> = 1e-50..=1e50;

/// Most points of a hull, and most vertices of a mesh (a count; a hull of so many takes about a minute).
pub const MOST_POINTS: usize = 1 << 22;

/// Most triangles of a mesh (a count), twice as many as points.
pub const MOST_TRIANGLES: usize = 1 << 23;
/// Components of a body's angular momentum along its principal axes are 0 below this fraction of the largest (pure number,
/// 2^-300 or 5e-91): products of their squares would underflow. Rounding of ω in the world leaves 1e-16, unless the axes of
/// body and world are parallel. (It matters only about the middle axis, where such a body would turn over after about 210
/// times the time constant of that instability.)
pub const NEGLIGIBLE_MOMENTUM: f64 = f64::from_bits((1023 - 300) << 52);
/// Bodies that turn touch when their gap is within this fraction of their size, the larger of the two distances of a farthest
/// point from the centre (pure number, 2⁻⁴⁰ = 9e-13): δ. The time of contact of turning bodies is the root of a transcendental
/// function, and a double root, which is grazing, cannot be told from none in any fixed number of digits. 4,000 times ε,
/// because a gap is a sum of some twenty products of the bodies' size, each rounded, and normals are rounded as well.
pub const CONTACT: f64 = 1.0 / (1u64 << 40) as f64;

/// δ is at least this many ε of the distance between the centres (pure number), which is rounded too.
pub const CONTACT_ROUNDING: f64 = 64.0;

/// So many halves of δ deep, bodies have sunk into each other (a count): fresh impacts are found at rounding, or half of δ deep
/// where the bodies touched already, and a whole δ must not be passed.
pub const SUNK: f64 = 1.5;

/// δ (m) for two bodies of at most `size` (m), whose centres are up to `distance` (m) apart during a prediction.
pub fn contact(size: f64, distance: f64) -> f64 {
    (CONTACT * size).max(CONTACT_ROUNDING * f64::EPSILON * distance)
}

/// The search for the closest points ends when bounds of their distance agree within this fraction (pure number, 64ε): what
/// is left is rounding of some ten products. It decides when to stop, never an event.
pub const DIRECTION: f64 = 64.0 * f64::EPSILON;
