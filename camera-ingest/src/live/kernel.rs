//! A video device of this machine. The only unsafe code of the crate, each block
//! with its reason; Linux only.
#![allow(unsafe_code, reason = "system calls without a safe wrapper")]

use std::fs::{File, OpenOptions};
use std::io;
use std::os::fd::AsRawFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::ptr::NonNull;
use std::time::Duration;

use super::abi::{self, Request};
use super::device::{Device, Identity};

/// A mapped buffer of the driver.
#[derive(Debug)]
struct Mapped {
    start: NonNull<u8>,
    length: usize,
    /// The driver may write to it.
    queued: bool,
}

// SAFETY: the mapping belongs to the process, not to a thread, and only its owner
// touches it.
unsafe impl Send for Mapped {}

impl Mapped {
    fn new(file: &File, offset: u32, length: u32) -> io::Result<Self> {
        let length = length as usize;
        // SAFETY: a new mapping at an address of the kernel's choice touches nothing
        // that exists; the kernel checks descriptor, offset and length.
        let start = unsafe {
            libc::mmap(
                std::ptr::null_mut(),
                length,
                libc::PROT_READ | libc::PROT_WRITE,
                libc::MAP_SHARED,
                file.as_raw_fd(),
                libc::off_t::from(offset),
            )
        };
        if start == libc::MAP_FAILED {
            return Err(io::Error::last_os_error());
        }
        let start = NonNull::new(start.cast()).ok_or(io::ErrorKind::OutOfMemory)?;
        Ok(Self {
            start,
            length,
            queued: false,
        })
    }
}

impl Drop for Mapped {
    fn drop(&mut self) {
        // SAFETY: exactly what `mmap` gave; no slice of it outlives `self`.
        unsafe { libc::munmap(self.start.as_ptr().cast(), self.length) };
    }
}

/// An open `/dev/videoN`.
#[derive(Debug)]
pub(super) struct KernelDevice {
    file: File,
    buffers: Vec<Mapped>,
}

impl KernelDevice {
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(libc::O_NONBLOCK)
            .open(path)?;
        Ok(Self {
            file,
            buffers: Vec::new(),
        })
    }

    fn ask<T>(&self, request: &Request<T>, argument: &mut T) -> io::Result<()> {
        loop {
            // SAFETY: the request's number was made from the size of `T`, which has the
            // kernel's layout; the kernel reads and writes that many bytes of it, and
            // what a pointer in it points to belongs to the caller for the call.
            let code = unsafe {
                libc::ioctl(
                    self.file.as_raw_fd(),
                    request.number as libc::Ioctl,
                    std::ptr::from_mut(argument),
                )
            };
            if code != -1 {
                return Ok(());
            }
            let error = io::Error::last_os_error();
            if error.kind() != io::ErrorKind::Interrupted {
                return Err(error);
            }
        }
    }
}

/// Text up to the first zero.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

impl Device for KernelDevice {
    fn identity(&mut self) -> io::Result<Identity> {
        let mut found = abi::Capability::default();
        self.ask(&abi::QUERY_CAPABILITY, &mut found)?;
        // The device as a whole may do more than this node of it.
        let of_node = found.capabilities & abi::HAS_DEVICE_CAPS != 0;
        Ok(Identity {
            driver: text(&found.driver),
            card: text(&found.card),
            capabilities: if of_node {
                found.device_caps
            } else {
                found.capabilities
            },
        })
    }

    fn set_format(&mut self, format: abi::PixFormat) -> io::Result<abi::PixFormat> {
        let mut argument = abi::Format::of(format);
        self.ask(&abi::SET_FORMAT, &mut argument)?;
        Ok(argument.pix)
    }

    fn set_rate(&mut self, timeperframe: [u32; 2]) -> io::Result<Option<[u32; 2]>> {
        let mut argument = abi::StreamParm {
            kind: abi::VIDEO_CAPTURE,
            timeperframe,
            ..abi::StreamParm::default()
        };
        self.ask(&abi::SET_PARM, &mut argument)?;
        let chosen = argument.capability & abi::CAN_SET_RATE != 0;
        Ok(chosen.then_some(argument.timeperframe))
    }

    fn map_buffers(&mut self, count: u32) -> io::Result<u32> {
        let mut argument = abi::RequestBuffers {
            count,
            kind: abi::VIDEO_CAPTURE,
            memory: abi::MEMORY_MMAP,
            ..abi::RequestBuffers::default()
        };
        self.ask(&abi::REQUEST_BUFFERS, &mut argument)?;
        for index in 0..argument.count {
            let mut buffer = abi::Buffer::numbered(index);
            self.ask(&abi::QUERY_BUFFER, &mut buffer)?;
            self.buffers
                .push(Mapped::new(&self.file, buffer.offset, buffer.length)?);
        }
        Ok(argument.count)
    }

    fn queue(&mut self, index: u32) -> io::Result<()> {
        self.ask(&abi::QUEUE, &mut abi::Buffer::numbered(index))?;
        if let Some(buffer) = self.buffers.get_mut(index as usize) {
            buffer.queued = true;
        }
        Ok(())
    }

    fn dequeue(&mut self) -> io::Result<abi::Buffer> {
        let mut buffer = abi::Buffer::numbered(0);
        self.ask(&abi::DEQUEUE, &mut buffer)?;
        if let Some(mapped) = self.buffers.get_mut(buffer.index as usize) {
            mapped.queued = false;
        }
        Ok(buffer)
    }

    fn bytes(&self, index: u32) -> &[u8] {
        match self.buffers.get(index as usize) {
            Some(buffer) if !buffer.queued => {
                // SAFETY: mapped for as long as `self` lives; the driver writes only
                // while the buffer is queued, and queueing it needs `&mut self`.
                unsafe { std::slice::from_raw_parts(buffer.start.as_ptr(), buffer.length) }
            }
            _ => &[],
        }
    }

    fn stream(&mut self, on: bool) -> io::Result<()> {
        let request = if on { abi::STREAM_ON } else { abi::STREAM_OFF };
        self.ask(&request, &mut (abi::VIDEO_CAPTURE as i32))
    }

    fn wait(&self, timeout: Duration) -> io::Result<bool> {
        let mut one = libc::pollfd {
            fd: self.file.as_raw_fd(),
            events: libc::POLLIN,
            revents: 0,
        };
        let timeout_ms = i32::try_from(timeout.as_millis()).unwrap_or(i32::MAX);
        // SAFETY: one valid, writable pollfd, as said.
        let ready = unsafe { libc::poll(&raw mut one, 1, timeout_ms) };
        if ready >= 0 {
            return Ok(ready > 0);
        }
        let error = io::Error::last_os_error();
        // A signal ends the wait early; the caller knows how long it wants to wait.
        if error.kind() == io::ErrorKind::Interrupted {
            Ok(false)
        } else {
            Err(error)
        }
    }

    fn set_control(&mut self, id: u32, value: i32) -> io::Result<i32> {
        let mut argument = abi::Control { id, value };
        self.ask(&abi::SET_CONTROL, &mut argument)?;
        Ok(argument.value)
    }

    fn extension(
        &mut self,
        [unit, selector]: [u8; 2],
        query: u8,
        data: &mut [u8],
    ) -> io::Result<()> {
        let size =
            u16::try_from(data.len()).map_err(|_e| io::Error::from_raw_os_error(libc::ENOBUFS))?;
        let mut argument = abi::ExtensionQuery {
            unit,
            selector,
            query,
            size,
            data: data.as_mut_ptr(),
        };
        self.ask(&abi::EXTENSION, &mut argument)
    }
}

impl Drop for KernelDevice {
    fn drop(&mut self) {
        // The driver stops writing before its memory is unmapped.
        let _ = self.stream(false);
    }
}
