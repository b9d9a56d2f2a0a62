//! The words of the kernel's video interface (`linux/videodev2.h`,
//! `linux/uvcvideo.h`) that a camera is read with, for 64-bit machines.

use std::marker::PhantomData;

/// Buffers are filled by a camera.
pub(super) const VIDEO_CAPTURE: u32 = 1;
/// Buffers lie in the driver and are mapped.
pub(super) const MEMORY_MMAP: u32 = 1;
/// No interlacing.
pub(super) const FIELD_NONE: u32 = 1;
/// `YUYV`, as four letters.
pub(super) const YUYV: u32 = u32::from_le_bytes(*b"YUYV");
/// [`Capability::device_caps`]: it captures one plane.
pub(super) const CAN_CAPTURE: u32 = 0x1;
/// [`Capability::device_caps`]: it hands out mapped buffers.
pub(super) const CAN_STREAM: u32 = 0x0400_0000;
/// [`Capability::capabilities`]: `device_caps` is filled in.
pub(super) const HAS_DEVICE_CAPS: u32 = 0x8000_0000;
/// [`StreamParm::capability`]: the rate can be chosen.
pub(super) const CAN_SET_RATE: u32 = 0x1000;
/// [`Buffer::flags`]: the picture is damaged.
pub(super) const FLAG_ERROR: u32 = 0x40;
/// [`Buffer::flags`]: which clock the stamp is of.
pub(super) const FLAG_CLOCK: u32 = 0xe000;
/// The value of [`FLAG_CLOCK`] for CLOCK_MONOTONIC.
pub(super) const CLOCK_MONOTONIC: u32 = 0x2000;
/// The ordinary control for gain.
pub(super) const CONTROL_GAIN: u32 = 0x0098_0913;
/// Extension units: set the value.
pub(super) const SET_CURRENT: u8 = 0x01;
/// Extension units: read the value.
pub(super) const GET_CURRENT: u8 = 0x81;
/// Extension units: how long the value is.
pub(super) const GET_LENGTH: u8 = 0x85;

/// A request to the driver with an argument of type `T`; the number encodes for the kernel
/// how long `T` is.
#[derive(Debug)]
pub(super) struct Request<T> {
    pub(super) number: u32,
    argument: PhantomData<fn(T)>,
}

impl<T> Request<T> {
    /// `_IOR`, `_IOW` and `_IOWR` of `asm-generic/ioctl.h`.
    const fn new(direction: u32, group: u8, number: u8) -> Self {
        let size = size_of::<T>() as u32;
        Self {
            number: direction << 30 | size << 16 | (group as u32) << 8 | number as u32,
            argument: PhantomData,
        }
    }
}

const WRITE: u32 = 1;
const READ: u32 = 2;

pub(super) const QUERY_CAPABILITY: Request<Capability> = Request::new(READ, b'V', 0);
pub(super) const SET_FORMAT: Request<Format> = Request::new(READ | WRITE, b'V', 5);
pub(super) const REQUEST_BUFFERS: Request<RequestBuffers> = Request::new(READ | WRITE, b'V', 8);
pub(super) const QUERY_BUFFER: Request<Buffer> = Request::new(READ | WRITE, b'V', 9);
pub(super) const QUEUE: Request<Buffer> = Request::new(READ | WRITE, b'V', 15);
pub(super) const DEQUEUE: Request<Buffer> = Request::new(READ | WRITE, b'V', 17);
pub(super) const STREAM_ON: Request<i32> = Request::new(WRITE, b'V', 18);
pub(super) const STREAM_OFF: Request<i32> = Request::new(WRITE, b'V', 19);
pub(super) const SET_PARM: Request<StreamParm> = Request::new(READ | WRITE, b'V', 22);
pub(super) const SET_CONTROL: Request<Control> = Request::new(READ | WRITE, b'V', 28);
pub(super) const EXTENSION: Request<ExtensionQuery> = Request::new(READ | WRITE, b'u', 0x21);

/// `v4l2_capability`.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub(super) struct Capability {
    pub(super) driver: [u8; 16],
    pub(super) card: [u8; 32],
    pub(super) bus_info: [u8; 32],
    pub(super) version: u32,
    pub(super) capabilities: u32,
    pub(super) device_caps: u32,
    pub(super) reserved: [u32; 3],
}

/// `v4l2_pix_format`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[repr(C)]
pub(super) struct PixFormat {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) pixelformat: u32,
    pub(super) field: u32,
    pub(super) bytesperline: u32,
    pub(super) sizeimage: u32,
    pub(super) rest: [u32; 6],
}

/// `v4l2_format` for one plane.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub(super) struct Format {
    pub(super) kind: u32,
    pub(super) padding: u32,
    pub(super) pix: PixFormat,
    /// The union is 200 bytes long and holds pointers.
    pub(super) rest: [u64; 19],
}

impl Format {
    pub(super) fn of(pix: PixFormat) -> Self {
        Self {
            kind: VIDEO_CAPTURE,
            pix,
            ..Self::default()
        }
    }
}

/// `v4l2_streamparm` for capture.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub(super) struct StreamParm {
    pub(super) kind: u32,
    pub(super) capability: u32,
    pub(super) capturemode: u32,
    /// Time per frame (s): numerator and denominator.
    pub(super) timeperframe: [u32; 2],
    pub(super) extendedmode: u32,
    pub(super) readbuffers: u32,
    pub(super) reserved: [u32; 4],
    pub(super) rest: [[u32; 20]; 2],
}

/// `v4l2_requestbuffers`.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub(super) struct RequestBuffers {
    pub(super) count: u32,
    pub(super) kind: u32,
    pub(super) memory: u32,
    pub(super) capabilities: u32,
    pub(super) flags: [u8; 4],
}

/// `v4l2_buffer`.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub(super) struct Buffer {
    pub(super) index: u32,
    pub(super) kind: u32,
    pub(super) bytesused: u32,
    pub(super) flags: u32,
    pub(super) field: u32,
    pub(super) padding: u32,
    pub(super) seconds: i64,
    pub(super) microseconds: i64,
    pub(super) timecode: [u32; 4],
    pub(super) sequence: u32,
    pub(super) memory: u32,
    /// Where to map it.
    pub(super) offset: u32,
    pub(super) offset_rest: u32,
    pub(super) length: u32,
    pub(super) reserved: [u32; 3],
}

impl Buffer {
    pub(super) fn numbered(index: u32) -> Self {
        Self {
            index,
            kind: VIDEO_CAPTURE,
            memory: MEMORY_MMAP,
            ..Self::default()
        }
    }

    /// Time stamp (ns).
    pub(super) fn stamp_ns(&self) -> u64 {
        let whole = |number: i64| u64::try_from(number).unwrap_or_default();
        whole(self.seconds) * 1_000_000_000 + whole(self.microseconds) * 1_000
    }
}

/// `v4l2_control`.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub(super) struct Control {
    pub(super) id: u32,
    pub(super) value: i32,
}

/// `uvc_xu_control_query`.
#[derive(Debug)]
#[repr(C)]
pub(super) struct ExtensionQuery {
    pub(super) unit: u8,
    pub(super) selector: u8,
    pub(super) query: u8,
    pub(super) size: u16,
    pub(super) data: *mut u8,
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::offset_of;

    /// The numbers that a C compiler gives for the kernel's headers on x86-64.
    #[test]
    fn numbers_and_places_are_the_kernels() {
        let numbers = [
            QUERY_CAPABILITY.number,
            SET_FORMAT.number,
            REQUEST_BUFFERS.number,
            QUERY_BUFFER.number,
            QUEUE.number,
            DEQUEUE.number,
            STREAM_ON.number,
            STREAM_OFF.number,
            SET_PARM.number,
            SET_CONTROL.number,
            EXTENSION.number,
        ];
        let of_c = [
            0x8068_5600,
            0xc0d0_5605,
            0xc014_5608,
            0xc058_5609,
            0xc058_560f,
            0xc058_5611,
            0x4004_5612,
            0x4004_5613,
            0xc0cc_5616,
            0xc008_561c,
            0xc010_7521,
        ];
        assert_eq!(numbers, of_c);
        assert_eq!(YUYV, 0x5659_5559);
        assert_eq!(offset_of!(Format, pix), 8);
        assert_eq!(offset_of!(StreamParm, timeperframe), 12);
        let buffer = [
            offset_of!(Buffer, seconds),
            offset_of!(Buffer, sequence),
            offset_of!(Buffer, memory),
            offset_of!(Buffer, offset),
            offset_of!(Buffer, length),
        ];
        assert_eq!(buffer, [0x18, 0x38, 0x3c, 0x40, 0x48]);
        assert_eq!(offset_of!(ExtensionQuery, size), 4);
        assert_eq!(offset_of!(ExtensionQuery, data), 8);
    }
}
