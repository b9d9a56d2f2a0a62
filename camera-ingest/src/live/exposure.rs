//! Exposure and sensor gain of ZED cameras: not ordinary controls, but registers of
//! each image's sensor behind the vendor's extension unit.
//!
//! Facts: the vendor's open capture library. A command is a packet of 384 bytes
//! (USB 3) or 64 (USB 2): what to do, which bus, address, value; an answer has its
//! value at byte 17. The registers take raw numbers, whose unit the vendor does not
//! document, so the exposure in seconds stays unknown.

use std::time::Duration;

use super::abi::{GET_CURRENT, GET_LENGTH, SET_CURRENT};
use super::device::Device;

/// Unit and selector.
const VENDOR_UNIT: [u8; 2] = [4, 2];
/// Packets on USB 2 and USB 3.
const PACKET_BYTES: [usize; 2] = [64, 384];
/// The unit needs this long to act.
const PAUSE: Duration = Duration::from_micros(300);
const TASK_SET: u8 = 0x50;
const TASK_GET: u8 = 0x51;
/// Bus of the image processor.
const SYSTEM: u8 = 0xa2;
/// Buses of the left and right sensor.
const SENSORS: [u8; 2] = [0xa3, 0xa5];
/// Image processor's control of each image, and its bit for automatic exposure.
const CONTROL: [u32; 2] = [0x8018_1033, 0x8018_1833];
const AUTOMATIC: u8 = 0x02;
/// Exposure: bits 19..12, 11..4 and 3..0 of the raw number, the last ones on top.
const EXPOSURE: [u32; 3] = [0x3500, 0x3501, 0x3502];
/// Gain: bits 23..16, 15..8 and 7..0.
const GAIN: [u32; 3] = [0x3507, 0x3508, 0x3509];
/// Least raw exposure.
const MIN_EXPOSURE: u32 = 2;
/// Raw gains that the sensor accepts.
const GAINS: [[u32; 2]; 4] = [[0, 255], [378, 511], [890, 1023], [1914, 2047]];

/// What the sensors are to be set to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sensor {
    pub(super) exposure_raw: u32,
    /// `None` leaves it.
    pub(super) gain_raw: Option<u32>,
}

/// Largest raw exposure at a frame rate.
fn max_exposure(rate_hz: u32) -> u32 {
    match rate_hz {
        ..=15 => 1550,
        16..=30 => 1100,
        31..=60 => 880,
        _ => 720,
    }
}

impl Sensor {
    /// What is out of range, in words.
    pub(super) fn check(self, rate_hz: u32) -> Result<(), String> {
        let max = max_exposure(rate_hz);
        if !(MIN_EXPOSURE..=max).contains(&self.exposure_raw) {
            return Err(format!(
                "exposure_raw is {}, at {rate_hz} frames per second it must be {MIN_EXPOSURE} to \
                 {max}",
                self.exposure_raw
            ));
        }
        match self.gain_raw {
            Some(gain) if !GAINS.iter().any(|[a, b]| (*a..=*b).contains(&gain)) => Err(format!(
                "sensor_gain_raw is {gain}, it must lie in one of {GAINS:?}"
            )),
            _ => Ok(()),
        }
    }

    /// Ends automatic exposure, sets both images, and reads back whether they took it; else
    /// what stands against it.
    pub(super) fn apply(self, device: &mut dyn Device) -> Result<(), String> {
        let mut unit = Unit::find(device)?;
        let e = self.exposure_raw;
        let exposure = [e >> 12, e >> 4, e << 4].map(|b| b.to_le_bytes()[0]);
        for image in 0..2 {
            let control = unit.get(SYSTEM, CONTROL[image])?;
            unit.set(SYSTEM, CONTROL[image], control & !AUTOMATIC)?;
            unit.set_checked(SENSORS[image], EXPOSURE, exposure)?;
            if let Some(g) = self.gain_raw {
                let gain = [g >> 16, g >> 8, g].map(|b| b.to_le_bytes()[0]);
                unit.set_checked(SENSORS[image], GAIN, gain)?;
            }
        }
        Ok(())
    }
}

/// The extension unit with its packets' length.
struct Unit<'a> {
    device: &'a mut dyn Device,
    bytes: usize,
}

impl<'a> Unit<'a> {
    fn find(device: &'a mut dyn Device) -> Result<Self, String> {
        let mut length = [0; 2];
        let mut unit = Self { device, bytes: 0 };
        unit.query(GET_LENGTH, &mut length)?;
        unit.bytes = usize::from(u16::from_le_bytes(length));
        if !PACKET_BYTES.contains(&unit.bytes) {
            let reason = format!(
                "its packets have {} bytes, those of a ZED 64 or 384",
                unit.bytes
            );
            return Err(foreign(&reason));
        }
        Ok(unit)
    }

    fn query(&mut self, query: u8, data: &mut [u8]) -> Result<(), String> {
        let answered = self.device.extension(VENDOR_UNIT, query, data);
        answered.map_err(|e| {
            format!(
                "the vendor's extension unit does not answer ({e}); leave out exposure_raw, or use a ZED"
            )
        })
    }

    fn packet(&self, task: u8, bus: u8, address: u32, value: u8) -> Vec<u8> {
        let mut packet = vec![0; self.bytes];
        packet[0] = task;
        packet[1] = bus;
        // Address of the chip on the bus, widths of address and data (bytes), and
        // how many: for a sensor with the marks of its kind of bus.
        let (chip, address_bytes, mark) = if bus == SYSTEM {
            (0x00, 4, 0x00)
        } else {
            (0x6c, 2, 0x90)
        };
        packet[2..5].copy_from_slice(&[chip, address_bytes, 1]);
        packet[5..9].copy_from_slice(&address.to_be_bytes());
        packet[9..13].copy_from_slice(&[mark, 1, 0, 1]);
        packet[16] = value;
        packet
    }

    fn set(&mut self, bus: u8, address: u32, value: u8) -> Result<(), String> {
        let mut packet = self.packet(TASK_SET, bus, address, value);
        self.query(SET_CURRENT, &mut packet)?;
        std::thread::sleep(PAUSE);
        Ok(())
    }

    fn get(&mut self, bus: u8, address: u32) -> Result<u8, String> {
        let mut packet = self.packet(TASK_GET, bus, address, 0);
        self.query(SET_CURRENT, &mut packet)?;
        std::thread::sleep(PAUSE);
        self.query(GET_CURRENT, &mut packet)?;
        Ok(packet[17])
    }

    fn set_checked(&mut self, bus: u8, addresses: [u32; 3], values: [u8; 3]) -> Result<(), String> {
        for (address, value) in addresses.into_iter().zip(values) {
            self.set(bus, address, value)?;
        }
        for (address, value) in addresses.into_iter().zip(values) {
            let found = self.get(bus, address)?;
            if found != value {
                return Err(foreign(&format!(
                    "register {address:#06x} reads {found:#04x} after {value:#04x} was written"
                )));
            }
        }
        Ok(())
    }
}

/// That the unit answers, but not as a ZED does.
fn foreign(reason: &str) -> String {
    format!("its extension unit is not a ZED's: {reason}; leave out exposure_raw")
}
