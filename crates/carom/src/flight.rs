//! Free flight in closed form: where a ball is, any time after its last impact.

use glam::DVec3;

use crate::time::Time;

/// A ball's state right after its last impact. It is written at impacts only; everything else evaluates it. One line of the
/// processor's cache: position (m), velocity (m/s), epoch and offset (s) of the instant at which it was there.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Flight([f64; 8]);

impl Flight {
    /// The flight of a centre that is at `position` (m) and flies at `velocity` (m/s) at `start`.
    #[inline(always)]
    pub fn new(position: DVec3, velocity: DVec3, start: Time) -> Self {
        let (x, v) = (position, velocity);
        Self([x.x, x.y, x.z, v.x, v.y, v.z, start.epoch, start.offset])
    }

    /// All of it, in the order of memory.
    #[inline(always)]
    pub fn line(&self) -> [f64; 8] {
        self.0
    }

    /// Centre (m) at the start.
    #[inline(always)]
    pub fn position(&self) -> DVec3 {
        DVec3::new(self.0[0], self.0[1], self.0[2])
    }

    /// Velocity of the centre (m/s) at the start.
    #[inline(always)]
    pub fn velocity(&self) -> DVec3 {
        DVec3::new(self.0[3], self.0[4], self.0[5])
    }

    /// The instant of the last impact.
    #[inline(always)]
    pub fn start(&self) -> Time {
        Time { epoch: self.0[6], offset: self.0[7] }
    }

    /// The centre (m) `seconds` after the start, under a constant `acceleration` (m/s²): x + v t + a t²/2.
    #[inline(always)]
    pub fn position_after(&self, seconds: f64, acceleration: DVec3) -> DVec3 {
        self.position() + (self.velocity() + acceleration * (0.5 * seconds)) * seconds
    }

    /// The velocity (m/s) `seconds` after the start: v + a t.
    #[inline(always)]
    pub fn velocity_after(&self, seconds: f64, acceleration: DVec3) -> DVec3 {
        self.velocity() + acceleration * seconds
    }
}
