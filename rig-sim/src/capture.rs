//! The camera: takes frames at its own pace and publishes them late but with
//! honest stamps, like a real one.

use super::config::RigConfig;
use super::error::RigError;
use super::record::{Placed, Record};
use crate::render::{Renderer, RopeShape, ScenePose, TaskBodies};
use rope_sim::Scene;
use shared_types::ipc::{
    Bus, FRAME_SERVICE, FrameHeader, FramePublisher, IpcError, PAYLOAD_VERSION, PIXEL_FORMAT_YUYV,
};
use shared_types::{MonotonicNs, StereoCamera, Task};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use xarm_sim::clock;

/// Delay beyond the camera's latency at which frames are dropped (s).
const BACKLOG_S: f64 = 0.12;
/// Pause between two warnings of dropped frames (s).
const WARN_EVERY_S: f64 = 10.0;
/// Longest sleep before `stop` is looked at again.
const PATIENCE: Duration = Duration::from_millis(50);

/// Films the record until `stop`.
pub(super) fn run(config: &RigConfig, record: &Record, stop: &AtomicBool) -> Result<(), RigError> {
    let bus = Bus::join(&config.domain)?;
    let camera = config.camera.stereo_camera();
    let mut renderer = renderer(config, &camera);
    let publisher = bus.frame_publisher(renderer.frame_bytes())?;
    let mut shutter = Shutter {
        start: clock::now(),
        period_s: 1.0 / config.camera.frame_rate_hz,
        sequence: 0,
        dropped: 0,
        warned: None,
    };
    let blank = FrameHeader {
        version: PAYLOAD_VERSION,
        pixel_format: PIXEL_FORMAT_YUYV,
        width_px: camera.width_px * 2,
        height_px: camera.height_px,
        ..FrameHeader::default()
    };
    let mut drawn = None;
    while !stop.load(Ordering::Acquire) {
        let opens = shutter.opens();
        let arrives = opens.plus_s(config.camera.latency_s);
        if !record.wait_for(opens.plus_s(camera.frame_time_s()), PATIENCE) {
            continue;
        }
        let Some(poses) = expose(record, &renderer, opens, camera.frame_time_s()) else {
            // Before the first moment, or so late that it is forgotten.
            shutter.sequence += 1;
            continue;
        };
        let placed = record.placed();
        if placed != drawn {
            place(&mut renderer, config, placed);
            drawn = placed;
        }
        renderer.lean_domino(record.tilt_rad(opens));
        let header = FrameHeader {
            sequence: shutter.sequence,
            stamp_ns: opens.0,
            ..blank
        };
        publish(&publisher, header, &mut renderer, &poses, arrives)?;
        shutter.next(clock::now(), config.camera.latency_s + BACKLOG_S);
    }
    shutter.tell();
    Ok(())
}

/// Draws from now on what stands at the target.
fn place(renderer: &mut Renderer, config: &RigConfig, placed: Placed) {
    let ball = placed.filter(|(task, _)| *task == Task::Strike);
    renderer.place_target(ball.map(|(_, target_m)| target_m));
    renderer.place_bodies(placed.map(|(task, target_m)| {
        let scene = Scene::of_task(task, target_m.into(), &config.cell);
        TaskBodies::of(&scene, config.appearance().target_rgb)
    }));
}

/// Draws the chosen room.
fn renderer(config: &RigConfig, camera: &StereoCamera) -> Renderer {
    let (rope, seed) = (RopeShape::from(&config.rope()), config.seed);
    let appearance = config.appearance();
    match config.drawn_room() {
        Some(room) => {
            let rate_hz = config.camera.frame_rate_hz;
            Renderer::in_room(
                camera,
                &config.cell,
                rope,
                &room,
                (appearance.target_rgb, rate_hz),
                seed,
            )
        }
        None => {
            let noise = config.camera.noise_levels;
            Renderer::new(camera, &config.cell, rope, appearance, noise, seed)
        }
    }
}

/// When frames are taken.
struct Shutter {
    start: MonotonicNs,
    period_s: f64,
    sequence: u64,
    /// Frames dropped since the last warning, and when that was.
    dropped: u64,
    warned: Option<MonotonicNs>,
}

impl Shutter {
    /// Start of exposure of the frame at hand.
    fn opens(&self) -> MonotonicNs {
        self.start.plus_s(self.sequence as f64 * self.period_s)
    }

    /// Goes on to the next frame, or, more than `backlog_s` late, to the first
    /// one that is not: the frames between are dropped and leave a gap.
    fn next(&mut self, now: MonotonicNs, backlog_s: f64) {
        self.sequence += 1;
        let first = self.sequence;
        while now.since_s(self.opens()) > backlog_s {
            self.sequence += 1;
        }
        self.dropped += self.sequence - first;
        let is_told = |at: MonotonicNs| now.since_s(at) < WARN_EVERY_S;
        if self.dropped > 0 && !self.warned.is_some_and(is_told) {
            self.warned = Some(now);
            self.tell();
        }
    }

    /// Warns of the frames dropped since the last warning.
    fn tell(&mut self) {
        let dropped = std::mem::take(&mut self.dropped);
        if dropped > 0 {
            tracing::warn!(dropped, "the simulated camera cannot keep up");
        }
    }
}

/// Poses spread evenly over the frame's time, as many as the motion needs.
fn expose(
    record: &Record,
    renderer: &Renderer,
    opens: MonotonicNs,
    frame_time_s: f64,
) -> Option<Vec<ScenePose>> {
    let first = record.pose_at(opens)?;
    let last = record.pose_at(opens.plus_s(frame_time_s))?;
    let count = renderer.sub_frames(&first, &last);
    (0..count)
        .map(|i| {
            let middle = (i as f64 + 0.5) / count as f64;
            record.pose_at(opens.plus_s(frame_time_s * middle))
        })
        .collect()
}

/// Draws straight into shared memory and sends, not before `arrives`.
fn publish(
    publisher: &FramePublisher,
    header: FrameHeader,
    renderer: &mut Renderer,
    poses: &[ScenePose],
    arrives: MonotonicNs,
) -> Result<(), RigError> {
    let mut frame = publisher
        .loan_slice(renderer.frame_bytes())
        .map_err(IpcError::transfer(FRAME_SERVICE))?;
    *frame.user_header_mut() = header;
    renderer.render(poses, header.sequence, frame.payload_mut());
    clock::sleep_until(arrives);
    frame.send().map_err(IpcError::transfer(FRAME_SERVICE))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_camera_drops_frames_and_keeps_its_beat() {
        let mut shutter = Shutter {
            start: MonotonicNs(1_000_000_000),
            period_s: 0.01,
            sequence: 0,
            dropped: 0,
            warned: None,
        };
        shutter.next(MonotonicNs(1_030_000_000), 0.1);
        assert_eq!(shutter.sequence, 1);
        shutter.next(MonotonicNs(1_255_000_000), 0.1);
        assert_eq!(shutter.sequence, 16);
        assert_eq!(shutter.opens(), MonotonicNs(1_160_000_000));
        // What follows is counted, and told later.
        assert_eq!(shutter.dropped, 0);
        shutter.next(MonotonicNs(1_305_000_000), 0.1);
        assert_eq!((shutter.sequence, shutter.dropped), (21, 4));
        shutter.next(MonotonicNs(11_400_000_000), 0.1);
        assert_eq!(shutter.dropped, 0);
    }
}
