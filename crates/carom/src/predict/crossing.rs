//! When a coordinate leaves an interval: the bookkeeping of cells, which never writes a state.

/// Seconds after the start at which a coordinate at `x` (m), moving at `v` (m/s) with acceleration `a` (m/s²), passes
/// `bound` while growing, if that is later than `elapsed`; `elapsed` itself if that was before and it is still growing
/// (rounding of an earlier crossing); infinity if it never does.
#[inline(always)]
pub fn time_of_passage(x: f64, v: f64, a: f64, bound: f64, elapsed: f64) -> f64 {
    let s = x - bound;
    let time = if a == 0.0 {
        if v > 0.0 { -s / v } else { f64::INFINITY }
    } else {
        let discriminant = v * v - 2.0 * a * s;
        if discriminant < 0.0 {
            f64::INFINITY
        } else if v >= 0.0 {
            let sum = v + discriminant.sqrt();
            if sum > 0.0 { -2.0 * s / sum } else { f64::INFINITY }
        } else {
            (discriminant.sqrt() - v) / a
        }
    };
    if time > elapsed {
        return time;
    }
    // The bound lies behind by now, and yet it is the one ahead: by rounding of an earlier crossing. Decided by the sign of
    // the velocity alone, because the position is as likely rounded to one side as to the other.
    let rate = v + a * elapsed;
    let growing = rate > 0.0 || (rate == 0.0 && a > 0.0);
    if growing && time.is_finite() { elapsed } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_once_upward_under_gravity() {
        // Thrown at 10 m/s under 10 m/s²: passes 3.75 m upward at 0.5 s; downward (1.5 s) is not its business.
        assert_eq!(time_of_passage(0.0, 10.0, -10.0, 3.75, 0.0), 0.5);
        assert_eq!(time_of_passage(0.0, 10.0, -10.0, 3.75, 1.6), f64::INFINITY);
        // Still beyond it and growing: now.
        assert_eq!(time_of_passage(0.0, 10.0, -10.0, 3.75, 0.6), 0.6);
        assert_eq!(time_of_passage(0.0, 10.0, -10.0, 5.1, 0.0), f64::INFINITY);
        // Falling up through the bound (a > 0) after turning round.
        assert_eq!(time_of_passage(0.0, -10.0, 10.0, 0.0, 0.1), 2.0);
    }
}
