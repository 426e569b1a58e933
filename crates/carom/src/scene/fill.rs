//! Many bodies at once. Balls: on lattices, or at random by insertion and, where it is too dense for that, by growing them
//! with the simulator itself (Lubachevsky–Stillinger). Bodies that turn: on lattices.

mod lattice;
mod solids;

use glam::DVec3;

pub use solids::SolidFill;

use lattice::Lattice;

use super::{Ball, Balls, Scene};
use crate::error::{CheckError, Problem};
use crate::flight::Flight;
use crate::random::Random;
use crate::simulation::Simulation;
use crate::tolerance;
use crate::world::cells::Cells;
use crate::world::nearby::Gathered;
use crate::world::radii::Radii;
use crate::world::{Boundary, Domain, Growth, RestitutionTable, World};

/// Where the balls of a fill go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// A simple cubic lattice (square in two dimensions).
    Cubic,
    /// A face-centred cubic lattice.
    Fcc,
    /// At random, without overlap.
    Random,
}

/// Radii of a fill (m).
#[derive(Clone, Debug, PartialEq)]
pub enum RadiusDistribution {
    /// All the same.
    Constant(f64),
    /// Equally likely between two values.
    Uniform {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// Normal, cut at three deviations.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        deviation: f64,
    },
    /// Lognormal, cut at three deviations of the logarithm.
    Lognormal {
        /// Mean of the radius.
        mean: f64,
        /// Standard deviation of the radius.
        deviation: f64,
    },
    /// Several sizes in fixed shares of the number.
    Mixture {
        /// The sizes.
        radii: Vec<f64>,
        /// Their shares, of any sum.
        shares: Vec<f64>,
    },
}

/// Balls to be placed.
#[derive(Clone, Debug, PartialEq)]
pub struct Fill {
    /// Id of the first; the others count on.
    pub first_id: i64,
    /// Where they go.
    pub placement: Placement,
    /// How many.
    pub count: Option<u64>,
    /// Share of the region's volume (area in two dimensions) that they fill. With `count`, radii are scaled to it.
    pub packing: Option<f64>,
    /// Their radii.
    pub radius: RadiusDistribution,
    /// Mass of each (kg).
    pub mass: Option<f64>,
    /// Or mass by volume (by area in two dimensions).
    pub density: Option<f64>,
    /// kT (J): Maxwell velocities without total momentum, with a kinetic energy of exactly d/2 (N - 1) kT.
    pub temperature: f64,
    /// Added to each (m/s).
    pub velocity: DVec3,
    /// Middle of the region (m); the origin if not given.
    pub center: Option<DVec3>,
    /// Edge lengths of the region (m); the domain if not given.
    pub size: Option<DVec3>,
    /// Index of the material.
    pub material: u32,
}

/// Packing up to which balls are placed by insertion; what is denser is grown from `GROWTH_START`.
const INSERTION_PACKING: f64 = 0.30;
const GROWTH_START: f64 = 0.25;
/// Growth of the diameter over the thermal speed (pure number).
const GROWTH_SPEED: f64 = 0.05;
/// Tries for one ball before it is said not to fit.
const TRIES: u32 = 100_000;
/// Packing up to which growing at this speed gets surely, in two and in three dimensions.
const GROWTH_PACKING: [f64; 2] = [0.80, 0.60];
/// Impacts of one ball in one stage of growth before the density is said not to be reachable; some 40 are usual at 0.60.
const GROWTH_IMPACTS: u64 = 2_000;
/// The box that a fill's balls must stay in, and that its packing refers to.
struct Region {
    center: DVec3,
    size: DVec3,
    /// Axes along which it closes on itself.
    wraps: [bool; 3],
    dimensions: u8,
}

impl Region {
    /// The box that a fill asks for, or the domain.
    fn new(row: usize, scene: &Scene, center: Option<DVec3>, size: Option<DVec3>) -> Result<Self, CheckError> {
        let wrong = |field, value: String, reason| Err(Fill::wrong(row, field, value, reason));
        let mut wraps = [false; 3];
        let mut lengths = DVec3::ZERO;
        for axis in 0..if scene.dimensions == 2 { 2 } else { 3 } {
            let bounded = scene.domain.boundary[axis] != Boundary::Open;
            match size {
                Some(given) => lengths[axis] = given[axis],
                None if bounded => {
                    lengths[axis] = scene.domain.size[axis];
                    wraps[axis] = scene.domain.boundary[axis] == Boundary::Periodic && center.is_none();
                }
                None => return wrong("size", "not given".to_string(), "is needed, because the domain is open"),
            }
            if !(lengths[axis].is_finite() && lengths[axis] > 0.0) {
                return wrong("size", lengths.to_string(), "must be positive and finite");
            }
        }
        let center = center.unwrap_or(DVec3::ZERO);
        if !center.is_finite() || (scene.dimensions == 2 && center.z != 0.0) {
            return wrong("center", center.to_string(), "must be finite, with z = 0 in two dimensions");
        }
        Ok(Self { center, size: lengths, wraps, dimensions: scene.dimensions })
    }

    fn volume(&self) -> f64 {
        if self.dimensions == 2 { self.size.x * self.size.y } else { self.size.element_product() }
    }

    /// Lowest centre and extent of centres for a ball of this radius.
    fn centers(&self, radius: f64) -> (DVec3, DVec3) {
        let mut low = self.center - self.size * 0.5;
        let mut extent = self.size;
        for axis in 0..3 {
            if axis == 2 && self.dimensions == 2 {
                (low[axis], extent[axis]) = (0.0, 0.0);
            } else if !self.wraps[axis] {
                low[axis] += radius;
                extent[axis] -= 2.0 * radius;
            }
        }
        (low, extent)
    }
}

fn ball_volume(radius: f64, dimensions: u8) -> f64 {
    use std::f64::consts::PI;
    if dimensions == 2 { PI * radius * radius } else { 4.0 / 3.0 * PI * radius * radius * radius }
}

impl RadiusDistribution {
    fn is_valid(&self) -> bool {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        match self {
            Self::Constant(radius) => positive(*radius),
            Self::Uniform { low, high } => positive(*low) && positive(*high) && low <= high,
            Self::Normal { mean, deviation } => {
                positive(*mean) && deviation.is_finite() && *deviation >= 0.0 && mean - 3.0 * deviation > 0.0
            }
            Self::Lognormal { mean, deviation } => positive(*mean) && deviation.is_finite() && *deviation >= 0.0,
            Self::Mixture { radii, shares } => {
                !radii.is_empty()
                    && radii.len() == shares.len()
                    && radii.iter().all(|&r| positive(r))
                    && shares.iter().all(|&s| s.is_finite() && s >= 0.0)
                    && shares.iter().any(|&s| s > 0.0)
            }
        }
    }

    /// One radius.
    fn draw(&self, random: &mut Random) -> f64 {
        let cut_normal = |random: &mut Random| loop {
            let x = random.normal();
            if x.abs() <= 3.0 {
                return x;
            }
        };
        match self {
            Self::Constant(radius) => *radius,
            Self::Uniform { low, high } => low + (high - low) * random.uniform(),
            Self::Normal { mean, deviation } => mean + deviation * cut_normal(random),
            Self::Lognormal { mean, deviation } => {
                let variance = libm::log1p((deviation / mean) * (deviation / mean));
                let location = libm::log(*mean) - 0.5 * variance;
                libm::exp(location + variance.sqrt() * cut_normal(random))
            }
            Self::Mixture { radii, shares } => {
                let total: f64 = shares.iter().sum();
                let mut rest = random.uniform() * total;
                for (radius, share) in radii.iter().zip(shares) {
                    if rest < *share {
                        return *radius;
                    }
                    rest -= share;
                }
                radii[radii.len() - 1]
            }
        }
    }
}

impl Fill {
    fn wrong(row: usize, field: &'static str, value: impl std::fmt::Display, reason: impl Into<String>) -> CheckError {
        Problem::new("fill", Some(row as i64), field, value, reason).into()
    }

    /// Adds the fill's balls to `balls`.
    pub(super) fn place(&self, row: usize, scene: &Scene, balls: &mut Balls) -> Result<(), CheckError> {
        let wrong = |field, value: String, reason: &str| Err(Self::wrong(row, field, value, reason));
        if !self.radius.is_valid() {
            return wrong(
                "radius",
                format!("{:?}", self.radius),
                "must be positive and finite, with every ball above 0",
            );
        }
        if self.material as usize >= scene.materials {
            return wrong("material", self.material.to_string(), "there is no such material");
        }
        if !(self.temperature.is_finite() && self.temperature >= 0.0) {
            return wrong("temperature", self.temperature.to_string(), "must be 0 or more and finite");
        }
        if !self.velocity.is_finite() {
            return wrong("velocity", self.velocity.to_string(), "must be finite");
        }
        let (by_mass, value) = match (self.mass, self.density) {
            (Some(mass), None) => (true, mass),
            (None, Some(density)) => (false, density),
            _ => return wrong("mass", format!("{:?}", self.mass), "exactly one of mass and density is needed"),
        };
        if !(value.is_finite() && value > 0.0) {
            let field = if by_mass { "mass" } else { "density" };
            return wrong(field, value.to_string(), "must be positive and finite");
        }
        let region = Region::new(row, scene, self.center, self.size)?;
        let mut random = Random::new(scene.seed, row as u64);
        let radii = self.radii(row, &region, &mut random)?;
        let positions = match self.placement {
            Placement::Cubic | Placement::Fcc => self.lattice(row, &region, &radii)?,
            Placement::Random => self.scatter(row, scene, &region, &radii, balls, &mut random)?,
        };
        let masses: Vec<f64> = radii
            .iter()
            .map(|&radius| if by_mass { value } else { value * ball_volume(radius, scene.dimensions) })
            .collect();
        let velocities = thermal_velocities(self.temperature, scene.dimensions, &masses, &mut random);
        for k in 0..radii.len() {
            balls.push(
                Ball {
                    id: self.first_id + k as i64,
                    position: positions[k],
                    velocity: velocities[k] + self.velocity,
                    radius: radii[k],
                    mass: masses[k],
                    material: self.material,
                    fixed: false,
                },
                scene.dimensions,
            );
        }
        Ok(())
    }

    /// As many radii as are asked for.
    fn radii(&self, row: usize, region: &Region, random: &mut Random) -> Result<Vec<f64>, CheckError> {
        const MOST: u64 = 1 << 30;
        let volume = |radii: &[f64]| radii.iter().map(|&r| ball_volume(r, region.dimensions)).sum::<f64>();
        if let Some(packing) = self.packing
            && !(packing > 0.0 && packing < 1.0)
        {
            return Err(Self::wrong(row, "packing", packing, "must be above 0 and below 1"));
        }
        if let Some(count) = self.count
            && !(1..MOST).contains(&count)
        {
            return Err(Self::wrong(row, "count", count, "must be from 1 to 1073741823"));
        }
        match (self.count, self.packing) {
            (None, None) => Err(Self::wrong(row, "count", "not given", "count or packing is needed")),
            (Some(count), None) => Ok((0..count).map(|_| self.radius.draw(random)).collect()),
            (Some(count), Some(packing)) => {
                let mut radii: Vec<f64> = (0..count).map(|_| self.radius.draw(random)).collect();
                let ratio = packing * region.volume() / volume(&radii);
                let factor = if region.dimensions == 2 { ratio.sqrt() } else { libm::cbrt(ratio) };
                for radius in &mut radii {
                    *radius *= factor;
                }
                Ok(radii)
            }
            (None, Some(packing)) => {
                let mut radii = Vec::new();
                let mut rest = packing * region.volume();
                loop {
                    let radius = self.radius.draw(random);
                    let one = ball_volume(radius, region.dimensions);
                    // The nearest that whole balls allow.
                    if rest < 0.5 * one {
                        break;
                    }
                    rest -= one;
                    radii.push(radius);
                    if radii.len() as u64 >= MOST {
                        return Err(Self::wrong(row, "packing", packing, "needs more than 1073741823 balls"));
                    }
                }
                if radii.is_empty() {
                    return Err(Self::wrong(row, "packing", packing, "is less than one ball fills"));
                }
                Ok(radii)
            }
        }
    }

    fn lattice(&self, row: usize, region: &Region, radii: &[f64]) -> Result<Vec<DVec3>, CheckError> {
        let fcc = self.placement == Placement::Fcc;
        if fcc && region.dimensions == 2 {
            return Err(Self::wrong(row, "placement", "fcc", "needs dimensions = 3; use \"cubic\" or \"random\""));
        }
        let largest = radii.iter().copied().fold(0.0, f64::max);
        let Some(lattice) = Lattice::filling(region, fcc, largest, radii.len()) else {
            return Err(Self::wrong(row, "radius", largest, "is too large for the region"));
        };
        if lattice.nearest < 2.0 * largest {
            return Err(Self::wrong(
                row,
                "placement",
                if fcc { "fcc" } else { "cubic" },
                format!(
                    "its sites are {} m apart, less than the largest diameter {} m; ask for fewer or smaller balls",
                    lattice.nearest,
                    2.0 * largest
                ),
            ));
        }
        Ok(lattice.spread(radii.len()))
    }

    /// Random places without overlap, among the balls there are.
    fn scatter(
        &self,
        row: usize,
        scene: &Scene,
        region: &Region,
        radii: &[f64],
        present: &Balls,
        random: &mut Random,
    ) -> Result<Vec<DVec3>, CheckError> {
        let packing = radii.iter().map(|&r| ball_volume(r, region.dimensions)).sum::<f64>() / region.volume();
        if packing <= INSERTION_PACKING {
            return self.insert(row, scene, region, radii, present, 1.0, random);
        }
        if packing > GROWTH_PACKING[usize::from(region.dimensions) - 2] {
            return Err(Self::unreachable(row, packing));
        }
        let ratio = GROWTH_START / packing;
        let factor = if region.dimensions == 2 { ratio.sqrt() } else { libm::cbrt(ratio) };
        let start = self.insert(row, scene, region, radii, present, factor, random)?;
        self.grow(row, scene, region, radii, present, factor, start, random)
    }

    fn unreachable(row: usize, packing: f64) -> CheckError {
        Self::wrong(
            row,
            "packing",
            packing,
            "is too dense to be reached by growing balls at random; use a lattice, or ask for less",
        )
    }

    /// One by one, the largest first, each where it first fits. All radii are taken times `factor`.
    #[expect(clippy::too_many_arguments, reason = "one step of `scatter`, with all that it knows")]
    fn insert(
        &self,
        row: usize,
        scene: &Scene,
        region: &Region,
        radii: &[f64],
        present: &Balls,
        factor: f64,
        random: &mut Random,
    ) -> Result<Vec<DVec3>, CheckError> {
        let all = Radii::new(present.radii.iter().chain(radii).map(|r| r * factor).collect());
        let low = present.positions.iter().copied().fold(region.center - region.size * 0.5, DVec3::min);
        let high = present.positions.iter().copied().fold(region.center + region.size * 0.5, DVec3::max);
        let mut cells = Cells::new(&scene.domain, &all, low, high);
        cells.visit_interiors();
        let mut near = Gathered::default();
        let mut positions = present.positions.clone();
        positions.resize(all.len(), DVec3::ZERO);
        for (ball, position) in present.positions.iter().enumerate() {
            cells.insert(ball, *position);
        }
        let periods = scene.domain.periods();
        let mut order: Vec<usize> = (present.len()..all.len()).collect();
        order.sort_by(|&a, &b| all[b].total_cmp(&all[a]));
        for (placed, ball) in order.into_iter().enumerate() {
            let (lowest, extent) = region.centers(all[ball]);
            if extent.min_element() < 0.0 {
                return Err(Self::wrong(row, "radius", all[ball] / factor, "is too large for the region"));
            }
            let mut fits = false;
            for _ in 0..TRIES {
                let drawn = DVec3::new(random.uniform(), random.uniform(), random.uniform());
                let position = lowest + extent * drawn;
                if clear_of_planes(scene, position, all[ball])
                    && clear(&cells, &mut near, &positions, &all, periods, ball, position)
                {
                    positions[ball] = position;
                    cells.insert(ball, position);
                    fits = true;
                    break;
                }
            }
            if !fits {
                return Err(Self::wrong(
                    row,
                    "placement",
                    "random",
                    format!(
                        "no place found for ball {} of {} in {TRIES} tries; the region is too full",
                        placed + 1,
                        radii.len()
                    ),
                ));
            }
        }
        Ok(positions.split_off(present.len()))
    }

    /// Lets all balls grow from `factor` of their size to their size while they fly and collide.
    #[expect(clippy::too_many_arguments, reason = "one step of `scatter`, with all that it knows")]
    fn grow(
        &self,
        row: usize,
        scene: &Scene,
        region: &Region,
        radii: &[f64],
        present: &Balls,
        factor: f64,
        start: Vec<DVec3>,
        random: &mut Random,
    ) -> Result<Vec<DVec3>, CheckError> {
        let mut balls = present.clone();
        for k in 0..balls.len() {
            balls.fixed[k] = true;
            balls.velocities[k] = DVec3::ZERO;
        }
        for (k, position) in start.into_iter().enumerate() {
            let ball = Ball {
                id: self.first_id + k as i64,
                position,
                velocity: random.normal_vector(scene.dimensions),
                radius: radii[k],
                mass: 1.0,
                material: 0,
                fixed: false,
            };
            balls.push(ball, scene.dimensions);
        }
        // The fill's own box is a box of walls, where it is not the domain's.
        let domain = if self.size.is_some() || self.center.is_some() { Domain::OPEN } else { scene.domain };
        let mut planes: Vec<super::PlaneBody> = scene.planes.clone();
        for plane in &mut planes {
            plane.velocity = DVec3::ZERO;
        }
        if domain == Domain::OPEN {
            planes.extend(region_walls(region));
        }
        let growing =
            Scene { dimensions: scene.dimensions, domain, planes, materials: scene.materials, ..Scene::default() };
        let mean_diameter = 2.0 * radii.iter().sum::<f64>() / radii.len() as f64;
        let rate = GROWTH_SPEED / mean_diameter;
        let mut world = growing.world(&balls, &[]);
        world.restitution = RestitutionTable::uniform(scene.materials, 1.0);
        let full = 1.0 + tolerance::GROWN;
        let stages = ((full - factor) / 0.02).ceil().max(1.0);
        let mut from = factor;
        for stage in 1..=stages as u32 {
            let to = factor + (full - factor) * f64::from(stage) / stages;
            world.start = world.clock.at(0.0);
            world.growth = Some(Growth { initial: from, rate, start: world.start });
            let end = world.clock.at((to - from) / rate);
            let mut simulation = Simulation::new(world, false);
            let most = GROWTH_IMPACTS * radii.len() as u64;
            let done = simulation.run(end, most, u64::MAX);
            if !matches!(done, Ok(crate::simulation::Stop::Time)) {
                let volume: f64 = radii.iter().map(|&r| ball_volume(r, region.dimensions)).sum();
                return Err(Self::unreachable(row, volume / region.volume()));
            }
            world = rest_and_cool(simulation);
            from = to;
        }
        let mut places: Vec<(i64, DVec3)> =
            (0..world.len()).map(|row| (world.id(row), world.flights[row].position())).collect();
        places.retain(|(id, _)| (self.first_id..self.first_id + radii.len() as i64).contains(id));
        places.sort_by_key(|(id, _)| *id);
        Ok(places.into_iter().map(|(_, position)| position).collect())
    }
}

/// The world at the end of a stage of growth, with every clock set back to zero and speeds back to thermal ones, since
/// surfaces that grow heat the balls.
fn rest_and_cool(simulation: Simulation) -> World {
    let now = simulation.now();
    let mut world = simulation.world().clone();
    let start = world.clock.at(0.0);
    let mut energy = 0.0;
    let mut free = 0.0;
    for ball in 0..world.len() {
        let (mut position, velocity) = (world.position(ball, now), world.velocity(ball, now));
        for axis in 0..3 {
            if world.domain.boundary[axis] == Boundary::Periodic {
                position[axis] -= (position[axis] / world.domain.size[axis]).round() * world.domain.size[axis];
            }
        }
        world.flights[ball] = Flight::new(position, velocity, start);
        if !world.is_fixed(ball) {
            energy += velocity.length_squared();
            free += f64::from(world.dimensions);
        }
    }
    let factor = if energy > 0.0 { (free / energy).sqrt() } else { 1.0 };
    for flight in &mut world.flights {
        *flight = Flight::new(flight.position(), flight.velocity() * factor, start);
    }
    for plane in &mut world.planes {
        plane.start = start;
    }
    world
}

/// Velocities (m/s) at a temperature kT (J), without total momentum; the energy is d/2 (N − 1) kT exactly. One body alone
/// has what is drawn.
fn thermal_velocities(temperature: f64, dimensions: u8, masses: &[f64], random: &mut Random) -> Vec<DVec3> {
    let count = masses.len();
    if temperature == 0.0 || count < 2 {
        let one = |mass: &f64, random: &mut Random| random.normal_vector(dimensions) * (temperature / mass).sqrt();
        return masses.iter().map(|mass| one(mass, random)).collect();
    }
    let mut velocities: Vec<DVec3> =
        masses.iter().map(|mass| random.normal_vector(dimensions) * (temperature / mass).sqrt()).collect();
    let total: f64 = masses.iter().sum();
    let momentum: DVec3 = velocities.iter().zip(masses).map(|(v, m)| *v * *m).sum();
    let mut energy = 0.0;
    for (velocity, mass) in velocities.iter_mut().zip(masses) {
        *velocity -= momentum / total;
        energy += 0.5 * mass * velocity.length_squared();
    }
    let wanted = 0.5 * f64::from(dimensions) * (count - 1) as f64 * temperature;
    let factor = (wanted / energy).sqrt();
    for velocity in &mut velocities {
        *velocity *= factor;
    }
    velocities
}

fn clear_of_planes(scene: &Scene, position: DVec3, radius: f64) -> bool {
    scene.planes.iter().all(|plane| plane.normal.dot(position) - plane.offset >= radius)
}

fn clear(
    cells: &Cells,
    near: &mut Gathered,
    positions: &[DVec3],
    radii: &Radii,
    periods: DVec3,
    ball: usize,
    position: DVec3,
) -> bool {
    near.clear();
    cells.near_point(ball, position, || radii[ball], near);
    near.rows().iter().map(|&other| other as usize).all(|other| {
        let mut r = position - positions[other];
        for axis in 0..3 {
            if periods[axis] > 0.0 {
                r[axis] -= (r[axis] / periods[axis]).round() * periods[axis];
            }
        }
        let sum = radii[ball] + radii[other];
        r.length_squared() > sum * sum
    })
}

fn region_walls(region: &Region) -> Vec<super::PlaneBody> {
    let mut walls = Vec::new();
    for axis in 0..usize::from(region.dimensions) {
        for sign in [1.0, -1.0] {
            walls.push(super::PlaneBody {
                id: -1 - walls.len() as i64,
                normal: DVec3::AXES[axis] * sign,
                offset: sign * region.center[axis] - 0.5 * region.size[axis],
                velocity: DVec3::ZERO,
                material: 0,
            });
        }
    }
    walls
}
