//! A camera in memory, with a driver that misbehaves on demand.

use std::cell::RefCell;
use std::collections::{HashMap, VecDeque};
use std::io;
use std::path::Path;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use shared_types::ipc::{Bus, DomainSweep};

use super::abi;
use super::device::{Device, Identity};
use super::publish::publish;
use super::setup::cannot_open;
use super::{LiveCamera, LiveError, LiveSettings, Losses, record};
use crate::calib::VideoMode;
use crate::frame::StereoFrame;
use crate::source::open_video;

const PATIENCE: Duration = Duration::from_millis(20);
/// Whole microseconds, as the kernel counts.
const FRAME_NS: u64 = 16_667_000;

/// A driver's change of what is asked.
type Grant = fn(&mut abi::PixFormat);

/// The driver's side.
#[derive(Debug)]
struct Driver {
    capabilities: u32,
    /// Changes what is granted.
    grant: Grant,
    granted_rate: Option<[u32; 2]>,
    granted_buffers: u32,
    refuse: Option<(&'static str, i32)>,
    clock: u32,
    memory: Vec<Vec<u8>>,
    queued: VecDeque<u32>,
    filled: VecDeque<abi::Buffer>,
    sequence: u32,
    stamp_ns: u64,
    gone: bool,
    /// A picture whenever somebody waits for one.
    runs: bool,
    streams: bool,
    /// Length of the extension unit's packets, its registers by bus and address, and
    /// the packet that is answered next.
    unit_bytes: Option<u16>,
    registers: HashMap<(u8, u32), u8>,
    stuck: bool,
    requested: Vec<u8>,
}

impl Default for Driver {
    fn default() -> Self {
        Self {
            capabilities: abi::CAN_CAPTURE | abi::CAN_STREAM,
            grant: |_| {},
            granted_rate: Some([1, 60]),
            granted_buffers: 6,
            refuse: None,
            clock: abi::CLOCK_MONOTONIC,
            memory: Vec::new(),
            queued: VecDeque::new(),
            filled: VecDeque::new(),
            sequence: 0,
            stamp_ns: 1_000_000_000,
            gone: false,
            runs: false,
            streams: false,
            unit_bytes: Some(384),
            registers: HashMap::new(),
            stuck: false,
            requested: Vec::new(),
        }
    }
}

impl Driver {
    /// Takes a picture: into the next free buffer, or lost.
    fn shoot(&mut self) -> Option<&mut abi::Buffer> {
        self.sequence = self.sequence.wrapping_add(1);
        self.stamp_ns += FRAME_NS;
        let index = self.queued.pop_front()?;
        let [low, ..] = self.sequence.to_le_bytes();
        let bytes = &mut self.memory[index as usize];
        bytes.fill(low);
        self.filled.push_back(abi::Buffer {
            index,
            bytesused: u32::try_from(bytes.len()).unwrap(),
            flags: self.clock,
            microseconds: i64::try_from(self.stamp_ns / 1000).unwrap(),
            sequence: self.sequence,
            ..abi::Buffer::default()
        });
        self.filled.back_mut()
    }

    fn shoot_many(&mut self, count: usize) {
        for _ in 0..count {
            self.shoot();
        }
    }

    fn refused(&self, what: &str) -> io::Result<()> {
        match self.refuse {
            Some((call, code)) if call == what => Err(io::Error::from_raw_os_error(code)),
            _ => Ok(()),
        }
    }

    /// As the vendor's library talks to it.
    fn unit(&mut self, query: u8, data: &mut [u8]) -> io::Result<()> {
        let Some(bytes) = self.unit_bytes else {
            return Err(io::Error::from_raw_os_error(libc::ENOENT));
        };
        if query == abi::GET_LENGTH {
            data.copy_from_slice(&bytes.to_le_bytes());
            return Ok(());
        }
        assert_eq!(data.len(), usize::from(bytes));
        if query == abi::GET_CURRENT {
            let (_, place) = Self::place(&self.requested);
            data[17] = self.registers.get(&place).copied().unwrap_or(0xff);
            return Ok(());
        }
        self.requested = data.to_vec();
        let (set, place) = Self::place(data);
        if set && !self.stuck {
            self.registers.insert(place, data[16]);
        }
        Ok(())
    }

    fn place(packet: &[u8]) -> (bool, (u8, u32)) {
        let address = u32::from_be_bytes([packet[5], packet[6], packet[7], packet[8]]);
        let head = if packet[1] == 0xa2 {
            [0, 4, 1, 0, 1, 0, 1]
        } else {
            [0x6c, 2, 1, 0x90, 1, 0, 1]
        };
        assert_eq!([&packet[2..5], &packet[9..13]].concat(), head);
        (packet[0] == 0x50, (packet[1], address))
    }
}

/// The camera's end of it.
#[derive(Debug, Default)]
struct Fake {
    driver: Rc<RefCell<Driver>>,
    /// What lay in the buffer that was taken last.
    taken: Vec<u8>,
}

impl Device for Fake {
    fn identity(&mut self) -> io::Result<Identity> {
        let driver = self.driver.borrow();
        driver.refused("identity")?;
        Ok(Identity {
            driver: "fakevideo".to_owned(),
            card: "Fake ZED".to_owned(),
            capabilities: driver.capabilities,
        })
    }

    fn set_format(&mut self, format: abi::PixFormat) -> io::Result<abi::PixFormat> {
        let mut driver = self.driver.borrow_mut();
        driver.refused("format")?;
        let mut granted = abi::PixFormat {
            bytesperline: 2 * format.width,
            sizeimage: 2 * format.width * format.height,
            ..format
        };
        (driver.grant)(&mut granted);
        driver.memory = vec![vec![0; granted.sizeimage as usize]; driver.granted_buffers as usize];
        Ok(granted)
    }

    fn set_rate(&mut self, _timeperframe: [u32; 2]) -> io::Result<Option<[u32; 2]>> {
        Ok(self.driver.borrow().granted_rate)
    }

    fn map_buffers(&mut self, _count: u32) -> io::Result<u32> {
        self.driver.borrow().refused("buffers")?;
        Ok(self.driver.borrow().granted_buffers)
    }

    fn queue(&mut self, index: u32) -> io::Result<()> {
        let mut driver = self.driver.borrow_mut();
        assert!(!driver.queued.contains(&index), "queued twice");
        driver.queued.push_back(index);
        Ok(())
    }

    fn dequeue(&mut self) -> io::Result<abi::Buffer> {
        let mut driver = self.driver.borrow_mut();
        match driver.filled.pop_front() {
            Some(filled) => {
                self.taken.clone_from(&driver.memory[filled.index as usize]);
                Ok(filled)
            }
            None if driver.gone => Err(io::Error::from_raw_os_error(libc::ENODEV)),
            None => Err(io::ErrorKind::WouldBlock.into()),
        }
    }

    fn bytes(&self, _index: u32) -> &[u8] {
        &self.taken
    }

    fn stream(&mut self, on: bool) -> io::Result<()> {
        self.driver.borrow().refused("stream")?;
        self.driver.borrow_mut().streams = on;
        Ok(())
    }

    fn wait(&self, timeout: Duration) -> io::Result<bool> {
        if self.driver.borrow().runs {
            std::thread::sleep(Duration::from_millis(1));
            self.driver.borrow_mut().shoot();
            return Ok(true);
        }
        std::thread::sleep(timeout);
        Ok(false)
    }

    fn set_control(&mut self, _id: u32, value: i32) -> io::Result<i32> {
        Ok(value.min(8))
    }

    fn extension(&mut self, place: [u8; 2], query: u8, data: &mut [u8]) -> io::Result<()> {
        assert_eq!(place, [4, 2]);
        self.driver.borrow_mut().unit(query, data)
    }
}

fn settings() -> LiveSettings {
    LiveSettings {
        device: "/dev/video7".into(),
        mode: VideoMode::Vga,
        rate_hz: 60,
        gain: None,
        exposure_raw: None,
        sensor_gain_raw: None,
    }
}

/// A camera whose driver was changed beforehand, and the way to its driver.
fn camera(
    settings: LiveSettings,
    change: impl FnOnce(&mut Driver),
) -> (Result<LiveCamera, LiveError>, Rc<RefCell<Driver>>) {
    let fake = Fake::default();
    change(&mut fake.driver.borrow_mut());
    let driver = Rc::clone(&fake.driver);
    (LiveCamera::start(settings, Box::new(fake)), driver)
}

fn running(change: impl FnOnce(&mut Driver)) -> (LiveCamera, Rc<RefCell<Driver>>) {
    let (camera, driver) = camera(settings(), change);
    (camera.unwrap(), driver)
}

/// The error's message has all these words.
#[track_caller]
fn says(error: impl ToString, words: &[&str]) {
    let message = error.to_string();
    for word in words {
        assert!(message.contains(word), "no `{word}` in: {message}");
    }
}

/// The camera does not start, and says so in these words.
#[track_caller]
fn refused(settings: LiveSettings, change: impl FnOnce(&mut Driver), words: &[&str]) {
    says(camera(settings, change).0.unwrap_err(), words);
}

#[test]
fn frames_come_with_their_stamps_and_buffers_go_round() {
    let (mut camera, driver) = running(|_| {});
    assert!(driver.borrow().streams);
    for sequence in 1..=20 {
        driver.borrow_mut().shoot();
        let stamp_ns = driver.borrow().stamp_ns;
        let frame = camera.next(PATIENCE).unwrap();
        assert_eq!((frame.sequence, frame.stamp_ns), (sequence, stamp_ns));
        assert_eq!(frame.bytes.len(), 1344 * 376 * 2);
        assert!(frame.bytes.iter().all(|b| u64::from(*b) == sequence));
    }
    assert_eq!(camera.losses(), Losses::default());
    // One is held, the others are the driver's.
    assert_eq!(driver.borrow().queued.len(), 5);
}

#[test]
fn bad_frames_are_counted_and_never_given() {
    let (mut camera, driver) = running(|d| d.sequence = u32::MAX - 3);
    {
        let mut driver = driver.borrow_mut();
        driver.shoot();
        driver.shoot().unwrap().flags |= abi::FLAG_ERROR;
        driver.shoot().unwrap().bytesused -= 512;
        // The count wraps here, with two frames lost.
        driver.sequence = driver.sequence.wrapping_add(2);
        driver.shoot();
        driver.shoot().unwrap().microseconds = 5;
        driver.shoot();
    }
    let first = u64::from(u32::MAX) - 2;
    for sequence in [first, first + 5, first + 7] {
        assert_eq!(camera.next(PATIENCE).unwrap().sequence, sequence);
    }
    let losses = Losses {
        missed: 2,
        damaged: 1,
        short: 1,
        unordered: 1,
    };
    assert_eq!((camera.losses(), camera.frames()), (losses, 3));
    // A count that runs backwards is no gap of four thousand million frames.
    driver.borrow_mut().sequence -= 2;
    driver.borrow_mut().shoot();
    driver.borrow_mut().shoot_many(2);
    assert_eq!(camera.next(PATIENCE).unwrap().sequence, first + 8);
    assert_eq!(camera.losses().missed, 2);
}

#[test]
fn a_slow_reader_loses_frames_and_never_slows_the_camera() {
    let (mut camera, driver) = running(|_| {});
    driver.borrow_mut().shoot();
    camera.next(PATIENCE).unwrap();
    // While the reader sleeps, five buffers are filled and 25 pictures go nowhere.
    driver.borrow_mut().shoot_many(30);
    for sequence in 2..=6 {
        assert_eq!(camera.next(PATIENCE).unwrap().sequence, sequence);
    }
    driver.borrow_mut().shoot();
    assert_eq!(camera.next(PATIENCE).unwrap().sequence, 32);
    assert_eq!(camera.losses().missed, 25);
}

#[test]
fn unplugging_and_silence_are_told_apart() {
    let (mut camera, driver) = running(|_| {});
    driver.borrow_mut().shoot_many(2);
    driver.borrow_mut().gone = true;
    camera.next(PATIENCE).unwrap();
    camera.next(PATIENCE).unwrap();
    let gone = camera.next(PATIENCE).unwrap_err();
    says(gone, &["/dev/video7 was unplugged after 2 frames"]);
    let (mut camera, driver) = running(|_| {});
    driver.borrow_mut().shoot().unwrap().flags |= abi::FLAG_ERROR;
    let silent = camera.next(PATIENCE).unwrap_err();
    says(silent, &["/dev/video7: no good frame", "1 damaged"]);
}

#[test]
fn what_the_driver_grants_is_checked() {
    let grants: [(Grant, &str); 4] = [
        (|p| p.width = 672, "672x376 YUYV"),
        (|p| p.pixelformat = u32::from_le_bytes(*b"MJPG"), "MJPG"),
        (|p| p.bytesperline += 64, "rows of 2752 bytes"),
        (|p| p.sizeimage = 1000, "1344x376"),
    ];
    let requested = "1344x376 YUYV in rows of 2688 bytes requested";
    for (grant, said) in grants {
        refused(settings(), |d| d.grant = grant, &[said, requested]);
    }
    for (rate, said) in [
        (Some([1, 30]), "60 requested, 30/1 granted"),
        (Some([0, 0]), "0/0 granted"),
        (None, "cannot be chosen granted"),
    ] {
        refused(settings(), |d| d.granted_rate = rate, &[said]);
    }
    // 166666 of ten million parts is 60 a second, as near as that goes.
    camera(settings(), |d| d.granted_rate = Some([166_666, 10_000_000]))
        .0
        .unwrap();
    let few = "buffers: 6 requested, 2 granted";
    refused(settings(), |d| d.granted_buffers = 2, &[few]);
}

#[test]
fn what_is_no_camera_says_so() {
    let metadata = "`Fake ZED` (driver fakevideo) does not capture";
    refused(settings(), |d| d.capabilities = 0x00a0_0000, &[metadata]);
    for (call, code, said) in [
        ("identity", libc::ENOTTY, "not a video device"),
        ("format", libc::EBUSY, "another program uses it"),
        ("buffers", libc::EBUSY, "another program uses it"),
        ("stream", libc::ENOSPC, "starting the stream failed"),
        ("stream", libc::ENODEV, "unplugged after 0 frames"),
    ] {
        let refuse = |d: &mut Driver| d.refuse = Some((call, code));
        refused(settings(), refuse, &[said, "/dev/video7"]);
    }
    let (mut camera, driver) = running(|d| d.clock = 0x4000);
    driver.borrow_mut().shoot();
    says(camera.next(PATIENCE).unwrap_err(), &["CLOCK_MONOTONIC"]);
}

#[test]
fn a_device_of_this_machine_is_opened_or_named() {
    for (device, said) in [
        ("/dev/no-such-camera", "there is no such device"),
        ("/dev/null", "it is not a video device"),
    ] {
        let settings = LiveSettings {
            device: device.into(),
            ..settings()
        };
        let error = LiveCamera::open(settings).unwrap_err();
        says(error, &[&format!("{device}: {said}")]);
    }
    let denied = io::ErrorKind::PermissionDenied.into();
    let denied = cannot_open(Path::new("/dev/video7"), &denied);
    says(denied, &["group `video`"]);
}

#[test]
fn exposure_is_set_in_both_eyes_and_read_back() {
    let fixed = LiveSettings {
        exposure_raw: Some(0x2b7),
        sensor_gain_raw: Some(0x1ab),
        ..settings()
    };
    for bytes in [64, 384] {
        let (camera, driver) = camera(fixed.clone(), |d| {
            d.unit_bytes = Some(bytes);
            d.registers.insert((0xa2, 0x8018_1033), 0b0111);
            d.registers.insert((0xa2, 0x8018_1833), 0b1010);
        });
        camera.unwrap();
        let driver = driver.borrow();
        // Nothing but the automatic exposure's bit is changed.
        assert_eq!(driver.registers[&(0xa2, 0x8018_1033)], 0b0101);
        assert_eq!(driver.registers[&(0xa2, 0x8018_1833)], 0b1000);
        for bus in [0xa3, 0xa5] {
            let read = |address| driver.registers[&(bus, address)];
            assert_eq!([0x3500, 0x3501, 0x3502].map(read), [0x00, 0x2b, 0x70]);
            assert_eq!([0x3507, 0x3508, 0x3509].map(read), [0x00, 0x01, 0xab]);
        }
    }
    let remedy = "leave out exposure_raw";
    refused(fixed.clone(), |d| d.unit_bytes = None, &[remedy]);
    refused(fixed.clone(), |d| d.unit_bytes = Some(12), &["not a ZED's"]);
    let stuck = "register 0x3500 reads 0xff";
    refused(fixed, |d| d.stuck = true, &[stuck]);
}

#[test]
fn settings_out_of_range_are_named() {
    type Change = fn(&mut LiveSettings);
    let cases: [(Change, &str); 5] = [
        (
            |s| s.exposure_raw = Some(881),
            "exposure_raw is 881, at 60 frames per second it must be 2 to 880",
        ),
        (
            |s| (s.exposure_raw, s.sensor_gain_raw) = (Some(100), Some(300)),
            "sensor_gain_raw is 300",
        ),
        (|s| s.sensor_gain_raw = Some(3), "needs exposure_raw"),
        (|s| s.rate_hz = 0, "rate_hz is 0"),
        (|s| s.gain = Some(9), "gain: 9 requested, 8 granted"),
    ];
    for (change, said) in cases {
        let mut settings = settings();
        change(&mut settings);
        refused(settings, |_| {}, &[said]);
    }
}

#[test]
fn a_recording_reads_back_as_it_was_seen() {
    let dir = tempfile::tempdir().unwrap();
    let name = dir.path().join("wiggle");
    let (mut camera, driver) = running(|_| {});
    driver.borrow_mut().shoot_many(2);
    driver.borrow_mut().shoot().unwrap().flags |= abi::FLAG_ERROR;
    driver.borrow_mut().shoot();
    let stop = AtomicBool::new(false);
    let mut seen = Vec::new();
    let made = record(&mut camera, 3, &name, &stop, |n| seen.push(n)).unwrap();
    assert_eq!((made.frames, made.losses.damaged), (3, 1));
    assert_eq!(seen, [1, 2, 3]);
    let mut film = open_video(&made.film, None).unwrap();
    assert_eq!(film.len(), 3);
    let third = film.read(2).unwrap();
    let bytes = vec![4; 1344 * 376 * 2];
    let stamp_ns = driver.borrow().stamp_ns;
    assert_eq!(
        third,
        StereoFrame::from_yuyv(&bytes, [1344, 376], stamp_ns, 4).unwrap()
    );
    // What does not end well leaves nothing behind.
    let other = dir.path().join("other");
    driver.borrow_mut().shoot_many(2);
    driver.borrow_mut().gone = true;
    let mut failure = || record(&mut camera, 3, &other, &stop, |_| {}).unwrap_err();
    says(failure(), &["was unplugged after"]);
    stop.store(true, Ordering::Relaxed);
    says(failure(), &["stopped after 0 frames"]);
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
}

/// Requests a stop when it is dropped, even in a panic.
struct StopOnDrop<'a>(&'a AtomicBool);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[test]
fn frames_are_published_until_told_to_stop() {
    let domain = format!("live-test-{}", std::process::id());
    let _sweep = DomainSweep::new(&domain);
    let stop = AtomicBool::new(false);
    let (ready, wait_ready) = std::sync::mpsc::channel();
    std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            let bus = Bus::join(&domain).unwrap();
            let frames = bus.frame_subscriber().unwrap();
            ready.send(()).unwrap();
            let _stop = StopOnDrop(&stop);
            let (mut seen, began) = (Vec::new(), Instant::now());
            while seen.len() < 3 && began.elapsed() < Duration::from_secs(10) {
                let Some(sample) = frames.receive().unwrap() else {
                    std::thread::sleep(Duration::from_millis(1));
                    continue;
                };
                let header = *sample.user_header();
                assert_eq!((header.width_px, header.height_px), (1344, 376));
                let [low, ..] = header.sequence.to_le_bytes();
                assert!(sample.payload().iter().all(|b| *b == low));
                seen.push((header.sequence, header.stamp_ns));
            }
            seen
        });
        wait_ready.recv().unwrap();
        let (camera, _driver) = running(|d| d.runs = true);
        publish(camera, &domain, &stop).unwrap();
        let seen = reader.join().unwrap();
        assert_eq!(seen.len(), 3);
        assert!(seen.is_sorted_by(|a, b| a.0 < b.0 && a.1 < b.1), "{seen:?}");
    });
}
