//! A place for one value: whoever comes late gets the newest and never a queue.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

#[derive(Debug)]
struct Slot<T> {
    /// Values put in so far.
    count: u64,
    value: Option<Arc<T>>,
}

/// The newest value and its number, counted from 1.
#[derive(Debug)]
pub(crate) struct Newest<T> {
    slot: Mutex<Slot<T>>,
    changed: Condvar,
}

impl<T> Default for Newest<T> {
    fn default() -> Self {
        let slot = Slot {
            count: 0,
            value: None,
        };
        Self {
            slot: Mutex::new(slot),
            changed: Condvar::new(),
        }
    }
}

impl<T> Newest<T> {
    fn slot(&self) -> MutexGuard<'_, Slot<T>> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts in a value; the one before is forgotten.
    pub(crate) fn put(&self, value: T) {
        let mut slot = self.slot();
        slot.count += 1;
        slot.value = Some(Arc::new(value));
        drop(slot);
        self.changed.notify_all();
    }

    /// A value with another number than `seen`, waited for at most `patience`.
    pub(crate) fn other_than(&self, seen: u64, patience: Duration) -> Option<(u64, Arc<T>)> {
        let until = Instant::now() + patience;
        let mut slot = self.slot();
        loop {
            if slot.count != seen
                && let Some(value) = &slot.value
            {
                return Some((slot.count, Arc::clone(value)));
            }
            let left = until.checked_duration_since(Instant::now())?;
            slot = self
                .changed
                .wait_timeout(slot, left)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_comes_late_gets_the_newest_only_and_each_once() {
        let place = Newest::default();
        let none = Duration::ZERO;
        assert!(place.other_than(0, none).is_none());
        for value in 1..=5 {
            place.put(value);
        }
        let (number, value) = place.other_than(0, none).unwrap();
        assert_eq!((number, *value), (5, 5));
        assert!(place.other_than(number, none).is_none());
        std::thread::scope(|scope| {
            let waits = scope.spawn(|| place.other_than(5, Duration::from_secs(20)));
            std::thread::sleep(Duration::from_millis(20));
            place.put(6);
            assert_eq!(*waits.join().unwrap().unwrap().1, 6);
        });
    }
}
