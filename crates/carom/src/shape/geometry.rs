//! What a simulation needs to know of a body's shape: the shape along its principal axes, its inertia, and the way back
//! to the frame in which the user gave it.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::compound::{axes, conjugate, product, quaternion, unit};
use super::error::ShapeError;
use super::principal::principal;
use super::{Polyhedron, Shape};
use crate::tolerance::{CENTRED, COARSEST_MOMENTS, EQUAL_MOMENTS};

const IDENTITY: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

/// A shape in its principal frame: centre of mass at the origin, principal axes along x, y, z. The user's frame is the
/// one in which the shape was given. Shapes that were given centred and along their principal axes are the same, bit by
/// bit.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyGeometry {
    /// The shape in the principal frame.
    pub shape: Shape,
    /// Volume (m³).
    pub volume: f64,
    /// Principal moments of inertia per unit of mass (m²), about x, y, z. Moments that are equal are exactly equal.
    pub gyration: DVec3,
    /// Largest distance of a point from the centre of mass (m).
    pub radius: f64,
    /// Radius of a ball about the centre of mass within the body (m); 0 where the centre of mass is outside.
    pub in_radius: f64,
    /// The centre of mass in the user's frame (m).
    pub centre: DVec3,
    /// The principal axes in the user's frame: unit quaternion (w, x, y, z), principal frame to user's frame.
    pub orientation: [f64; 4],
}

impl BodyGeometry {
    /// Of a homogeneous body.
    ///
    /// # Errors
    /// As [`Shape::check`].
    pub fn new(shape: &Shape) -> Result<Self, ShapeError> {
        shape.check()?;
        let size = shape.bounds([1.0, 0.0, 0.0, 0.0]).half_diagonal();
        let given = shape.mass_properties();
        let far = given.centre.length();
        let (shape, mass, centre) = if far <= CENTRED * size {
            (shape.clone(), given, DVec3::ZERO)
        } else {
            // Far from the origin the centre is a rounded number. Seen from it, what is left is small and has all digits.
            let near = seen_from(shape, given.centre, DMat3::IDENTITY, IDENTITY);
            let mass = near.mass_properties();
            (seen_from(&near, mass.centre, DMat3::IDENTITY, IDENTITY), mass, given.centre + mass.centre)
        };
        let largest = mass.inertia.x_axis.x.max(mass.inertia.y_axis.y).max(mass.inertia.z_axis.z);
        let coarser = ((far + size) / size).min(COARSEST_MOMENTS);
        let found = principal(mass.inertia, EQUAL_MOMENTS * coarser * largest);
        let orientation = quaternion(found.axes);
        let shape = seen_from(&shape, DVec3::ZERO, found.axes, orientation);
        Ok(Self {
            radius: shape.radius(),
            in_radius: shape.in_radius(),
            shape,
            volume: mass.volume,
            gyration: found.moments / mass.volume,
            centre,
            orientation,
        })
    }

    /// Mass (kg) at a density (kg/m³).
    ///
    /// # Errors
    /// A density that is not positive and finite, or gives such a mass.
    pub fn mass(&self, density: f64) -> Result<f64, ShapeError> {
        let mass = amount("density", density)? * self.volume;
        amount("mass", mass)
    }

    /// Principal moments of inertia (kg m²) of this body with a mass (kg).
    ///
    /// # Errors
    /// A mass that is not positive and finite.
    pub fn moments(&self, mass: f64) -> Result<DVec3, ShapeError> {
        Ok(self.gyration * amount("mass", mass)?)
    }

    /// Where the principal frame is and how it is turned when the user's frame is at `position` (m), turned by
    /// `orientation` (w, x, y, z): the position of the centre of mass, and the orientation of the principal axes.
    ///
    /// # Errors
    /// An orientation that is not a unit quaternion.
    pub fn to_principal(&self, position: DVec3, orientation: [f64; 4]) -> Result<(DVec3, [f64; 4]), ShapeError> {
        let orientation = unit(0, orientation)?;
        let centre = position + axes(orientation) * self.centre;
        Ok((centre, product(orientation, self.orientation)))
    }

    /// How the principal axes are turned (w, x, y, z; to world) when the user's frame is turned by `orientation`.
    pub fn principal_orientation(&self, orientation: [f64; 4]) -> [f64; 4] {
        product(orientation, self.orientation)
    }

    /// Where the user's frame is and how it is turned when the centre of mass is at `position` (m) and the principal
    /// axes are turned by `orientation` (w, x, y, z).
    pub fn to_users(&self, position: DVec3, orientation: [f64; 4]) -> (DVec3, [f64; 4]) {
        let orientation = product(orientation, conjugate(self.orientation));
        (position - axes(orientation) * self.centre, orientation)
    }

    /// The velocity of the centre of mass (m/s) when the user's origin, fixed to the body, has `velocity` (m/s) and the
    /// body turns at `angular_velocity` (rad/s, world axes): v + ω × R c.
    pub fn velocity_of_centre(&self, velocity: DVec3, angular_velocity: DVec3, orientation: [f64; 4]) -> DVec3 {
        velocity + angular_velocity.cross(axes(orientation) * self.centre)
    }
}

fn amount(field: &'static str, value: f64) -> Result<f64, ShapeError> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(ShapeError::Amount { field, value }) }
}

/// The shape in the coordinates of the principal frame. Balls, capsules, cylinders and ellipsoids are in theirs already.
fn seen_from(shape: &Shape, centre: DVec3, turn: DMat3, orientation: [f64; 4]) -> Shape {
    match shape {
        Shape::Polyhedron(body) if centre != DVec3::ZERO || turn != DMat3::IDENTITY => {
            Shape::Polyhedron(Arc::new(Polyhedron::seen_from(body, centre, turn)))
        }
        Shape::Compound(body) => Shape::Compound(Arc::new(body.seen_from(centre, orientation))),
        _ => shape.clone(),
    }
}
