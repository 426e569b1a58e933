//! Ball meets ball in relative free flight.

use glam::DVec3;

/// Seconds until two balls touch, or `None` if they never do.
///
/// `r` (m) and `v` (m/s) are the centre and the velocity of A seen from B, which fly with the same acceleration, so that
/// |r + v t| = s is a quadratic; `contact_distance` s is the sum of the radii. The first root is
///
///   t = c / (-b + √D),  b = r·v,  c = (|r| - s)(|r| + s),  D = s² v² - |r × v|²,
///
/// with D by Lagrange's identity: b² - v² c loses every digit of a grazing or distant pair, this form does not.
/// Overlap rule (Bannerman et al. 2014): balls that rounding pushed into each other meet now if they approach, and not at
/// all if they part. So a pair just resolved is not found again at the same instant, and no time tolerance is needed.
#[inline(always)]
pub fn time_of_impact(r: DVec3, v: DVec3, contact_distance: f64) -> Option<f64> {
    let b = r.dot(v);
    if b >= 0.0 {
        return None;
    }
    let discriminant = contact_distance * contact_distance * v.length_squared() - r.cross(v).length_squared();
    // Negated so that a tangent pass (0: the surfaces meet without approaching) is no impact either.
    if !(discriminant > 0.0) {
        return overlapping_now(r, contact_distance);
    }
    let distance = r.length();
    let c = (distance - contact_distance) * (distance + contact_distance);
    if c <= 0.0 {
        return Some(0.0);
    }
    Some(c / (discriminant.sqrt() - b))
}

/// D ≤ 0 can still belong to a pair that rounding pushed into contact.
#[cold]
fn overlapping_now(r: DVec3, contact_distance: f64) -> Option<f64> {
    (r.length() < contact_distance).then_some(0.0)
}

/// As [`time_of_impact`], while the contact distance grows at `growth` (m/s): |r + v t| = s + G t (Lubachevsky–Stillinger).
pub fn time_of_impact_growing(r: DVec3, v: DVec3, contact_distance: f64, growth: f64) -> Option<f64> {
    let a = v.length_squared() - growth * growth;
    let b = r.dot(v) - contact_distance * growth;
    let distance = r.length();
    let c = (distance - contact_distance) * (distance + contact_distance);
    if c <= 0.0 {
        return (b < 0.0).then_some(0.0);
    }
    if a > 0.0 && b >= 0.0 {
        return None;
    }
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return None;
    }
    let time = c / (discriminant.sqrt() - b);
    (time >= 0.0).then_some(time)
}
