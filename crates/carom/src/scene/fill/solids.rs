//! Many bodies that turn, all of one shape, on a lattice.

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};

use super::lattice::Lattice;
use super::{Fill, Placement, Region, thermal_velocities};
use crate::error::CheckError;
use crate::random::Random;
use crate::scene::{Scene, SolidBody};
use crate::shape::BodyGeometry;

/// A field, its value and what is wrong with it.
type Wrong = (&'static str, String, String);

fn wrong(field: &'static str, value: impl std::fmt::Display, reason: impl Into<String>) -> Wrong {
    (field, value.to_string(), reason.into())
}

/// Bodies that turn, to be placed: alike, each turned at random.
#[derive(Clone, Debug)]
pub struct SolidFill {
    /// Id of the first; the others count on.
    pub first_id: i64,
    /// Their shape, which they share.
    pub geometry: Arc<BodyGeometry>,
    /// Where they go; not [`Placement::Random`].
    pub placement: Placement,
    /// How many.
    pub count: u64,
    /// Distance of neighbouring sites (m); `None`: as far apart as the region allows.
    pub spacing: Option<f64>,
    /// Mass of each (kg).
    pub mass: Option<f64>,
    /// Density (kg/m³); one of these two.
    pub density: Option<f64>,
    /// kT (J): the energy of translation is 3/2 (N − 1) kT, that of rotation 3/2 N kT.
    pub temperature: f64,
    /// Drift, added to all velocities (m/s).
    pub velocity: DVec3,
    /// Middle of the region (m); `None`: the origin.
    pub center: Option<DVec3>,
    /// Lengths of the region (m); `None`: the domain.
    pub size: Option<DVec3>,
    /// Index of the material.
    pub material: u32,
}

impl SolidFill {
    /// How many sites of a lattice with this spacing (m) there are for bodies within a ball of `radius` (m), in a region of
    /// this size (m) that closes on itself along some axes. 0 if none fits.
    pub fn sites(placement: Placement, size: DVec3, wraps: [bool; 3], radius: f64, spacing: f64) -> usize {
        let region = Region { center: DVec3::ZERO, size, wraps, dimensions: 3 };
        Lattice::spaced(&region, placement == Placement::Fcc, radius, spacing).map_or(0, |lattice| lattice.sites())
    }

    /// Adds the bodies to `solids`. `row` is its place after all fills of balls: its sequence of the one generator, and its
    /// name in errors.
    pub(in crate::scene) fn place(
        &self,
        row: usize,
        scene: &Scene,
        solids: &mut Vec<SolidBody>,
    ) -> Result<(), CheckError> {
        let named = |(field, value, reason): Wrong| Fill::wrong(row, field, value, reason);
        let mass = self.check(scene).map_err(named)?;
        let region = Region::new(row, scene, self.center, self.size)?;
        let positions = self.positions(&region).map_err(named)?;
        let mut random = Random::new(scene.seed, row as u64);
        let orientations: Vec<[f64; 4]> = positions.iter().map(|_| random_orientation(&mut random)).collect();
        let masses = vec![mass; positions.len()];
        let velocities = thermal_velocities(self.temperature, scene.dimensions, &masses, &mut random);
        let spins = self.thermal_spins(mass, &orientations, &mut random);
        for k in 0..positions.len() {
            solids.push(SolidBody {
                id: self.first_id + k as i64,
                geometry: Arc::clone(&self.geometry),
                position: positions[k],
                orientation: orientations[k],
                velocity: velocities[k] + self.velocity,
                angular_velocity: spins[k],
                mass,
                inertia: None,
                material: self.material,
                fixed: false,
            });
        }
        Ok(())
    }

    /// Checks what is given; the mass of one (kg).
    fn check(&self, scene: &Scene) -> Result<f64, Wrong> {
        if scene.dimensions != 3 {
            return Err(wrong("shape", "given", "needs dimensions = 3"));
        }
        if self.placement == Placement::Random {
            let reason = "must be \"cubic\" or \"fcc\" for bodies that turn: random places are found for balls only";
            return Err(wrong("placement", "random", reason));
        }
        if !(1..1 << 30).contains(&self.count) {
            return Err(wrong("count", self.count, "must be from 1 to 1073741823"));
        }
        if self.material as usize >= scene.materials {
            return Err(wrong("material", self.material, "there is no such material"));
        }
        if !(self.temperature.is_finite() && self.temperature >= 0.0) {
            return Err(wrong("temperature", self.temperature, "must be 0 or more and finite"));
        }
        if !self.velocity.is_finite() {
            return Err(wrong("velocity", self.velocity, "must be finite"));
        }
        let (field, value, mass) = match (self.mass, self.density) {
            (Some(mass), None) => ("mass", mass, self.geometry.moments(mass).map(|_| mass)),
            (None, Some(density)) => ("density", density, self.geometry.mass(density)),
            _ => return Err(wrong("mass", "not given", "exactly one of mass and density is needed")),
        };
        mass.map_err(|_| wrong(field, value, "must be positive and finite"))
    }

    fn positions(&self, region: &Region) -> Result<Vec<DVec3>, Wrong> {
        let fcc = self.placement == Placement::Fcc;
        let (radius, count) = (self.geometry.radius, self.count as usize);
        let too_large = || {
            let reason = format!("is too large for the region: it turns within a ball of {} m diameter", 2.0 * radius);
            wrong("shape", "given", reason)
        };
        let lattice = |spacing| Lattice::spaced(region, fcc, radius, spacing);
        let closest = lattice(2.0 * radius).ok_or_else(too_large)?;
        let Some(spacing) = self.spacing else {
            if closest.sites() < count {
                let reason = format!(
                    "has {} sites for {count} bodies in this region: they are {} m apart, the diameter of the ball within \
                     which a body turns; ask for fewer or smaller bodies",
                    closest.sites(),
                    2.0 * radius
                );
                return Err(wrong("placement", if fcc { "fcc" } else { "cubic" }, reason));
            }
            let sites = |spacing| lattice(spacing).map_or(0, |lattice| lattice.sites());
            let widest = widest(2.0 * radius, 2.0 * region.size.length(), |spacing| sites(spacing) >= count);
            // Rounded down, so that no rounding of a multiple of it reaches into the walls.
            let spacing = (widest * (1.0 - 8.0 * f64::EPSILON)).max(2.0 * radius);
            return Ok(lattice(spacing).unwrap_or(closest).spread(count));
        };
        if !(spacing.is_finite() && spacing >= 2.0 * radius) {
            let reason = format!("is less than the {} m of the ball within which a body turns", 2.0 * radius);
            return Err(wrong("spacing", spacing, reason));
        }
        let lattice = lattice(spacing).ok_or_else(too_large)?;
        if lattice.sites() < count {
            let reason = format!("are more than the {} sites that this spacing leaves in the region", lattice.sites());
            return Err(wrong("count", self.count, reason));
        }
        Ok(lattice.spread(count))
    }

    /// Angular velocities (rad/s, world axes): each principal axis has 1/2 kT on average, all together 3/2 N kT exactly. One
    /// body alone has what is drawn.
    fn thermal_spins(&self, mass: f64, orientations: &[[f64; 4]], random: &mut Random) -> Vec<DVec3> {
        let moments = self.geometry.gyration * mass;
        let drawn: Vec<DVec3> = orientations
            .iter()
            .map(|_| {
                let normal = random.normal_vector(3);
                DVec3::from_array([0, 1, 2].map(|axis| normal[axis] * (self.temperature / moments[axis]).sqrt()))
            })
            .collect();
        let energy: f64 = drawn.iter().map(|spin| 0.5 * (moments * *spin).dot(*spin)).sum();
        let wanted = 1.5 * drawn.len() as f64 * self.temperature;
        let factor = if drawn.len() > 1 && energy > 0.0 { (wanted / energy).sqrt() } else { 1.0 };
        let principal = axes(self.geometry.orientation);
        orientations
            .iter()
            .zip(&drawn)
            .map(|(orientation, spin)| axes(*orientation) * (principal * (factor * *spin)))
            .collect()
    }
}

/// The largest spacing (m) that is still `enough`, between one that is and one that is not, by bisection.
fn widest(mut enough_at: f64, mut too_far: f64, enough: impl Fn(f64) -> bool) -> f64 {
    loop {
        let middle = 0.5 * (enough_at + too_far);
        if middle <= enough_at || middle >= too_far {
            return enough_at;
        }
        if enough(middle) {
            enough_at = middle;
        } else {
            too_far = middle;
        }
    }
}

fn axes([w, x, y, z]: [f64; 4]) -> DMat3 {
    DMat3::from_quat(DQuat::from_xyzw(x, y, z, w))
}

/// A unit quaternion (w, x, y, z), all rotations being equally likely: four normals have no preferred direction.
fn random_orientation(random: &mut Random) -> [f64; 4] {
    loop {
        let drawn = [random.normal(), random.normal(), random.normal(), random.normal()];
        let length = drawn.iter().map(|x| x * x).sum::<f64>().sqrt();
        // Shorter ones are too rare to be missed, and would lose digits.
        if length > 1e-3 {
            return drawn.map(|x| x / length);
        }
    }
}
