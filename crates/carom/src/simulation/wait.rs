//! Waiting instead of searching, when somebody else has come between a ball and its foreseen partner.
//!
//! Whoever has an impact looks at everybody near right after it. So two balls near each other are always looked after by the one
//! that searched last: no impact of the two comes before what it foresees. The partner that has changed its course has searched
//! since, and so has everybody else who has; all others a ball has looked at itself, and knows how long it meets none of them
//! ([`Alone`]). It need not search before that, and mostly has an impact by then that another foresaw.

use super::Simulation;
use crate::event::{Alone, Upcoming};
use crate::predict::First;
use crate::time::Time;
use crate::tolerance::SAME_INSTANT;
use crate::world::Partner;

/// It is not worth the while to wait for less than this part of the clock's span (pure number): 2^12 instants that rounding cannot
/// tell apart. A wait is told too short by [`Alone::LESS`] of it, so it ends 2^4 of them before anybody is met.
const LEAST_WAIT: f64 = SAME_INSTANT * (1u64 << 12) as f64;

impl Simulation {
    /// What a ball foresaw no longer holds: it searches, or waits as long as it is known to meet nobody it would have to look at.
    pub(super) fn wait_or_predict(&mut self, ball: usize, now: Time) {
        let Upcoming { time, alone, .. } = self.upcoming[ball];
        // Very large balls look only at those whom they were told about: whoever waits could be overlooked.
        if alone.spans() < LEAST_WAIT || self.giants.any() {
            return self.predict(ball, now);
        }
        let clock = self.world.clock;
        let until = clock.after(time, alone.spans() * clock.span());
        self.schedule(ball, First::single(until, Partner::NONE), now);
        self.upcoming[ball].alone = Alone::OVER;
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::sweep::tests::{mixture, scene};
    use super::*;
    use crate::scene::Scene;
    use crate::world::Boundary;

    /// So many impacts where a ball always searches when its foreseen partner has changed its course.
    fn without_waiting(scene: &Scene, count: u64) -> Vec<u64> {
        let mut simulation = Simulation::new(scene.build().expect("a scene").0, true);
        while simulation.counts.impacts() < count {
            simulation.upcoming.iter_mut().for_each(|upcoming| upcoming.alone = Alone::UNKNOWN);
            simulation.run(Time::NEVER, 1, 1).expect("a run");
        }
        simulation.impacts_to_the_bit(0)
    }

    #[test]
    fn waiting_changes_no_bit() {
        let sizes = [1.1, 2.0, 2.4, 1.6, 2.3, 1.0, 1.9, 0.8];
        for seed in 0..4 {
            for (boundary, spacing, spread, any_fixed, gravity, restitution) in [
                // Lists, then cells.
                (Boundary::Periodic, 1.05, 1.0, false, 0.0, 1.0),
                (Boundary::Periodic, 1.05, 1.0, true, 0.0, 0.97),
                (Boundary::Walls, 1.15, 1.1, false, 0.5, 1.0),
                (Boundary::Periodic, 1.3, 1.0, false, 0.0, 1.0),
                (Boundary::Periodic, 1.9, 1.3, true, 0.0, 0.97),
                (Boundary::Walls, 1.8, 1.0, false, 0.7, 1.0),
            ] {
                let mut scene = scene(boundary, spacing, spread, any_fixed, seed);
                scene.gravity = DVec3::new(0.1, 0.0, -1.0) * gravity;
                scene.restitution = restitution;
                let mut waiting = Simulation::new(scene.build().expect("a scene").0, true);
                let bits = waiting.impacts_to_the_bit(4000);
                assert!(bits == without_waiting(&scene, 4000), "{boundary:?} {spacing} {any_fixed} {gravity} {seed}");
            }
            for (side, large, small, impacts) in [(16.0, &sizes[..], 500, 2500), (34.0, &[10.0][..], 5000, 60_000)] {
                let scene = mixture((Boundary::Periodic, side), (large, 0.5), (small, 1.0), false, seed);
                let mut waiting = Simulation::new(scene.build().expect("a scene").0, true);
                let bits = waiting.impacts_to_the_bit(impacts);
                assert!(bits == without_waiting(&scene, impacts), "mixture {side} {seed}");
            }
        }
    }

    /// How often there is a wait, and how often it ends with a search, in a dense fluid.
    #[test]
    fn most_waits_end_before_they_are_over() {
        let scene = scene(Boundary::Periodic, 1.05, 1.0, false, 1);
        let mut simulation = Simulation::new(scene.build().expect("a scene").0, false);
        simulation.run(Time::NEVER, 2000, u64::MAX).expect("a run");
        let (mut begun, mut over) = (0, 0);
        while simulation.counts.impacts() < 6000 {
            let is_waiting: Vec<bool> =
                simulation.upcoming.iter().map(|upcoming| upcoming.alone == Alone::OVER).collect();
            let (stale, stamps) = (simulation.counts.stale, simulation.upcoming.clone());
            simulation.run(Time::NEVER, 1, 1).expect("a run");
            if simulation.counts.stale > stale {
                let ball =
                    (0..is_waiting.len()).find(|&k| simulation.upcoming[k].stamp != stamps[k].stamp).expect("one");
                over += u32::from(is_waiting[ball]);
                begun += u32::from(simulation.upcoming[ball].alone == Alone::OVER);
            }
        }
        assert!(begun > 800 && over * 3 < begun, "{begun} {over}");
    }
}
