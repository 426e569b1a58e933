//! Bodies of several convex parts.

use glam::{DMat3, DQuat, DVec3};

use super::Shape;
use super::error::ShapeError;
use super::mass::MassProperties;
use crate::tolerance::{SHAPE_LIMITS, UNIT_LENGTH};

/// A convex part of a compound.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its shape, in its own frame.
    pub shape: Shape,
    /// Where the origin of its frame is in that of the compound (m).
    pub position: DVec3,
    /// How its frame is turned: unit quaternion (w, x, y, z), part to compound.
    pub orientation: [f64; 4],
}

impl Part {
    /// The axes of its frame as columns, in that of the compound.
    pub fn axes(&self) -> DMat3 {
        axes(self.orientation)
    }
}

/// Convex parts that move as one body. Parts may touch and overlap; where they overlap, mass counts twice.
#[derive(Clone, Debug, PartialEq)]
pub struct Compound {
    /// The parts.
    pub parts: Vec<Part>,
}

impl Compound {
    /// Checks the parts; their orientations are normalised.
    ///
    /// # Errors
    /// No parts, a part that is a compound or whose shape is refused, a position that is not finite, an orientation
    /// that is not a unit quaternion.
    pub fn new(mut parts: Vec<Part>) -> Result<Self, ShapeError> {
        if parts.is_empty() {
            return Err(ShapeError::Empty { what: "parts" });
        }
        for (index, part) in parts.iter_mut().enumerate() {
            if matches!(part.shape, Shape::Compound(_)) {
                return Err(ShapeError::Nested { part: index });
            }
            part.shape.check()?;
            if !(part.position.abs().max_element() <= *SHAPE_LIMITS.end()) || part.position.is_nan() {
                return Err(ShapeError::PartPosition { part: index, value: part.position });
            }
            part.orientation = unit(index, part.orientation)?;
        }
        Ok(Self { parts })
    }

    /// Volume, centre of mass and inertia: the sum over the parts.
    pub(super) fn mass_properties(&self) -> MassProperties {
        let part = |part: &Part| (part.shape.mass_properties(), part.position, part.axes());
        MassProperties::together(&self.parts.iter().map(part).collect::<Vec<_>>())
    }

    /// The same body in the coordinates of a frame at `centre` (m), whose axes are turned by the quaternion (w, x, y, z).
    pub(super) fn seen_from(&self, centre: DVec3, orientation: [f64; 4]) -> Self {
        let turn = axes(orientation).transpose();
        let back = conjugate(orientation);
        let parts = self.parts.iter().map(|part| Part {
            shape: part.shape.clone(),
            position: turn * (part.position - centre) + DVec3::ZERO,
            orientation: product(back, part.orientation),
        });
        Self { parts: parts.collect() }
    }
}

/// A quaternion from outside, normalised.
pub(super) fn unit(index: usize, value: [f64; 4]) -> Result<[f64; 4], ShapeError> {
    let square = value.iter().map(|x| x * x).sum::<f64>();
    if !((square - 1.0).abs() <= 2.0 * UNIT_LENGTH) {
        return Err(ShapeError::NotUnit { index, value });
    }
    let length = square.sqrt();
    Ok(value.map(|x| x / length))
}

/// The rotation matrix of a unit quaternion (w, x, y, z).
pub(super) fn axes([w, x, y, z]: [f64; 4]) -> DMat3 {
    DMat3::from_quat(DQuat::from_xyzw(x, y, z, w))
}

/// The unit quaternion (w, x, y, z) of a rotation matrix, w >= 0.
pub(super) fn quaternion(axes: DMat3) -> [f64; 4] {
    let q = DQuat::from_mat3(&axes).normalize();
    let [x, y, z, w] = if q.w < 0.0 { -q } else { q }.to_array();
    [w, x, y, z]
}

/// The rotation back. The identity stays itself, bit by bit.
pub(super) fn conjugate([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [w, 0.0 - x, 0.0 - y, 0.0 - z]
}

/// First q, then p. The identity changes nothing, bit by bit.
pub(super) fn product(p: [f64; 4], q: [f64; 4]) -> [f64; 4] {
    const IDENTITY: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
    if p == IDENTITY {
        return q;
    }
    if q == IDENTITY {
        return p;
    }
    let both = DQuat::from_xyzw(p[1], p[2], p[3], p[0]) * DQuat::from_xyzw(q[1], q[2], q[3], q[0]);
    let both = both.normalize();
    [both.w, both.x, both.y, both.z]
}
