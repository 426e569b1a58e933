//! Ball meets plane: one dimension, along the plane's normal.

/// Seconds until a gap closes, or `None` if it never does.
///
/// `gap` (m) is the distance from the ball's surface to the plane, `speed` (m/s) and `acceleration` (m/s²) the rates at
/// which it grows. The stable root of gap + speed t + acceleration t²/2 = 0 that is reached while closing.
/// `in_contact`: the ball's last impact was with this plane, at its start; the gap is then zero by definition, and not
/// searched for from a rounding of it.
#[inline(always)]
pub fn time_of_impact(gap: f64, speed: f64, acceleration: f64, in_contact: bool) -> Option<f64> {
    let gap = if in_contact { 0.0 } else { gap.max(0.0) };
    if acceleration == 0.0 {
        return (speed < 0.0).then(|| gap / -speed);
    }
    let discriminant = speed * speed - 2.0 * acceleration * gap;
    if speed < 0.0 {
        // Pulled away (acceleration > 0), it may turn back before it arrives.
        return (discriminant > 0.0).then(|| 2.0 * gap / (discriminant.sqrt() - speed));
    }
    (acceleration < 0.0).then(|| (speed + discriminant.sqrt()) / -acceleration)
}
