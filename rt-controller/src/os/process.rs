//! Other processes of this machine: who holds a socket, and who has ended.

use std::io::Error;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::os::unix::net::UnixStream;

/// Process behind the other end of a local socket, `None` if the system does
/// not say. Not RT-safe.
#[must_use]
pub fn peer_pid(stream: &UnixStream) -> Option<u32> {
    let mut credentials = libc::ucred {
        pid: 0,
        uid: 0,
        gid: 0,
    };
    let mut size = libc::socklen_t::try_from(size_of::<libc::ucred>()).ok()?;
    // SAFETY: the descriptor is open while `stream` lives; `credentials` is
    // writable and `size` holds its size for the duration of the call.
    let code = unsafe {
        libc::getsockopt(
            stream.as_raw_fd(),
            libc::SOL_SOCKET,
            libc::SO_PEERCRED,
            (&raw mut credentials).cast(),
            &raw mut size,
        )
    };
    if code != 0 {
        return None;
    }
    u32::try_from(credentials.pid).ok().filter(|pid| *pid > 0)
}

/// Number of the only thread of process `pid` with this name, as the system
/// counts; `None` when there is none, or more than one. Not RT-safe.
#[must_use]
pub fn thread_of(pid: u32, name: &str) -> Option<u32> {
    let threads = std::fs::read_dir(format!("/proc/{pid}/task")).ok()?;
    let mut found = threads.flatten().filter(|thread| {
        std::fs::read_to_string(thread.path().join("comm")).is_ok_and(|comm| comm.trim() == name)
    });
    let first = found.next()?;
    match found.next() {
        None => first.file_name().to_str()?.parse().ok(),
        Some(_another) => None,
    }
}

/// Whether thread `thread` of process `pid` is there; true where that cannot be
/// told. One system call that never waits.
#[must_use]
pub fn thread_lives(pid: u32, thread: u32) -> bool {
    let (Ok(pid), Ok(thread)) = (libc::pid_t::try_from(pid), libc::pid_t::try_from(thread)) else {
        return true;
    };
    if pid <= 0 || thread <= 0 {
        return true;
    }
    // SAFETY: takes numbers only; signal 0 checks and does nothing.
    let code = unsafe { libc::syscall(libc::SYS_tgkill, pid, thread, 0) };
    code == 0 || Error::last_os_error().raw_os_error() != Some(libc::ESRCH)
}

/// Watches one process for its end, however it ends.
#[derive(Debug)]
pub struct ProcessWatch {
    descriptor: OwnedFd,
}

impl ProcessWatch {
    /// Watches the process `pid`.
    ///
    /// # Errors
    /// What the system says, for instance when there is no such process.
    pub fn new(pid: u32) -> Result<Self, Error> {
        let pid = libc::pid_t::try_from(pid).map_err(Error::other)?;
        // SAFETY: takes a number and flags only; the result is checked below.
        let descriptor = unsafe { libc::syscall(libc::SYS_pidfd_open, pid, 0) };
        let descriptor = i32::try_from(descriptor).map_err(Error::other)?;
        if descriptor < 0 {
            return Err(Error::last_os_error());
        }
        // SAFETY: the call succeeded, so the descriptor is open and nobody
        // else's.
        let descriptor = unsafe { OwnedFd::from_raw_fd(descriptor) };
        Ok(Self { descriptor })
    }

    /// Whether the process has ended. One system call that never waits.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        let mut poll = libc::pollfd {
            fd: self.descriptor.as_raw_fd(),
            events: libc::POLLIN,
            revents: 0,
        };
        // SAFETY: one valid pollfd, its count, and no time to wait.
        let ready = unsafe { libc::poll(&raw mut poll, 1, 0) };
        ready > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::{Command, Stdio};
    use std::time::Duration;

    /// Whether it comes true within two seconds.
    fn soon(holds: impl Fn() -> bool) -> bool {
        (0..2000).any(|_| {
            std::thread::sleep(Duration::from_millis(1));
            holds()
        })
    }

    #[test]
    fn an_ended_thread_is_seen() {
        let name = "to be found";
        let (begin, begun) = std::sync::mpsc::channel();
        let (end, ended) = std::sync::mpsc::channel::<()>();
        let thread = std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || {
                begin.send(()).unwrap();
                let _ = ended.recv();
            })
            .unwrap();
        begun.recv().unwrap();
        let me = std::process::id();
        let id = thread_of(me, name).unwrap();
        assert_eq!(thread_of(me, "nobody's name"), None);
        assert!(thread_lives(me, id) && thread_lives(me, me));
        assert!(thread_lives(me, 0), "unknown is not ended");
        drop(end);
        thread.join().unwrap();
        // The system lets go of a thread a moment after it was joined.
        assert!(soon(|| !thread_lives(me, id)));
    }

    #[test]
    fn an_ended_process_is_seen_before_it_is_waited_for() {
        let mut child = Command::new("cat")
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let watch = ProcessWatch::new(child.id()).unwrap();
        assert!(!watch.has_ended());
        child.kill().unwrap();
        let seen = soon(|| watch.has_ended());
        assert!(seen, "although nobody waited for it");
        let pid = child.id();
        child.wait().unwrap();
        assert!(ProcessWatch::new(pid).is_err(), "there is no such process");
    }
}
