//! Watches for impacts that accumulate. It ends a run with an error; it never changes an impact.

use crate::time::Time;
use crate::tolerance::{COLLAPSE_IMPACTS, COLLAPSE_WINDOW, MOST_SPEEDUP, RESTING};
use crate::world::World;

/// Counts each body's impacts that lose energy within one short window of time.
#[derive(Clone, Debug)]
pub struct CollapseGuard {
    window: f64,
    /// The speed (m/s) that the clock's span was made for.
    speed: f64,
    start: Time,
    number: u32,
    /// Window and count of each ball; empty where nothing loses energy.
    counts: Vec<(u32, u32)>,
}

impl CollapseGuard {
    /// A guard for `world`.
    pub fn new(world: &World) -> Self {
        let smallest = world.radii.iter().fold(f64::INFINITY, f64::min);
        Self {
            window: COLLAPSE_WINDOW * world.clock.span(),
            speed: 32.0 * smallest / world.clock.span(),
            start: world.start,
            number: 0,
            counts: if world.restitution.is_lossy() { vec![(0, 0); world.len()] } else { Vec::new() },
        }
    }

    /// Whether a contact that restitution e (0 < e < 1) cannot end is the last of an accumulation: the bodies approach no
    /// faster than rounding of their `speeds` or of the speeds of the scene (m/s), and in the seconds since both of them met
    /// somebody they came no farther than the window, or than `touching` (m).
    #[inline]
    pub fn is_spent(&self, approach_speed: f64, speeds: f64, since_last_impact: f64, touching: f64) -> bool {
        approach_speed <= RESTING * speeds.max(self.speed)
            && (since_last_impact <= self.window || approach_speed * since_last_impact <= touching)
    }

    /// Whether bodies have become so fast that the clock no longer resolves where they are, as a body does that others in
    /// prescribed motion squeeze.
    #[inline]
    pub fn is_too_fast(&self, approach_speed: f64) -> bool {
        approach_speed > MOST_SPEEDUP * self.speed
    }

    /// Notes an impact that loses energy, of the ball `rank`-th in the order of ids; true if they accumulate.
    #[inline]
    pub fn accumulates(&mut self, rank: usize, now: Time) -> bool {
        if now.since(self.start) > self.window {
            self.start = now;
            self.number = self.number.wrapping_add(1);
        }
        let Some((number, count)) = self.counts.get_mut(rank) else { return false };
        if *number != self.number {
            (*number, *count) = (self.number, 0);
        }
        *count += 1;
        *count > COLLAPSE_IMPACTS
    }
}
