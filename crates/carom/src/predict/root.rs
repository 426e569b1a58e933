//! First downward crossings of a polynomial, for pairs whose relative acceleration is not zero.

/// p(t) = c[0] + c[1] t + c[2] t² + …
fn value(coefficients: &[f64], t: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, &c| sum * t + c)
}

fn derivative<const N: usize>(coefficients: &[f64; N], degree: usize) -> ([f64; N], usize) {
    let mut result = [0.0; N];
    for k in 1..=degree {
        result[k - 1] = coefficients[k] * k as f64;
    }
    (result, degree.saturating_sub(1))
}

/// The point in (low, high), where p changes sign once, at which it does: bisection to neighbouring floats. The result is
/// the end of that last interval on the side of `low`'s sign, so that p has not yet changed sign there.
fn bisect(coefficients: &[f64], mut low: f64, mut high: f64) -> f64 {
    let negative_at_low = value(coefficients, low) < 0.0;
    loop {
        let middle = low + 0.5 * (high - low);
        if middle <= low || middle >= high {
            return low;
        }
        if (value(coefficients, middle) < 0.0) == negative_at_low {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// All points in (0, end) where p changes sign, in order, found between the turning points of p, which are found in the
/// same way from its derivative: no root is lost beside a double root, as it is in closed formulas of third and fourth
/// degree.
fn sign_changes<const N: usize>(coefficients: &[f64; N], degree: usize, end: f64) -> ([f64; N], usize) {
    let mut found = [0.0; N];
    let mut count = 0;
    if degree == 0 {
        return (found, count);
    }
    let (slope, slope_degree) = derivative(coefficients, degree);
    let (turns, turn_count) = sign_changes(&slope, slope_degree, end);
    let mut low = 0.0;
    let mut at_low = value(coefficients, low);
    for &high in turns[..turn_count].iter().chain(std::iter::once(&end)) {
        let at_high = value(coefficients, high);
        if (at_low < 0.0) != (at_high < 0.0) && high > low {
            found[count] = bisect(coefficients, low, high);
            count += 1;
        }
        (low, at_low) = (high, at_high);
    }
    (found, count)
}

/// The first t in (0, end) at which the polynomial of degree N - 1 falls from not negative to negative; `None` if it never
/// does. (If it is negative at 0 it has to rise first.)
pub fn first_descent<const N: usize>(coefficients: &[f64; N], end: f64) -> Option<f64> {
    let (changes, count) = sign_changes(coefficients, N - 1, end);
    let mut negative = value(coefficients, 0.0) < 0.0;
    for &t in &changes[..count] {
        if !negative {
            return Some(t);
        }
        negative = false;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (t - a)(t - b)(t - c)(t - d) times `scale`.
    fn quartic(roots: [f64; 4], scale: f64) -> [f64; 5] {
        let mut c = [scale, 0.0, 0.0, 0.0, 0.0];
        for (k, root) in roots.iter().enumerate() {
            for j in (0..=k + 1).rev() {
                c[j] = if j > 0 { c[j - 1] } else { 0.0 } - root * c[j];
            }
        }
        c
    }

    #[test]
    fn finds_the_first_of_four() {
        let c = quartic([1.0, 2.0, 3.0, 4.0], 1.0);
        // One bisection step leaves the rounding of p over its slope (6): a few 1e-15.
        assert!((first_descent(&c, 100.0).expect("root") - 1.0).abs() < 1e-13);
        assert!((first_descent(&quartic([-1.0, 2.0, 3.0, 4.0], 1.0), 100.0).expect("root") - 3.0).abs() < 1e-13);
    }

    #[test]
    fn a_touch_is_no_descent_and_a_near_touch_is() {
        assert_eq!(first_descent(&[1.0, -2.0, 1.0 + 1e-14, 0.0, 0.0], 10.0), None);
        assert!(first_descent(&[1.0, -2.0, 1.0 - 1e-14, 0.0, 0.0], 10.0).is_some());
    }
}
