//! Asking for memory before it is needed.

/// Asks for the line of memory in which `data[index]` begins, and waits for nothing. An index that is out of bounds does no harm.
///
/// It goes into the second-level cache where that can be told. A processor has room for some twenty lines on their way to the
/// first level, and for far more on their way to the second; and what has come that far is waited for no longer than the work
/// around it takes.
#[inline(always)]
pub fn prefetch<T>(data: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(registers) = pulp::core_arch::x86::Sse::try_new() {
        registers._mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T1 }>(data.as_ptr().wrapping_add(index).cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    prefetch_index::prefetch_index(data, index);
}
