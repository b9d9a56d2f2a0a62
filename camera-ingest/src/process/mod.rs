//! The camera-ingest process: takes frames out of shared memory, answers
//! `CameraRpc`, publishes keypoints.
//!
//! One thread. While nothing is asked it only keeps up with the camera; a long
//! piece of work (tracking) lets frames pass by, which slows no other process.

mod answer;
mod keep;
mod work;

use crate::frame::StereoFrame;
use crate::still::StillDetector;
use answer::{answer, failed};
use keep::Recording;
use serde::{Deserialize, Serialize};
use shared_types::ipc::message::{CameraEvent, CameraRequest, CameraRpc, Progress};
use shared_types::ipc::rpc::{Call, RpcServer};
use shared_types::ipc::{
    Bus, FRAME_SERVICE, FrameHeader, FrameSubscriber, IpcError, KeypointPublisher,
    PIXEL_FORMAT_YUYV,
};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Configuration of the process. TOML form: keys as the fields.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraConfig {
    /// Shared-memory domain.
    pub domain: String,
}

/// Frames that are compared to see motion: a tenth of a second apart at 60 Hz.
const STILL_LAG_FRAMES: usize = 6;
/// Still frames in a row that count as hanging still.
const STILL_FRAMES: usize = 30;
/// How long the camera may be silent before a recording fails (s).
const CAMERA_SILENT_S: f64 = 2.0;

/// Frames per second that films of runs are made with.
pub const RATE_HZ: u32 = 60;
/// Part by which a camera's rate may differ: a film of a wiggle must not outlast its joints.
const RATE_TOLERANCE: f64 = 0.04;

/// What is said of a film that was recorded at another rate than [`RATE_HZ`].
#[must_use]
pub fn at_another_rate(event: &CameraEvent) -> Option<String> {
    let CameraEvent::Recorded { rate_hz: hz, .. } = event else {
        return None;
    };
    // Its numbers began anew meanwhile.
    if *hz <= 0.0 {
        return Some("the camera was started anew while it filmed: start it, then the run".into());
    }
    let is_off = (hz / f64::from(RATE_HZ) - 1.0).abs() > RATE_TOLERANCE;
    is_off.then(|| {
        format!(
            "the camera took {hz:.0} frames a second, not {RATE_HZ}: start it at that rate; in dim light give it a fixed exposure (`[live]` of camera.toml)"
        )
    })
}

/// Runs until `stop` is set.
///
/// # Errors
/// When shared memory cannot be used.
pub fn run(config: &CameraConfig, stop: &AtomicBool) -> Result<(), IpcError> {
    let bus = Bus::join(&config.domain)?;
    let frames = bus.frame_subscriber()?;
    let keypoints = bus.keypoint_publisher()?;
    let server = RpcServer::<CameraRpc>::open(&bus)?;
    let mut process = Process {
        frames,
        keypoints,
        recording: Recording::default(),
        job: None,
    };
    tracing::info!(domain = config.domain, "camera-ingest is ready");
    while !stop.load(Ordering::Relaxed) {
        match server.receive() {
            Ok(Some(call)) => process.accept(call, stop),
            Ok(None) => {}
            Err(e @ IpcError::Message { .. }) => tracing::warn!("{e}"),
            Err(e) => return Err(e),
        }
        if !process.take_frames()? {
            std::thread::sleep(Duration::from_millis(2));
        }
    }
    Ok(())
}

/// A request that needs frames to come in.
#[derive(Debug)]
enum Waiting {
    Still {
        detector: StillDetector,
        until: Instant,
    },
    Record,
}

#[derive(Debug)]
struct Job {
    call: Call<CameraRpc>,
    waiting: Waiting,
    last_frame: Instant,
}

struct Process {
    frames: FrameSubscriber,
    keypoints: KeypointPublisher,
    recording: Recording,
    job: Option<Job>,
}

impl Process {
    fn accept(&mut self, call: Call<CameraRpc>, stop: &AtomicBool) {
        let now = Instant::now();
        let waiting = match &call.request {
            CameraRequest::Ping => return answer(&call, &CameraEvent::Pong),
            _ if self.job.is_some() => {
                let busy = "camera-ingest is busy with another request; wait for its end";
                return answer(&call, &failed(busy));
            }
            CameraRequest::Keep { name } => {
                let kept = work::keep(&mut self.recording, name, stop);
                return answer(&call, &kept.unwrap_or_else(failed));
            }
            CameraRequest::Track { .. } => {
                let tracked = work::track(&mut self.recording, &call, &self.keypoints);
                return answer(&call, &tracked.unwrap_or_else(failed));
            }
            CameraRequest::Score { .. } => {
                let scored = work::score(&mut self.recording, &call);
                return answer(&call, &scored.unwrap_or_else(failed));
            }
            CameraRequest::Look { .. } => {
                let seen = work::look(&mut self.recording, &call);
                return answer(&call, &seen.unwrap_or_else(failed));
            }
            CameraRequest::WaitStill { timeout_s } => Waiting::Still {
                detector: StillDetector::new(STILL_LAG_FRAMES, STILL_FRAMES),
                until: now + Duration::from_secs_f64(timeout_s.clamp(0.0, 600.0)),
            },
            CameraRequest::Record {
                frames,
                both_images,
            } => {
                self.recording = Recording::begin(*frames, *both_images);
                Waiting::Record
            }
        };
        self.job = Some(Job {
            call,
            waiting,
            last_frame: now,
        });
    }

    /// Takes in what the camera has published; false when there was nothing.
    fn take_frames(&mut self) -> Result<bool, IpcError> {
        let mut any = false;
        loop {
            let failed = IpcError::transfer(FRAME_SERVICE);
            let sample = self.frames.receive().map_err(failed)?;
            let Some(sample) = sample else { break };
            any = true;
            if self.job.is_some() {
                let header = *sample.user_header();
                self.one_frame(&header, sample.payload());
            }
        }
        if let Some(job) = &self.job
            && job.last_frame.elapsed().as_secs_f64() > CAMERA_SILENT_S
        {
            let silent = "no camera frame arrived for 2 s; check that the camera (or the rig) runs in \
                          this domain, and that the machine is not too busy for it";
            answer(&job.call, &failed(silent));
            self.job = None;
        }
        Ok(any)
    }

    fn one_frame(&mut self, header: &FrameHeader, bytes: &[u8]) {
        let Some(job) = &mut self.job else { return };
        job.last_frame = Instant::now();
        let frame = match decode(header, bytes) {
            Ok(frame) => frame,
            Err(message) => {
                answer(&job.call, &failed(message));
                self.job = None;
                return;
            }
        };
        let done = match &mut job.waiting {
            Waiting::Still { detector, until } => {
                let still = detector.push(frame.left());
                // Both images lie side by side.
                let size_px = [header.width_px / 2, header.height_px];
                (still || Instant::now() >= *until).then_some(CameraEvent::Still { still, size_px })
            }
            Waiting::Record => {
                if self.recording.is_empty() {
                    let first_stamp_ns = header.stamp_ns;
                    answer(&job.call, &CameraEvent::Recording { first_stamp_ns });
                }
                let kept = self.recording.keep(frame);
                if kept.is_multiple_of(30) {
                    let progress = Progress {
                        done: kept,
                        total: self.recording.wanted(),
                        value: f64::from(self.recording.dropped()),
                        label: "frames, dropped".to_owned(),
                    };
                    answer(&job.call, &CameraEvent::Progress(progress));
                }
                self.recording.finished()
            }
        };
        if let Some(event) = done {
            answer(&job.call, &event);
            self.job = None;
        }
    }
}

fn decode(header: &FrameHeader, bytes: &[u8]) -> Result<StereoFrame, String> {
    if header.pixel_format != PIXEL_FORMAT_YUYV {
        return Err(format!(
            "the camera sends pixel format {}, but only packed YUYV ({PIXEL_FORMAT_YUYV}) is understood",
            header.pixel_format
        ));
    }
    StereoFrame::from_yuyv(
        bytes,
        [header.width_px as usize, header.height_px as usize],
        header.stamp_ns,
        header.sequence,
    )
    .map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_at_another_rate_or_of_a_camera_started_anew_is_told() {
        let told = |rate_hz| {
            at_another_rate(&CameraEvent::Recorded {
                first_stamp_ns: 0,
                frames: 400,
                dropped: 0,
                rate_hz,
            })
        };
        assert_eq!([59.0, 60.0, 61.0].map(told), [None, None, None]);
        assert!(told(30.0).unwrap().contains("took 30 frames a second"));
        assert!(told(0.0).unwrap().contains("started anew"));
    }
}
