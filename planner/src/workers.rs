//! Work split over threads, results in the order of the input.

/// Applies `f` to every item, in `threads` contiguous parts. The result does
/// not depend on `threads`. A panic of `f` is passed on.
pub fn map_in_order<T: Sync, R: Send>(
    items: &[T],
    threads: usize,
    f: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let part = items.len().div_ceil(threads.max(1)).max(1);
    let mut out = Vec::with_capacity(items.len());
    std::thread::scope(|scope| {
        let f = &f;
        let workers: Vec<_> = items
            .chunks(part)
            .map(|chunk| scope.spawn(move || chunk.iter().map(f).collect::<Vec<_>>()))
            .collect();
        for worker in workers {
            match worker.join() {
                Ok(part) => out.extend(part),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
    });
    out
}

#[cfg(test)]
mod tests {
    #[test]
    fn order_is_kept_for_any_number_of_threads() {
        let items: Vec<u32> = (0..17).collect();
        let expected: Vec<u32> = items.iter().map(|i| i * i).collect();
        for threads in [0, 1, 2, 5, 40] {
            assert_eq!(super::map_in_order(&items, threads, |i| i * i), expected);
        }
    }
}
