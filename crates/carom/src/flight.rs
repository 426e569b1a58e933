//! Free flight in closed form: where a ball is, any time after its last impact.

use glam::DVec3;

use crate::time::Time;

/// A ball's state right after its last impact. It is written at impacts only; everything else evaluates it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Flight {
    /// Centre (m).
    pub position: DVec3,
    /// Velocity of the centre (m/s).
    pub velocity: DVec3,
    /// The instant of `position` and `velocity`.
    pub start: Time,
}

impl Flight {
    /// All of it, in the order of memory: position, velocity, epoch and offset of the start.
    #[inline(always)]
    pub fn line(&self) -> [f64; 8] {
        let (x, v, start) = (self.position, self.velocity, self.start);
        [x.x, x.y, x.z, v.x, v.y, v.z, start.epoch, start.offset]
    }

    /// The centre `seconds` after the start, under a constant `acceleration` (m/s²): x + v t + a t²/2.
    #[inline(always)]
    pub fn position_after(&self, seconds: f64, acceleration: DVec3) -> DVec3 {
        self.position + (self.velocity + acceleration * (0.5 * seconds)) * seconds
    }

    /// The velocity `seconds` after the start: v + a t.
    #[inline(always)]
    pub fn velocity_after(&self, seconds: f64, acceleration: DVec3) -> DVec3 {
        self.velocity + acceleration * seconds
    }
}
