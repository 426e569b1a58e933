//! When two bodies are near enough to touch at all: when the spheres around them overlap, or a sphere and a plane.

use glam::DVec3;

use crate::predict::root::first_descent;

/// Seconds from and until which bodies may touch.
pub type Window = (f64, f64);

/// The window in which |x + v t| ≤ `reach` (m) at t ≥ 0, if there is one. As `ball_ball`, by forms that do not cancel.
#[inline(always)]
pub fn of_straight_flight(x: DVec3, v: DVec3, reach: f64) -> Option<Window> {
    let square = v.length_squared();
    let along = x.dot(v);
    let distance = x.length();
    let outside = (distance - reach) * (distance + reach);
    if outside > 0.0 && along >= 0.0 {
        return None;
    }
    if square == 0.0 {
        return Some((0.0, f64::INFINITY));
    }
    let discriminant = reach * reach * square - x.cross(v).length_squared();
    if discriminant < 0.0 && outside > 0.0 {
        return None;
    }
    let root = discriminant.max(0.0).sqrt();
    let entry = if outside > 0.0 { outside / (root - along) } else { 0.0 };
    let exit = if along > 0.0 { -outside / (along + root) } else { (root - along) / square };
    Some((entry, exit.max(entry)))
}

/// The first window from `after` (s) on in which p(t) = c₀ + c₁ t + … ≤ 0. If `after` is not 0, it is where one has ended.
pub fn below_zero<const N: usize>(mut c: [f64; N], after: f64) -> Option<Window> {
    if after > 0.0 {
        shift(&mut c, after);
        c[0] = c[0].max(f64::MIN_POSITIVE);
    }
    // No root lies beyond (Cauchy's bound).
    let leading = c.iter().rposition(|&x| x != 0.0).unwrap_or(0);
    if leading == 0 {
        return (c[0] <= 0.0).then_some((after, f64::INFINITY));
    }
    let end = 1.0 + c[..leading].iter().fold(0.0, |most: f64, x| most.max((x / c[leading]).abs()));
    let entry = if c[0] <= 0.0 { 0.0 } else { first_descent(&c, end)? };
    let mut above = c;
    shift(&mut above, entry);
    above[0] = if entry > 0.0 { 0.0 } else { above[0].min(0.0) };
    let negated = above.map(|x| -x);
    let exit = first_descent(&negated, end).map_or(f64::INFINITY, |seconds| after + entry + seconds);
    Some((after + entry, exit))
}

/// The coefficients of p(t + by).
fn shift<const N: usize>(c: &mut [f64; N], by: f64) {
    for low in 0..N {
        for k in (low..N - 1).rev() {
            c[k] += c[k + 1] * by;
        }
    }
}
