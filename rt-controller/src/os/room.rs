//! Room in shared memory.
//!
//! Shared memory is a file system of its own, and often a small one: containers
//! give it 64 MB. A process that touches a page there is no room for is ended by
//! the system without a word, so the room is looked at before anything is put
//! there.

use std::ffi::CStr;

/// Where shared memory lies on Linux.
const SHARED_MEMORY: &CStr = c"/dev/shm";

/// Free room in shared memory (MB), `None` when the system does not say. Not
/// RT-safe.
#[must_use]
pub fn shared_memory_free_mb() -> Option<u64> {
    // SAFETY: an all-zero statvfs is valid; it is filled by the call below.
    let mut room: libc::statvfs = unsafe { core::mem::zeroed() };
    // SAFETY: a path that ends with a zero and a statvfs to write to, both live
    // for the duration of the call.
    let code = unsafe { libc::statvfs(SHARED_MEMORY.as_ptr(), &raw mut room) };
    (code == 0).then(|| room.f_bavail.saturating_mul(room.f_frsize) / 1_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_that_runs_tests_has_some_room() {
        assert!(shared_memory_free_mb().unwrap() > 0);
    }
}
