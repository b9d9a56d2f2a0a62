//! Receiving with the kernel's own time of arrival.
//!
//! The control loop looks at its socket once per cycle, so its own clock would
//! round every round trip up to a whole period. The kernel stamps each packet
//! when it comes in; that is the time reported.

use super::clock::{now_ns, realtime_ns};
use super::schedule::done;
use std::io::{Error, Result};
use std::net::TcpStream;
use std::os::fd::AsRawFd;

/// Room for one timestamp message, aligned as control messages must be.
type Control = [u64; 8];

/// Asks the kernel to stamp what this socket receives. Not RT-safe.
///
/// # Errors
/// What the system says; reception works without.
pub fn stamp_arrivals(stream: &TcpStream) -> Result<()> {
    let on: libc::c_int = 1;
    let size = u32::try_from(size_of::<libc::c_int>()).unwrap_or(4);
    // SAFETY: the descriptor is open while `stream` lives; `on` is a valid int
    // of the size passed.
    done(unsafe {
        libc::setsockopt(
            stream.as_raw_fd(),
            libc::SOL_SOCKET,
            libc::SO_TIMESTAMPNS,
            (&raw const on).cast(),
            size,
        )
    })
}

/// Receives into `buffer`: how many bytes, and when the last of them arrived
/// (CLOCK_MONOTONIC, ns) if the kernel said so. RT-safe on a non-blocking
/// socket.
///
/// # Errors
/// What the system says, `WouldBlock` included.
pub fn receive(stream: &TcpStream, buffer: &mut [u8]) -> Result<(usize, Option<u64>)> {
    let mut control: Control = [0; 8];
    let mut part = libc::iovec {
        iov_base: buffer.as_mut_ptr().cast(),
        iov_len: buffer.len(),
    };
    // SAFETY: an all-zero msghdr is valid; its pointers are set just below.
    let mut message: libc::msghdr = unsafe { core::mem::zeroed() };
    message.msg_iov = &raw mut part;
    message.msg_iovlen = 1;
    message.msg_control = (&raw mut control).cast();
    message.msg_controllen = size_of::<Control>();
    // SAFETY: `message` points to a live buffer, vector and control space, each
    // with its true length, for the duration of the call.
    let received = unsafe { libc::recvmsg(stream.as_raw_fd(), &raw mut message, 0) };
    let Ok(received) = usize::try_from(received) else {
        return Err(Error::last_os_error());
    };
    Ok((received, arrival_ns(&message)))
}

/// The stamp among the control messages, moved from the wall clock to the
/// monotonic one. The wall clock may be stepped in between; an arrival after
/// now is none.
fn arrival_ns(message: &libc::msghdr) -> Option<u64> {
    // SAFETY: `message` was filled by recvmsg; the kernel's control messages
    // lie in its control space, which lives in the caller.
    let header = unsafe { libc::CMSG_FIRSTHDR(message).as_ref() }?;
    if header.cmsg_level != libc::SOL_SOCKET || header.cmsg_type != libc::SCM_TIMESTAMPNS {
        return None;
    }
    // SAFETY: a message of this type holds one timespec; it may be unaligned.
    let stamp: libc::timespec = unsafe {
        libc::CMSG_DATA(header)
            .cast::<libc::timespec>()
            .read_unaligned()
    };
    let seconds = u64::try_from(stamp.tv_sec).ok()?;
    let nanoseconds = u64::try_from(stamp.tv_nsec).ok()?;
    let stamp_ns = seconds
        .checked_mul(1_000_000_000)?
        .checked_add(nanoseconds)?;
    let age_ns = realtime_ns().checked_sub(stamp_ns)?;
    now_ns().checked_sub(age_ns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::net::TcpListener;
    use std::time::Duration;

    #[test]
    fn the_stamp_is_the_arrival_and_not_the_look() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut sender = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (receiver, _) = listener.accept().unwrap();
        stamp_arrivals(&receiver).unwrap();
        // The first stamped packet may miss the switch being thrown.
        std::thread::sleep(Duration::from_millis(50));
        let before = now_ns();
        sender.write_all(b"hello").unwrap();
        let after = now_ns();
        std::thread::sleep(Duration::from_millis(100));
        let mut buffer = [0; 16];
        let (n, arrival) = receive(&receiver, &mut buffer).unwrap();
        assert_eq!(&buffer[..n], b"hello");
        let arrival = arrival.unwrap();
        let slack = 20_000_000;
        assert!(
            arrival + slack > before && arrival < after + slack,
            "{before} {arrival} {after}"
        );
    }
}
