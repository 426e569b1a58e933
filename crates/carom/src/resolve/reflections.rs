//! Newton's law of restitution for contacts of several pairs at one instant, by generalized reflections (Smith, Kaufman,
//! Vouga, Tamstorf, Grinspun 2012, Reflections on Simultaneous Impact).
//!
//! Of contact points i with normals nᵢ, u = Nᵀ v are the relative velocities v_AB·n, and W = Nᵀ M⁻¹ N is how impulses λ change
//! them. Reflected are those that approach, V = {i : uᵢ < 0}, all at once: v ← v + 2 M⁻¹ N λ with 0 ≤ λ ⊥ u + W λ ≥ 0 on V; then
//! those that approach thereafter, until none does. Each is a reflection in the metric of kinetic energy, so that energy,
//! momentum and symmetry are kept, nothing pulls, and a row of balls hands a blow through. With e < 1 the outcome lies between
//! that and the perfectly plastic one, v + M⁻¹ N λ with the same λ of *all* contacts, by the shares e and 1 − e: it keeps momentum
//! and symmetry, and as kinetic energy is convex it loses. Where pairs of different restitution touch, e is the mean of
//! theirs, weighted by the plastic impulses.

use glam::DVec3;

use super::turning::{Arms, Mobility, Twist};
use crate::tolerance::RESTING;

/// A point in which two of the bodies touch.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// A and B, by their places.
    pub bodies: [usize; 2],
    /// Unit vector from B to A.
    pub normal: DVec3,
    /// From the centres of mass (m, world axes).
    pub arms: Arms,
    /// Coefficient of restitution e of the pair.
    pub restitution: f64,
}

/// Bodies that touch at one instant.
#[derive(Clone, Debug, Default)]
pub struct Cluster {
    /// Their answers to impulses.
    pub mobilities: Vec<Mobility>,
    /// How they move before.
    pub twists: Vec<Twist>,
    /// Where they touch.
    pub points: Vec<Point>,
}

/// What becomes of it.
#[derive(Clone, Debug)]
pub struct Reflected {
    /// How the bodies move after.
    pub twists: Vec<Twist>,
    /// j (N s) of each point, 0 or more: +j n acts on its A, −j n on its B.
    pub impulses: Vec<f64>,
}

/// Reflections after which the rule gives up (a count). A row of n balls needs n.
const PASSES: usize = 10_000;

impl Cluster {
    /// v_AB·n (m/s) of a point; negative: approaching.
    pub fn speed(&self, point: &Point, twists: &[Twist]) -> f64 {
        let [a, b] = point.bodies;
        (twists[a].at(point.arms.a) - twists[b].at(point.arms.b)).dot(point.normal)
    }

    /// Speeds (m/s) below this are rounding of those of a point's bodies.
    fn rounding(&self, point: &Point) -> f64 {
        let of = |body: usize, arm: DVec3| {
            let twist = &self.twists[body];
            twist.velocity.length() + twist.angular_velocity.length() * arm.length()
        };
        RESTING * (of(point.bodies[0], point.arms.a) + of(point.bodies[1], point.arms.b))
    }

    /// Speeds (m/s) below this are rounding of the fastest.
    fn least(&self) -> f64 {
        self.points.iter().map(|point| self.rounding(point)).fold(0.0, f64::max)
    }

    /// Whether any point approaches, by more than rounding.
    pub fn approaches(&self) -> bool {
        let least = self.least();
        self.points.iter().any(|point| self.speed(point, &self.twists) < -least)
    }

    /// What becomes of it; `None` if the reflections do not come to an end.
    pub fn resolve(&self) -> Option<Reflected> {
        let all: Vec<usize> = (0..self.points.len()).collect();
        let lossy = self.points.iter().any(|point| point.restitution < 1.0);
        let plastic = if lossy { self.stopping(&all, &self.twists) } else { vec![0.0; self.points.len()] };
        let weight: f64 = plastic.iter().sum();
        let weighted: f64 = self.points.iter().zip(&plastic).map(|(point, impulse)| point.restitution * impulse).sum();
        let e = if weight > 0.0 { weighted / weight } else { 1.0 };
        let least = self.least();
        let mut impulses = vec![0.0; self.points.len()];
        if e > 0.0 {
            self.pass(&mut impulses, 2.0, least)?;
        }
        for (impulse, plastic) in impulses.iter_mut().zip(plastic) {
            *impulse = e * *impulse + (1.0 - e) * plastic;
        }
        // What rounding has left of an approach is stopped.
        self.pass(&mut impulses, 1.0, least)?;
        Some(Reflected { twists: self.kicked(&impulses), impulses })
    }

    /// Adds the impulses (N s) that reflect what approaches faster than `least` (`factor` 2), or stop it (1), until nothing does.
    fn pass(&self, impulses: &mut [f64], factor: f64, least: f64) -> Option<()> {
        for _ in 0..PASSES {
            let twists = self.kicked(impulses);
            let approaching: Vec<usize> =
                (0..self.points.len()).filter(|&k| self.speed(&self.points[k], &twists) < -least).collect();
            if approaching.is_empty() {
                return Some(());
            }
            for (k, impulse) in approaching.iter().zip(self.stopping(&approaching, &twists)) {
                impulses[*k] += factor * impulse;
            }
        }
        None
    }

    /// The twists after impulses (N s) at the points.
    fn kicked(&self, impulses: &[f64]) -> Vec<Twist> {
        let mut kicks = vec![[DVec3::ZERO; 2]; self.twists.len()];
        for (point, &impulse) in self.points.iter().zip(impulses) {
            let kick = point.normal * impulse;
            for (body, kick, arm) in [(point.bodies[0], kick, point.arms.a), (point.bodies[1], -kick, point.arms.b)] {
                kicks[body][0] += kick;
                kicks[body][1] += arm.cross(kick);
            }
        }
        let moved = |((twist, mobility), [kick, moment]): ((&Twist, &Mobility), [DVec3; 2])| Twist {
            velocity: twist.velocity + kick * mobility.inverse_mass(),
            angular_velocity: twist.angular_velocity + mobility.turn(moment),
        };
        self.twists.iter().zip(&self.mobilities).zip(kicks).map(moved).collect()
    }

    /// W of two points (1/kg): the change of v_AB·n at `other` by a unit impulse at `point`.
    fn answer(&self, point: &Point, other: &Point) -> f64 {
        let sides = |point: &Point| {
            [(point.bodies[0], point.arms.a, point.normal), (point.bodies[1], point.arms.b, -point.normal)]
        };
        let mut sum = 0.0;
        for (body, arm, push) in sides(point) {
            for (other_body, other_arm, normal) in sides(other) {
                if body == other_body {
                    let mobility = &self.mobilities[body];
                    let turned = mobility.turn(arm.cross(push)).dot(other_arm.cross(normal));
                    sum += mobility.inverse_mass() * push.dot(normal) + turned;
                }
            }
        }
        sum
    }

    /// λ (N s) with 0 ≤ λ ⊥ u + W λ ≥ 0 on the chosen points: the least impulses after which none of them approaches. The
    /// velocities that follow are unique. By adding the point that approaches fastest to those that are stopped, and taking out
    /// what would have to be pulled (Lawson and Hanson 1974, chapter 23).
    fn stopping(&self, chosen: &[usize], twists: &[Twist]) -> Vec<f64> {
        let count = chosen.len();
        let point = |k: usize| &self.points[chosen[k]];
        let u: Vec<f64> = (0..count).map(|k| self.speed(point(k), twists)).collect();
        let w: Vec<Vec<f64>> =
            (0..count).map(|i| (0..count).map(|j| self.answer(point(j), point(i))).collect()).collect();
        let least = self.least();
        let mut lambda = vec![0.0; count];
        let mut stopped: Vec<usize> = Vec::new();
        let mut dependent = vec![false; count];
        // Each round ends nearer to the solution, so that no set of stopped points comes twice but by rounding.
        for _ in 0..16 * count + 16 {
            let speed = |i: usize| u[i] + stopped.iter().map(|&j| w[i][j] * lambda[j]).sum::<f64>();
            let candidates = (0..count).filter(|k| !stopped.contains(k) && !dependent[*k]);
            let fastest = candidates.map(|k| (speed(k), k)).filter(|&(speed, _)| speed < -least);
            let Some((_, next)) = fastest.reduce(|best, next| if next.0 < best.0 { next } else { best }) else { break };
            stopped.push(next);
            let Some(mut wanted) = solve(&w, &u, &stopped) else {
                // What stops the others stops this one too.
                stopped.pop();
                dependent[next] = true;
                continue;
            };
            while let Some((share, pulled)) = first_to_pull(&stopped, &lambda, &wanted) {
                for (&k, wanted) in stopped.iter().zip(&wanted) {
                    lambda[k] += share * (wanted - lambda[k]);
                }
                lambda[pulled] = 0.0;
                stopped.retain(|&k| k != pulled && (k == next || lambda[k] > 0.0));
                // One that would be pulled as soon as it is stopped approached by rounding alone.
                dependent.fill(false);
                dependent[next] = pulled == next;
                wanted = solve(&w, &u, &stopped).unwrap_or_default();
            }
            for (&k, wanted) in stopped.iter().zip(wanted) {
                lambda[k] = wanted;
            }
        }
        lambda
    }
}

/// The part of the way from `lambda` to what is `wanted` at which the first impulse becomes a pull, and which; `None` if none does.
fn first_to_pull(stopped: &[usize], lambda: &[f64], wanted: &[f64]) -> Option<(f64, usize)> {
    let pulled = stopped.iter().zip(wanted).filter(|&(_, &wanted)| wanted <= 0.0);
    let share =
        |(&k, &wanted): (&usize, &f64)| if lambda[k] > 0.0 { (lambda[k] / (lambda[k] - wanted), k) } else { (0.0, k) };
    pulled.map(share).reduce(|first, next| if next.0 < first.0 { next } else { first })
}

/// λ with u + W λ = 0 on a set, W = L D Lᵀ without roots, so that what is simple stays exact; `None` if the equations depend on
/// each other.
fn solve(w: &[Vec<f64>], u: &[f64], set: &[usize]) -> Option<Vec<f64>> {
    let n = set.len();
    let mut lower = vec![vec![0.0; n]; n];
    let mut pivots = vec![0.0; n];
    for i in 0..n {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| lower[i][k] * pivots[k] * lower[j][k]).sum();
            let rest = w[set[i]][set[j]] - known;
            if i > j {
                lower[i][j] = rest / pivots[j];
            } else if rest > SINGULAR * w[set[i]][set[i]] {
                pivots[i] = rest;
            } else {
                return None;
            }
        }
    }
    let mut lambda = vec![0.0; n];
    for i in 0..n {
        let known: f64 = (0..i).map(|k| lower[i][k] * lambda[k]).sum();
        lambda[i] = -u[set[i]] - known;
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| lower[k][i] * lambda[k]).sum();
        lambda[i] = lambda[i] / pivots[i] - known;
    }
    Some(lambda)
}

/// A pivot below this fraction of the diagonal is what rounding leaves of none (pure number, 2⁻⁴⁰).
const SINGULAR: f64 = 1.0 / (1u64 << 40) as f64;
