//! Work on several threads.

/// Threads beyond which more make nothing faster.
pub(crate) const THREADS_MAX: usize = 1024;

/// What `make` gives for 0 to `count`, in that order, on so many threads or else all processors.
pub(crate) fn on_threads<T: Send>(
    threads: Option<usize>,
    count: usize,
    make: &(impl Fn(usize) -> anyhow::Result<T> + Sync),
) -> anyhow::Result<Vec<T>> {
    let processors = || std::thread::available_parallelism().map_or(1, usize::from);
    let threads = threads.unwrap_or_else(processors).clamp(1, THREADS_MAX);
    let each = count.div_ceil(threads).max(1);
    let part = |first: usize| -> anyhow::Result<Vec<T>> {
        (first..(first + each).min(count)).map(make).collect()
    };
    let parts = std::thread::scope(|scope| {
        let begin = |first| scope.spawn(move || part(first));
        let running: Vec<_> = (0..count).step_by(each).map(begin).collect();
        let end = |part: std::thread::ScopedJoinHandle<'_, anyhow::Result<Vec<T>>>| {
            part.join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        running
            .into_iter()
            .map(end)
            .collect::<anyhow::Result<Vec<_>>>()
    })?;
    Ok(parts.into_iter().flatten().collect())
}
