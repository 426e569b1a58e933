//! Long vectors that grow while a run goes on, by a sixteenth at a time.

/// Makes room for `more` elements. Where doubling a vector would leave up to half of it empty for good, this leaves a seventeenth.
#[inline(always)]
pub(crate) fn make_room<T>(vector: &mut Vec<T>, more: usize) {
    if vector.capacity() - vector.len() < more {
        enlarge(vector, more);
    }
}

#[cold]
fn enlarge<T>(vector: &mut Vec<T>, more: usize) {
    vector.reserve_exact(more.max(vector.len() / 16).max(64));
}

/// A vector of `count` elements that has room for a sixteenth more.
pub(crate) fn filled<T: Clone>(element: T, count: usize) -> Vec<T> {
    let mut vector = Vec::with_capacity(count + count / 16);
    vector.resize(count, element);
    vector
}

#[cfg(test)]
mod tests {
    use super::make_room;

    #[test]
    fn a_long_vector_is_never_emptier_than_a_seventeenth() {
        let mut vector = Vec::new();
        for k in 0..100_000 {
            make_room(&mut vector, 1);
            vector.push(k);
            assert!(vector.capacity() <= vector.len() * 17 / 16 + 64);
        }
    }
}
