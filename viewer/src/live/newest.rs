//! A place for one value: whoever comes late gets the newest and never a queue.

use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// The newest value and its number, counted from 1.
#[derive(Debug, Default)]
pub(crate) struct Newest<T> {
    slot: Mutex<(u64, Option<Arc<T>>)>,
    changed: Condvar,
}

impl<T> Newest<T> {
    /// Puts in a value; the one before is forgotten.
    pub(crate) fn put(&self, value: T) {
        let mut slot = self.slot.lock().unwrap_or_else(PoisonError::into_inner);
        *slot = (slot.0 + 1, Some(Arc::new(value)));
        drop(slot);
        self.changed.notify_all();
    }

    /// A value with another number than `seen`, waited for at most `patience`.
    pub(crate) fn other_than(&self, seen: u64, patience: Duration) -> Option<(u64, Arc<T>)> {
        let slot = self.slot.lock().unwrap_or_else(PoisonError::into_inner);
        let known = |slot: &mut (u64, Option<Arc<T>>)| slot.0 == seen || slot.1.is_none();
        let waited = self.changed.wait_timeout_while(slot, patience, known);
        let (slot, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let other = slot.1.as_ref().filter(|_| slot.0 != seen)?;
        Some((slot.0, Arc::clone(other)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    #[test]
    fn who_comes_late_gets_the_newest_only_and_each_once() {
        let place = Newest::default();
        let none = Duration::ZERO;
        assert!(place.other_than(0, none).is_none());
        let patience = Duration::from_millis(50);
        let begun = Instant::now();
        assert!(place.other_than(7, patience).is_none());
        assert!(begun.elapsed() >= patience, "an empty place is waited at");
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
