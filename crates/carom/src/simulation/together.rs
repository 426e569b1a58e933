//! Several pairs that touch at one instant, resolved together (`simultaneous = "reflections"`): everybody who touches those of
//! the impact, and who touches these in turn.

use glam::DVec3;

use super::Simulation;
use super::turning_impact::Side;
use crate::error::{Cause, CollapseError};
use crate::event::{Certificate, Kind, Rank};
use crate::predict::rank;
use crate::predict::solids::{Sought, gap_above_plane, gap_of_bodies, in_order};
use crate::predict::surroundings::gap_to_mesh;
use crate::predict::turning::contact_gap;
use crate::record::Impact;
use crate::resolve::reflections::{Cluster, Point, Reflected};
use crate::resolve::turning::{Arms, Mobility, Twist};
use crate::scene::Simultaneous;
use crate::time::Time;
use crate::tolerance::{self, SAME_INSTANT, touching};
use crate::world::Partner;
use crate::world::nearby::Gathered;

/// Two bodies that touch.
struct Pair {
    rank: Rank,
    /// A and B, by their places among the sides.
    sides: [usize; 2],
    kind: Kind,
    certificate: Certificate,
    normal: DVec3,
    points: Vec<Arms>,
    /// See [`crate::predict::turning::contact::Contact::is_sunk`].
    is_sunk: bool,
}

/// Who touches.
#[derive(Default)]
struct Touching {
    sides: Vec<Side>,
    pairs: Vec<Pair>,
}

impl Simulation {
    /// As [`Simulation::resolve`], of all contacts of those who touch at this instant; `None` where that is not asked for, or the
    /// pair is by itself. Everybody but `ball` and its partner is predicted anew.
    #[inline(always)]
    pub(super) fn resolve_together(
        &mut self,
        ball: usize,
        partner: Partner,
        time: Time,
    ) -> Option<Result<(), CollapseError>> {
        match self.world.simultaneous {
            Simultaneous::Pairwise => None,
            Simultaneous::Reflections => self.reflect(ball, partner, time).transpose(),
        }
    }

    #[inline(never)]
    fn reflect(&mut self, ball: usize, partner: Partner, time: Time) -> Result<Option<()>, CollapseError> {
        let now = self.now.later(time);
        if partner == Partner::NONE || self.world.growth.is_some() {
            return Ok(None);
        }
        let touching = self.touching(ball, partner, now);
        let cluster = touching.cluster(self);
        // A pair by itself has a law without rounding; and what approaches by rounding alone is left to that, too.
        if touching.pairs.len() < 2 || !cluster.approaches() {
            return Ok(None);
        }
        if let Some(pair) = touching.pairs.iter().find(|pair| pair.is_sunk) {
            return Err(self.sunk(pair.sides.map(|place| &touching.sides[place]), now));
        }
        let Some(reflected) = cluster.resolve() else {
            return Err(self.collapse(ball, partner, now, Cause::Reflections));
        };
        let impacts = touching.impacts(&cluster, &reflected, now);
        for impact in &impacts {
            let rows = [impact.a, impact.b].map(|id| self.world.row_of(id));
            let lossy = impact.restitution < 1.0;
            let accumulates =
                lossy && rows.into_iter().flatten().any(|row| self.guard.accumulates(self.rank_of(row), now));
            if self.guard.is_too_fast(impact.approach_speed) || accumulates {
                let cause = if accumulates { Cause::Accumulation } else { Cause::Resolution };
                return Err(CollapseError { bodies: vec![impact.a, impact.b], time: now.to_pair().0, cause });
            }
        }
        self.settle_together(&touching, &cluster, &reflected, now);
        self.now = now;
        let pairs = touching.pairs.iter().filter(|pair| impacts.iter().any(|impact| touching.is_of(pair, impact)));
        for pair in pairs {
            match touching.sides[pair.sides[1]].row() {
                Some(_) => self.counts.ball_ball += 1,
                None => self.counts.ball_plane += 1,
            }
            match pair.certificate {
                Certificate::ClosedForm => {}
                Certificate::Transversal => self.counts.transversal += 1,
                Certificate::WithinTolerance => self.counts.within_tolerance += 1,
            }
        }
        if self.is_recorded() {
            for impact in impacts {
                self.record_one_of_several(impact);
            }
        }
        for row in touching.sides.iter().filter_map(|side| side.row()) {
            if row != ball && partner.as_ball() != Some(row) {
                self.predict(row, now);
            }
        }
        Ok(Some(()))
    }

    fn rank_of(&self, row: usize) -> usize {
        self.world.bodies[row].rank as usize
    }

    /// Everybody who touches `ball` and its partner, and who touches these in turn; nobody is reached through a body in
    /// prescribed motion.
    fn touching(&mut self, ball: usize, partner: Partner, now: Time) -> Touching {
        let mut found = Touching::default();
        let mut room = Gathered::default();
        let certificate = self.predictor.certificate(ball);
        found.add(self, ball, partner, now, certificate);
        let mut next = 0;
        while next < found.sides.len() {
            let side = found.sides[next];
            next += 1;
            let Some(row) = side.row().filter(|_| side.is_free()) else { continue };
            for (partner, certificate) in self.touching_one(row, now, &mut room) {
                found.add(self, row, partner, now, certificate);
            }
        }
        // Whatever the order of memory.
        found.pairs.sort_by_key(|pair| pair.rank);
        found
    }

    /// Who touches a body, and how certain that is.
    fn touching_one(&self, row: usize, now: Time, room: &mut Gathered) -> Vec<(Partner, Certificate)> {
        let mut found = Vec::new();
        for &other in self.nearby.row(&self.world, row, room) {
            if other as usize != row && self.touch(row, other as usize, now) {
                found.push((Partner::ball(other), Certificate::ClosedForm));
            }
        }
        for &other in self.nearby.beside(row) {
            if self.touch(row, other as usize, now) {
                found.push((Partner::ball(other), Certificate::WithinTolerance));
            }
        }
        for plane in 0..self.world.planes.len() {
            if self.nearby.planes(row).contains(plane) && self.touches_plane(row, plane, now) {
                let turns = self.world.turning_body(row).is_some();
                let how = if turns { Certificate::WithinTolerance } else { Certificate::ClosedForm };
                found.push((Partner::plane(plane as u32), how));
            }
        }
        for mesh in 0..self.world.meshes.len() {
            if self.touches_mesh(row, mesh, now) {
                found.push((Partner::mesh(mesh as u32), Certificate::WithinTolerance));
            }
        }
        found
    }

    /// How far (m) what approaches at `speed` (m/s) comes in what is one instant.
    fn within_instant(&self, speed: f64) -> f64 {
        speed * SAME_INSTANT * self.world.clock.span()
    }

    fn touch(&self, a: usize, b: usize, now: Time) -> bool {
        let world = &self.world;
        let (place_a, place_b) = (world.position(a, now), world.position(b, now));
        let distance = self.predictor.periods().nearest(place_a - place_b).length();
        let reach = world.radii[a] + world.radii[b];
        let speed = (world.velocity(a, now) - world.velocity(b, now)).length();
        let largest = place_a.abs().max(place_b.abs()).max_element().max(reach);
        let rounding = touching(largest) + self.within_instant(speed);
        if world.turning_body(a).is_none() && world.turning_body(b).is_none() {
            return distance - reach <= rounding;
        }
        let tolerance = tolerance::contact(world.radii[a].max(world.radii[b]), distance) + rounding;
        distance - reach <= tolerance && gap_of_bodies(world, a, b, now) <= tolerance
    }

    fn touches_plane(&self, row: usize, plane: usize, now: Time) -> bool {
        let world = &self.world;
        let (place, offset, normal) =
            (world.position(row, now), world.planes[plane].offset_at(now), world.planes[plane].normal);
        let largest = place.abs().max_element().max(world.radii[row]).max(offset.abs());
        let speed = (world.velocity(row, now) - world.planes[plane].velocity).length();
        let rounding = touching(largest) + self.within_instant(speed);
        let gap = normal.dot(place) - offset - world.radii[row];
        if world.turning_body(row).is_none() {
            return gap <= rounding;
        }
        let tolerance = tolerance::contact(world.radii[row], place.length()) + rounding;
        gap <= tolerance && gap_above_plane(world, row, plane, now) <= tolerance
    }

    fn touches_mesh(&self, row: usize, mesh: usize, now: Time) -> bool {
        let world = &self.world;
        let surroundings = &world.meshes[mesh];
        let apart = world.position(row, now) - surroundings.position_at(now);
        let turning = surroundings.angular_velocity.length() * (apart.length() + world.radii[row]);
        let speed = (world.velocity(row, now) - surroundings.velocity).length() + turning;
        let tolerance =
            tolerance::contact(world.radii[row].max(surroundings.reach), apart.length()) + self.within_instant(speed);
        let body = Sought::new(world, row, now, DVec3::ZERO);
        gap_to_mesh(&body, surroundings, now, contact_gap) <= tolerance
    }

    /// Writes the states after, and books them.
    fn settle_together(&mut self, touching: &Touching, cluster: &Cluster, reflected: &Reflected, now: Time) {
        let mut partners = vec![Partner::NONE; touching.sides.len()];
        let (mut work, mut lost, mut elastic) = (0.0, 0.0, true);
        for (point, &impulse) in cluster.points.iter().zip(&reflected.impulses).filter(|&(_, &impulse)| impulse > 0.0) {
            let sides = point.bodies.map(|place| touching.sides[place]);
            for (k, other) in [(0, 1), (1, 0)] {
                partners[point.bodies[k]] = sides[other].itself;
            }
            let speeds = [&cluster.twists, &reflected.twists].map(|twists| cluster.speed(point, twists));
            lost -= 0.5 * impulse * (speeds[0] + speeds[1]);
            elastic &= point.restitution == 1.0;
            for (k, other, sign, arms) in
                [(0, 1, 1.0, [point.arms.a, point.arms.b]), (1, 0, -1.0, [point.arms.b, point.arms.a])]
            {
                if sides[k].is_free() && !sides[other].is_free() {
                    let kick = point.normal * (sign * impulse);
                    let done = kick.dot(sides[other].twist.at(arms[1]));
                    work += done;
                    self.ledger.wall_impulse.add(kick);
                    self.ledger.wall_moment.add((sides[k].position + arms[0]).cross(kick));
                    self.ledger.work.add(done);
                }
            }
        }
        for (place, side) in touching.sides.iter().enumerate() {
            if partners[place] != Partner::NONE {
                self.settle_turning(side, partners[place], reflected.twists[place], now);
            }
        }
        let pushed = |place: &usize| partners[*place] != Partner::NONE && touching.sides[*place].is_free();
        let mut rows: Vec<usize> =
            (0..touching.sides.len()).filter(pushed).filter_map(|place| touching.sides[place].row()).collect();
        rows.sort_by_key(|&row| self.world.bodies[row].rank);
        // As of pairs: elastic impacts carry the sum of the energies on, and what rounding left of it in equal parts.
        let carried: f64 = rows.iter().map(|&row| self.world.bodies[row].energy).sum::<f64>() + work;
        let now_is: f64 = rows.iter().map(|&row| self.world.energy(row)).sum();
        let part = if elastic { (carried - now_is) / rows.len() as f64 } else { 0.0 };
        for row in rows {
            self.world.bodies[row].energy = self.world.energy(row) + part;
        }
        if !elastic {
            self.ledger.dissipated.add(lost);
        }
    }
}

impl Touching {
    /// Adds a pair that touches, unless it is there.
    fn add(&mut self, simulation: &mut Simulation, row: usize, partner: Partner, now: Time, certificate: Certificate) {
        let rank = rank(&simulation.world, row, partner);
        if self.pairs.iter().any(|pair| pair.rank == rank) {
            return;
        }
        let turns = |row: usize, simulation: &Simulation| simulation.world.turning_body(row).is_some();
        let (sides, contact) = if let Some(other) = partner.as_ball() {
            let (a, b) = in_order(&simulation.world, row, other);
            let turn = turns(a, simulation) || turns(b, simulation);
            let contact = turn.then(|| simulation.contact_of_bodies(a, b, now));
            ([simulation.side(a, now), simulation.side(b, now)], contact)
        } else if let Some(plane) = partner.as_plane() {
            let turn = turns(row, simulation);
            let contact = if turn { simulation.contact_with_plane(row, plane, now) } else { None };
            ([simulation.side(row, now), simulation.side_of_plane(plane, now)], contact)
        } else if let Some(mesh) = partner.as_mesh() {
            let Some(contact) = simulation.contact_with_mesh(row, mesh, now) else { return };
            ([simulation.side(row, now), simulation.side_of_mesh(mesh, now)], Some(contact))
        } else {
            return;
        };
        let world = &simulation.world;
        let (normal, kind, points) = match (&contact, sides[1].row()) {
            (Some(contact), _) => {
                let points = contact.points().iter().map(|point| Arms { a: point.from_a, b: point.from_b }).collect();
                (contact.normal, simulation.kind(&sides, contact), points)
            }
            (None, Some(_)) => {
                let apart = simulation.predictor.periods().nearest(sides[0].position - sides[1].position);
                let radii = [0, 1].map(|k| sides[k].row().map_or(0.0, |row| world.radii[row]));
                let normal = apart / apart.length();
                (normal, Kind::BallBall, vec![Arms { a: -normal * radii[0], b: normal * radii[1] }])
            }
            (None, None) => {
                let plane = partner.as_plane().unwrap_or(0);
                let normal = world.planes[plane].normal;
                (normal, Kind::BallPlane, vec![Arms { a: -normal * world.radii[row], b: DVec3::ZERO }])
            }
        };
        let sides = sides.map(|side| self.place(side));
        let is_sunk = contact.is_some_and(|contact| contact.is_sunk);
        self.pairs.push(Pair { rank, sides, kind, certificate, normal, points, is_sunk });
    }

    fn place(&mut self, side: Side) -> usize {
        let known = self.sides.iter().position(|known| known.id == side.id);
        known.unwrap_or_else(|| {
            self.sides.push(side);
            self.sides.len() - 1
        })
    }

    fn is_of(&self, pair: &Pair, impact: &Impact) -> bool {
        let [a, b] = pair.sides.map(|place| self.sides[place].id);
        (a.min(b), a.max(b)) == (impact.a, impact.b)
    }

    fn cluster(&self, simulation: &Simulation) -> Cluster {
        let points = self.pairs.iter().flat_map(|pair| {
            let [a, b] = pair.sides.map(|place| self.sides[place].material);
            let restitution = simulation.world.restitution.of(a, b);
            pair.points.iter().map(move |&arms| Point { bodies: pair.sides, normal: pair.normal, arms, restitution })
        });
        let mobility = |side: &Side| if side.is_free() { side.mobility } else { Mobility::NONE };
        Cluster {
            mobilities: self.sides.iter().map(mobility).collect(),
            twists: self.sides.iter().map(|side| side.twist).collect(),
            points: points.collect(),
        }
    }

    /// The rows of the impacts, one for each pair that got an impulse. What each loses is minus the work of its impulses, of
    /// which only the sum is what is lost.
    fn impacts(&self, cluster: &Cluster, reflected: &Reflected, time: Time) -> Vec<Impact> {
        let mut first = 0;
        let mut impacts = Vec::new();
        for pair in &self.pairs {
            let places = first..first + pair.points.len();
            first = places.end;
            let (points, impulses) = (&cluster.points[places.clone()], &reflected.impulses[places]);
            let impulse: f64 = impulses.iter().sum();
            if !(impulse > 0.0) {
                continue;
            }
            let [a, b] = pair.sides.map(|place| &self.sides[place]);
            let [after_a, after_b] = pair.sides.map(|place| reflected.twists[place]);
            let mut centre = Arms::default();
            let mut energy_lost = 0.0;
            for (point, share) in points.iter().zip(impulses) {
                centre.a += point.arms.a * (share / impulse);
                centre.b += point.arms.b * (share / impulse);
                let speeds = cluster.speed(point, &cluster.twists) + cluster.speed(point, &reflected.twists);
                energy_lost -= 0.5 * share * speeds;
            }
            let speed = |a: &Twist, b: &Twist| (a.at(centre.a) - b.at(centre.b)).dot(pair.normal);
            let point = a.position + centre.a;
            let impact = Impact {
                time,
                a: a.id,
                b: b.id,
                kind: pair.kind,
                certificate: pair.certificate,
                point,
                normal: pair.normal,
                approach_speed: -speed(&a.twist, &b.twist),
                separation_speed: speed(&after_a, &after_b),
                impulse,
                restitution: points[0].restitution,
                energy_lost,
                velocities: [a.twist.velocity, b.twist.velocity, after_a.velocity, after_b.velocity],
                positions: [a.position, if b.itself.as_plane().is_some() { point } else { point - centre.b }],
                masses: [a.mass, b.mass],
            };
            impacts.push(if impact.a < impact.b { impact } else { impact.from_the_other_side() });
        }
        impacts
    }
}
