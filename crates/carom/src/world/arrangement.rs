//! Where balls lie in memory: beside those they lie beside in space, along a curve that fills it. What is near is then likely
//! to be in the processor's cache. Nothing but speed depends on it: results go by ids.

use glam::DVec3;

use super::World;
use crate::time::Time;

/// Steps of the curve along each axis, as a power of two.
const BITS: u32 = 20;

impl World {
    /// Puts the balls into the order of the curve on which they are at `now`.
    pub fn arrange(&mut self, now: Time) {
        let (low, high) = {
            let positions = || (0..self.len()).map(|ball| self.wrapped(ball, now).0);
            (positions().fold(DVec3::INFINITY, DVec3::min), positions().fold(DVec3::NEG_INFINITY, DVec3::max))
        };
        let extent = (high - low).max_element();
        let steps = if extent > 0.0 { f64::from((1u32 << BITS) - 1) / extent } else { 0.0 };
        let place = |row: u32| {
            let relative = (self.wrapped(row as usize, now).0 - low) * steps;
            place_on_curve(relative.to_array().map(|x| x as u64))
        };
        // From the order of ids, so that the order in memory depends on where balls are alone.
        let mut order: Vec<(u64, u32)> = self.rows.iter().map(|&row| (place(row), row)).collect();
        order.sort_by_key(|&(place, _)| place);
        let from: Vec<u32> = order.into_iter().map(|(_, row)| row).collect();
        self.rearrange(&from);
    }

    /// Moves into each row what was in the row `from` it.
    fn rearrange(&mut self, from: &[u32]) {
        let mut to = vec![0; from.len()];
        for (row, &old) in from.iter().enumerate() {
            to[old as usize] = row as u32;
        }
        for row in &mut self.rows {
            *row = to[*row as usize];
        }
        permute(&mut self.flights, from);
        self.radii.rearrange(from);
        permute(&mut self.bodies, from);
        permute(&mut self.impacts, from);
        self.images.rearrange(from);
        if let Some(spin) = &mut self.spin {
            permute(&mut spin.orientation, from);
            permute(&mut spin.angular_velocity, from);
            permute(&mut spin.inertia, from);
        }
        if let Some(turning) = &mut self.turning {
            turning.rearrange(&to);
        }
        for body in &mut self.bodies {
            body.last_partner = body.last_partner.with_ball(|row| to[row as usize]);
        }
    }
}

pub(super) fn permute<T: Copy>(values: &mut Vec<T>, from: &[u32]) {
    // Images are kept in periodic boxes only.
    if !values.is_empty() {
        *values = from.iter().map(|&row| values[row as usize]).collect();
    }
}

/// The place on Morton's curve: the bits of the three coordinates in turn.
fn place_on_curve(coordinates: [u64; 3]) -> u64 {
    let mut place = 0;
    for bit in 0..BITS {
        for (axis, coordinate) in coordinates.iter().enumerate() {
            place |= (coordinate >> bit & 1) << (3 * bit + axis as u32);
        }
    }
    place
}
