//! The camera's left eye as JPEGs, at no more than 15 a second, and the keypoints over
//! those frames they were found in.
//!
//! Keypoints come after the film they belong to. The JPEGs of the last seconds are kept
//! for them, so that the tracked film can be shown once, in its own pace, before the
//! live picture goes on.
//!
//! Where a preview follows the rope as the frames come, the live picture is shown one
//! picture later, with the keypoints that were found in it meanwhile.

use super::picture::{Jpeg, encode, projected};
use super::received::Received;
use serde::Serialize;
use shared_types::StereoCamera;
use shared_types::ipc::{Bus, FrameSubscriber, KeypointSubscriber, PIXEL_FORMAT_YUYV};
use shared_types::keypoints::KeypointFrame;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Least time between two pictures.
const PERIOD: Duration = Duration::from_micros(66_700);
/// Most bytes of JPEGs kept for keypoints to come.
const KEPT_MAX_BYTES: usize = 12_000_000;
/// A keypoint frame belongs to a JPEG whose stamp is as near as this (ns).
const SAME_FRAME_NS: u64 = 1_000_000;
/// A picture that waited longer for its keypoints is not shown any more (ns).
const OLD_NS: u64 = 500_000_000;

#[derive(Debug, Default)]
pub(crate) struct Picture {
    /// The left eye.
    pub jpeg: Arc<[u8]>,
    /// What is drawn over it, as JSON on one line.
    pub over: String,
}

/// What is drawn over a picture.
#[derive(Debug, Serialize)]
struct Over {
    caption: String,
    /// Pixels of the camera for one of the picture.
    scale: usize,
    /// Keypoints found in it, raw pixels of the camera.
    keypoints: Vec<[f32; 2]>,
    /// Whether the rope was lost in this frame.
    lost: bool,
    /// The simulated rope as the camera would see it, raw pixels of the camera.
    rope: Vec<[i32; 2]>,
}

/// A live picture, and the simulated rope as the camera would see it at that time.
#[derive(Debug, Clone)]
struct Live {
    picture: Jpeg,
    rope: Vec<[i32; 2]>,
}

/// The camera of a domain.
#[derive(Debug)]
pub(crate) struct Film {
    frames: FrameSubscriber,
    keypoints: KeypointSubscriber,
    kept: VecDeque<Jpeg>,
    kept_bytes: usize,
    /// Tracked frames still to be shown.
    tracked: VecDeque<KeypointFrame>,
    pub preview: Received,
    /// The picture that waits for its keypoints.
    waits: Option<Live>,
    /// A preview is wished for, but there is no calibration for it.
    pub lacks_calibration: bool,
    last: Option<Instant>,
    /// When the last frame came.
    pub seen: Option<Instant>,
}

impl Film {
    pub(crate) fn open(bus: &Bus) -> anyhow::Result<Self> {
        Ok(Self {
            frames: bus.frame_subscriber()?,
            keypoints: bus.keypoint_subscriber()?,
            kept: VecDeque::new(),
            kept_bytes: 0,
            tracked: VecDeque::new(),
            preview: Received::open(bus)?,
            waits: None,
            lacks_calibration: false,
            last: None,
            seen: None,
        })
    }

    /// Takes in what has come. Makes the next picture if it is `wanted` and time for
    /// one; `rope` is drawn over a live picture where the camera's place is known.
    pub(crate) fn turn(
        &mut self,
        wanted: bool,
        camera: Option<&StereoCamera>,
        rope: &[nalgebra::Vector3<f64>],
    ) -> anyhow::Result<Option<Picture>> {
        while let Some(found) = self.keypoints.receive()? {
            if self.at(found.stamp_ns).is_some() {
                self.tracked.push_back(*found);
            }
        }
        self.preview.listen()?;
        // Only the newest frame is looked at; the others go back to the camera at once.
        let mut newest = None;
        while let Some(frame) = self.frames.receive()? {
            newest = Some(frame);
        }
        if newest.is_some() {
            self.seen = Some(Instant::now());
        }
        let due = self.last.is_none_or(|at| at.elapsed() >= PERIOD);
        let Some(frame) = newest.filter(|_| wanted && due) else {
            return Ok(None);
        };
        self.last = Some(Instant::now());
        let head = *frame.user_header();
        if head.pixel_format != PIXEL_FORMAT_YUYV {
            return Ok(None);
        }
        let live = Live {
            picture: encode(frame.payload(), head)?,
            rope: camera.map_or_else(Vec::new, |camera| projected(camera, rope)),
        };
        drop(frame);
        self.keep(live.picture.clone());
        let tracked = self.next_tracked();
        // One that nobody asked for in time is old.
        let waited = self.waits.replace(live.clone());
        let waited = waited.filter(|l| head.stamp_ns.abs_diff(l.picture.stamp_ns) < OLD_NS);
        let shown = match tracked {
            Some(tracked) => Some(tracked),
            None if self.preview.is_there() => waited.map(|l| self.show(l)).transpose()?,
            None => Some(self.show(live)?),
        };
        Ok(shown)
    }

    /// A live picture with everything that is known to be in it.
    fn show(&self, Live { picture, rope }: Live) -> anyhow::Result<Picture> {
        let mut caption = "camera, live".to_owned();
        if !rope.is_empty() {
            caption += "; dots: the identified rope, simulated";
        }
        let found = self.preview.words();
        let lacks = self.lacks_calibration.then(|| {
            "no preview: there is no camera.toml in the run folder, name one with --camera"
                .to_owned()
        });
        if let Some(words) = found.or(lacks) {
            caption += "; ";
            caption += &words;
        }
        let found = self.preview.near(picture.stamp_ns);
        let over = Over {
            caption,
            scale: picture.scale,
            keypoints: found.map_or_else(Vec::new, |f| f.rope.points().to_vec()),
            lost: found.is_some_and(|f| f.rope.is_lost()),
            rope,
        };
        Ok(Picture {
            jpeg: picture.bytes,
            over: serde_json::to_string(&over)?,
        })
    }

    fn at(&self, stamp_ns: u64) -> Option<&Jpeg> {
        self.kept
            .iter()
            .find(|kept| kept.stamp_ns.abs_diff(stamp_ns) <= SAME_FRAME_NS)
    }

    /// The next frame of the tracked film with its keypoints.
    fn next_tracked(&mut self) -> Option<Picture> {
        while let Some(frame) = self.tracked.pop_front() {
            if let Some(kept) = self.at(frame.stamp_ns) {
                let over = Over {
                    caption: "the wiggle as filmed, with the keypoints found in it".to_owned(),
                    scale: kept.scale,
                    keypoints: frame.points().to_vec(),
                    lost: frame.is_lost(),
                    rope: Vec::new(),
                };
                return Some(Picture {
                    jpeg: Arc::clone(&kept.bytes),
                    over: serde_json::to_string(&over).ok()?,
                });
            }
        }
        None
    }

    fn keep(&mut self, picture: Jpeg) {
        self.kept_bytes += picture.bytes.len();
        self.kept.push_back(picture);
        while self.kept_bytes > KEPT_MAX_BYTES
            && let Some(oldest) = self.kept.pop_front()
        {
            self.kept_bytes -= oldest.bytes.len();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::ipc::{DomainSweep, FrameHeader, FramePublisher, PreviewFrame, PreviewState};

    /// A camera, and the film of it. Fields are dropped in order.
    struct Stage {
        film: Film,
        camera: FramePublisher,
        bus: Bus,
        _sweep: DomainSweep,
    }

    impl Stage {
        fn new(name: &str) -> Self {
            let domain = format!("test_{name}_{}", std::process::id());
            let sweep = DomainSweep::new(&domain);
            let bus = Bus::join(&domain).unwrap();
            Self {
                film: Film::open(&bus).unwrap(),
                camera: bus.frame_publisher(1 << 16).unwrap(),
                bus,
                _sweep: sweep,
            }
        }

        /// What is made of one more frame, 20 ms times its number after the first.
        fn turn(&mut self, number: u64, wanted: bool) -> Option<Picture> {
            let mut sample = self.camera.loan_slice_uninit(64 * 16 * 2).unwrap();
            *sample.user_header_mut() = FrameHeader {
                pixel_format: PIXEL_FORMAT_YUYV,
                sequence: number,
                stamp_ns: number * 20_000_000,
                width_px: 64,
                height_px: 16,
                ..FrameHeader::default()
            };
            let sample = sample.write_from_slice(&[128; 64 * 16 * 2]);
            sample.send().unwrap();
            self.film.turn(wanted, None, &[]).unwrap()
        }

        /// The same, when it is time for a picture.
        fn due(&mut self, number: u64) -> Option<Picture> {
            std::thread::sleep(PERIOD);
            self.turn(number, true)
        }
    }

    #[test]
    fn pictures_are_live_until_keypoints_of_a_kept_frame_come() {
        let mut stage = Stage::new("film");
        let tracker = stage.bus.keypoint_publisher().unwrap();
        assert!(stage.turn(1, false).is_none(), "nobody looks");
        let live = stage.turn(2, true).unwrap();
        assert!(live.over.contains("live") && live.jpeg.starts_with(&[0xff, 0xd8]));
        assert!(stage.turn(3, true).is_none(), "too soon");
        // Of a frame that was shown, and of one that was not.
        for stamp_ns in [40_000_000, 1] {
            let mut found = KeypointFrame {
                stamp_ns,
                count: 2,
                ..KeypointFrame::default()
            };
            found.points_px[1] = [7.0, 9.0];
            tracker.send_copy(found).unwrap();
        }
        let tracked = stage.due(4).unwrap();
        let over = tracked.over;
        assert!(over.contains("[[0.0,0.0],[7.0,9.0]]"), "{over}");
        assert_eq!(tracked.jpeg, live.jpeg);
        assert!(stage.due(5).unwrap().over.contains("live"));
    }

    #[test]
    fn with_a_preview_each_picture_waits_for_its_own_keypoints() {
        let mut stage = Stage::new("film_preview");
        let preview = stage.bus.preview_publisher().unwrap();
        let mut turn = |number: u64, found: Option<f32>| {
            let picture = stage.due(number);
            if let Some(u) = found {
                let mut reported = PreviewFrame {
                    state: PreviewState::Following as u8,
                    ..PreviewFrame::default()
                };
                reported.rope.count = 1;
                reported.rope.stamp_ns = number * 20_000_000;
                reported.rope.points_px[0][0] = u;
                preview.send_copy(reported).unwrap();
            }
            picture.map_or_else(String::new, |picture| picture.over)
        };
        let none = "\"keypoints\":[]";
        assert!(turn(1, Some(11.0)).contains(none), "no preview");
        // Every tenth frame, so that those beside it are far.
        let first_with = turn(11, Some(12.0));
        assert!(first_with.contains("[[11.0,0.0]]"), "{first_with}");
        assert!(first_with.contains("the preview's keypoints"));
        assert!(turn(21, None).contains("[[12.0,0.0]]"));
        assert!(turn(31, None).contains(none), "it skipped one");
    }

    #[test]
    fn what_is_kept_is_bounded() {
        let mut stage = Stage::new("kept");
        let film = &mut stage.film;
        for stamp_ns in 0..40 {
            film.keep(Jpeg {
                stamp_ns,
                scale: 1,
                bytes: vec![0; 1_000_000].into(),
            });
        }
        assert_eq!((film.kept.len(), film.kept_bytes), (12, 12_000_000));
        assert_eq!(film.kept.back().unwrap().stamp_ns, 39);
    }
}
