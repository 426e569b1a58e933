//! Places told in four bytes an axis: each axis is a ring of 2^32 steps.
//!
//! Along a periodic axis the ring is the box: so the difference of two places, taken as a signed number, is that of their nearest
//! images, and a place stays the same when a ball is put back into the box. Along other axes it is as long as where the balls
//! are, and two that are as far apart as it is long look near each other: that costs time, nothing else.

use glam::DVec3;

use super::{Boundary, Domain};
use crate::predict::NO_FRACTION;

/// Where [`NO_FRACTION`] serves.
const WHOLE_BELOW: f64 = (1u64 << 51) as f64;

/// A place, in steps from the middle of each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spot([i32; 3]);

impl Spot {
    /// Where everybody is before it is known where they are.
    pub const NONE: Self = Self([0; 3]);

    /// Steps from the beginning of an axis.
    #[inline(always)]
    pub fn from_beginning(self, axis: usize) -> u32 {
        self.0[axis] as u32 ^ 1 << 31
    }
}

/// What a step is, along each axis.
#[derive(Clone, Copy, Debug)]
pub struct Rings {
    /// The middle (m).
    middle: DVec3,
    /// Length of a step (m).
    step: DVec3,
    inverse: DVec3,
}

impl Rings {
    /// Steps of a ring.
    pub const STEPS: f64 = (1u64 << 32) as f64;

    /// Rings around the box, and where space is open around the places between `low` and `high` (m). Where space does not close on
    /// itself they are longer by `gap` (m), but no longer than `most` nor shorter than `least`.
    pub fn new(domain: &Domain, [low, high]: [DVec3; 2], gap: f64, least: f64, most: f64) -> Self {
        let (mut middle, mut length) = (0.5 * (low + high), high - low);
        for axis in 0..3 {
            if domain.boundary[axis] != Boundary::Open {
                middle[axis] = 0.0;
                length[axis] = domain.size[axis];
            }
            if domain.boundary[axis] != Boundary::Periodic {
                length[axis] = (length[axis] + gap).min(most).max(least);
            }
        }
        Self { middle, step: length / Self::STEPS, inverse: Self::STEPS / length }
    }

    /// Length of each ring (m).
    pub fn length(&self) -> DVec3 {
        self.step * Self::STEPS
    }

    /// The longest step (m): [`Rings::apart`] errs by less than that.
    pub fn longest_step(&self) -> f64 {
        self.step.max_element()
    }

    /// The spot that is nearest to a position (m).
    #[inline(always)]
    pub fn spot(&self, position: DVec3) -> Spot {
        let steps = (position - self.middle) * self.inverse;
        // The last digits of a number without a fraction are the whole number.
        let whole = (steps + NO_FRACTION).to_array().map(|x| x.to_bits() as i32);
        if steps.x.abs() + steps.y.abs() + steps.z.abs() < WHOLE_BELOW { Spot(whole) } else { Self::far_out(steps) }
    }

    #[cold]
    fn far_out(steps: DVec3) -> Spot {
        Spot(steps.to_array().map(|x| x.rem_euclid(Self::STEPS) as u32 as i32))
    }

    /// Where a spot is (m) in the image around the middle.
    #[inline(always)]
    pub fn position(&self, spot: Spot) -> DVec3 {
        DVec3::from_array(spot.0.map(f64::from)) * self.step + self.middle
    }

    /// From the second place to the first (m), the short way round.
    #[inline(always)]
    pub fn apart(&self, a: Spot, b: Spot) -> DVec3 {
        let steps: [f64; 3] = std::array::from_fn(|axis| f64::from(a.0[axis].wrapping_sub(b.0[axis])));
        DVec3::from_array(steps) * self.step
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::predict::Periods;
    use crate::random::Random;

    /// The way between two places is that between the nearest images of the positions, to a step; wherever in space they are, as
    /// far as numbers tell.
    #[test]
    fn the_short_way_round_is_the_way_to_the_nearest_image() {
        let mut random = Random::new(11, 0);
        let domain = Domain {
            boundary: [Boundary::Periodic, Boundary::Walls, Boundary::Open],
            size: DVec3::new(3.0, 700.0, 0.0),
        };
        let rings = Rings::new(&domain, [DVec3::splat(-5.0), DVec3::splat(5.0)], 0.5, 2.0, 100.0);
        assert!((rings.length() - DVec3::new(3.0, 100.0, 10.5)).abs().max_element() < 1e-13);
        let periods = Periods::of(&Domain { boundary: [Boundary::Periodic; 3], size: rings.length() });
        for k in 0..100_000 {
            // Up to half a million boxes away, where rounding is 2^-34 of the box, a quarter of a step; then far beyond, where there are
            // no digits.
            let scale = 10f64.powi(k % 6);
            let mut point = || DVec3::new(random.normal(), random.normal(), random.normal()) * rings.length();
            let (a, b) = (point() * scale, point());
            let apart = rings.apart(rings.spot(a), rings.spot(b));
            let error = periods.nearest(apart - (a - b)).abs() / rings.step;
            assert!(error.max_element() < 1.6, "{a} {b}: {error}");
            rings.spot(a * 1e20);
        }
    }
}
