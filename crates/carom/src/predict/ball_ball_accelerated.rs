//! A ball that falls meets a ball that does not (a fixed one, under gravity).

use glam::DVec3;

use super::root::first_descent;

/// Seconds until |r + v t + a t²/2| first falls to `contact_distance`, or `None`.
///
/// `r` (m), `v` (m/s), `a` (m/s², not zero): centre, velocity and acceleration of A seen from B. A quartic; its first
/// descent is isolated between its turning points, never by a closed formula. `in_contact`: the last impact of the moving
/// ball was this pair's, at its start: the known root at zero is then divided out.
pub fn time_of_impact(r: DVec3, v: DVec3, a: DVec3, contact_distance: f64, in_contact: bool) -> Option<f64> {
    let distance = r.length();
    let c0 = (distance - contact_distance) * (distance + contact_distance);
    let c1 = 2.0 * r.dot(v);
    let c2 = v.length_squared() + r.dot(a);
    let c3 = v.dot(a);
    let c4 = 0.25 * a.length_squared();
    // From here on the quadratic term alone keeps the balls apart.
    let acceleration = a.length();
    let speed = v.length();
    let end =
        (speed + (speed * speed + 2.0 * acceleration * (distance + contact_distance)).sqrt()) / acceleration * 2.0;
    if in_contact || c0 <= 0.0 {
        if c1 < 0.0 || (c1 == 0.0 && c2 <= 0.0) {
            return Some(0.0);
        }
        return first_descent(&[c1, c2, c3, c4], end);
    }
    first_descent(&[c0, c1, c2, c3, c4], end)
}
