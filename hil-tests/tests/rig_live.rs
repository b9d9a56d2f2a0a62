//! The whole rig in real time: frames flow, and the truth agrees with them.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

use arm_model::joint::START_POSE;
use camera_ingest::StereoFrame;
use hil_tests::scenario::bring_up;
use nalgebra::Vector3;
use rig_sim::RigConfig;
use rt_controller::session::ArmSession;
use rt_controller::xarm::{Command, Mode};
use shared_types::StereoCamera;
use shared_types::Task;
use shared_types::ipc::message::{RigEvent, RigRequest, RigRpc};
use shared_types::ipc::rpc::RpcClient;
use shared_types::ipc::{Bus, FrameHeader, IpcError};
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use xarm_sim::clock;

const PATIENCE: Duration = Duration::from_secs(20);
const FRAMES: usize = 20;

fn config() -> RigConfig {
    RigConfig {
        domain: format!("test_rig_{}", std::process::id()),
        seed: 11,
        command_port: 0,
        report_ports: [0; 4],
        ..RigConfig::default()
    }
}

fn ask(client: &RpcClient<RigRpc>, request: &RigRequest) -> RigEvent {
    let began = Instant::now();
    loop {
        let answer = client
            .call(request)
            .and_then(|pending| pending.finish::<IpcError>(PATIENCE, || Ok(()), |_| ()));
        match answer {
            Ok(event) => return event,
            // The rig is still starting.
            Err(IpcError::Gone { .. }) if began.elapsed() < PATIENCE => {
                std::thread::sleep(Duration::from_millis(20));
            }
            Err(error) => panic!("{error}"),
        }
    }
}

/// The truth about a span of time, asked for again while physics has not reached its end.
fn truth(client: &RpcClient<RigRpc>, from_ns: u64, to_ns: u64) -> RigEvent {
    let began = Instant::now();
    loop {
        let answer = ask(client, &RigRequest::Truth { from_ns, to_ns });
        let late = matches!(&answer, RigEvent::Failed { message } if message.contains("future"));
        if !late || began.elapsed() > PATIENCE {
            return answer;
        }
    }
}

/// Ends the rig however its test ends: the scope would wait for ever for one that goes on.
struct EndWhenDropped<'a>(&'a AtomicBool);

impl Drop for EndWhenDropped<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

/// A test with a running rig: its domain, its service and the port for commands.
fn on_rig(config: &RigConfig, test: impl FnOnce(&Bus, &RpcClient<RigRpc>, u16)) {
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let rig = scope.spawn(|| rig_sim::run(config, &stop));
        let end = EndWhenDropped(&stop);
        let bus = Bus::join(&config.domain).unwrap();
        let client = RpcClient::open(&bus).unwrap();
        let RigEvent::Ports { command, reports } = ask(&client, &RigRequest::Ports) else {
            panic!("no ports");
        };
        assert!(command > 0 && reports.iter().all(|p| *p > 0));
        test(&bus, &client, command);
        drop(end);
        rig.join().unwrap().unwrap();
    });
}

fn film(bus: &Bus) -> Vec<(FrameHeader, Vec<u8>)> {
    let subscriber = bus.frame_subscriber().unwrap();
    let began = Instant::now();
    let mut frames = Vec::new();
    while frames.len() < FRAMES {
        assert!(began.elapsed() < PATIENCE, "only {} frames", frames.len());
        match subscriber.receive().unwrap() {
            Some(sample) => frames.push((*sample.user_header(), sample.payload().to_vec())),
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    }
    frames
}

/// Where both eyes see the lead: centroid of what has its hue, triangulated.
fn lead_in(frame: &(FrameHeader, Vec<u8>), config: &RigConfig) -> Vector3<f64> {
    let camera: StereoCamera = config.camera.stereo_camera();
    let size = [camera.width_px as usize * 2, camera.height_px as usize];
    let frame = StereoFrame::from_yuyv(&frame.1, size, 0, 0).unwrap();
    let hue = camera_ingest::frame::ycc_from_rgb(config.appearance().lead_rgb);
    let [left, right] = [frame.left(), frame.right()].map(|image| {
        let (mut n, mut sum) = (0.0, [0.0, 0.0]);
        for v in 0..size[1] {
            for u in 0..size[0] / 2 {
                let seen = image.ycc(u, v).map(f32::from);
                let chroma = |c: [f32; 3]| (c[1] - 128.0, c[2] - 128.0);
                let ((b, r), (wb, wr)) = (chroma(seen), chroma(hue));
                // Along the lead's hue, and coloured at all.
                let (along, length) = (b * wb + r * wr, b.hypot(r));
                if length > 30.0 && along > 0.97 * length * wb.hypot(wr) {
                    n += 1.0;
                    sum = [sum[0] + u as f64, sum[1] + v as f64];
                }
            }
        }
        assert!(n > 20.0, "lead of {n} px");
        [sum[0] / n, sum[1] / n]
    });
    camera.triangulate(left, right).unwrap().p_w_m
}

#[test]
fn frames_and_truth_of_a_rope_at_rest_agree() {
    let config = config();
    on_rig(&config, |bus, client, _| {
        let frames = film(bus);
        let period_ns = 1e9 / config.camera.frame_rate_hz;
        for pair in frames.windows(2) {
            let (a, b) = (pair[0].0, pair[1].0);
            assert!(b.sequence > a.sequence);
            let want_ns = (b.sequence - a.sequence) as f64 * period_ns;
            assert!(((b.stamp_ns - a.stamp_ns) as f64 - want_ns).abs() < 100.0);
        }
        assert_eq!((frames[0].0.width_px, frames[0].0.height_px), (1344, 376));
        assert_eq!(frames[0].1.len(), 1344 * 376 * 2);
        assert!(clock::now().0 > frames[FRAMES - 1].0.stamp_ns);

        let target_m = [0.75, 0.0, -0.2];
        let (from_ns, to_ns) = (frames[0].0.stamp_ns, frames[FRAMES - 1].0.stamp_ns);
        let early = ask(client, &RigRequest::Truth { from_ns, to_ns });
        assert!(matches!(early, RigEvent::Failed { .. }), "{early:?}");
        let placed = ask(
            client,
            &RigRequest::PlaceTarget {
                task: Task::Strike,
                target_m,
            },
        );
        assert_eq!(placed, RigEvent::Done);
        let answer = truth(client, from_ns, to_ns);
        let RigEvent::Truth {
            rope,
            closest_m,
            peak_tip_speed_m_s,
            touched,
            ..
        } = answer
        else {
            panic!("{answer:?}");
        };
        assert_eq!(rope, config.rope());
        assert!(peak_tip_speed_m_s < 1e-3, "at rest: {peak_tip_speed_m_s}");
        assert!(!touched);
        let seen_m = (lead_in(&frames[FRAMES - 1], &config) - Vector3::from(target_m)).norm();
        assert!(
            (seen_m - closest_m).abs() < 0.02,
            "{seen_m} and {closest_m}"
        );
    });
}

#[test]
fn the_rope_swings_when_the_arm_moves() {
    let mut config = RigConfig {
        domain: format!("test_rig_move_{}", std::process::id()),
        target_m: Some([1.10, 0.0, 0.45]),
        ..config()
    };
    config.camera.enabled = false;
    on_rig(&config, |_, client, port| {
        let address = SocketAddr::new(config.bind, port);
        let mut arm = ArmSession::connect(address, PATIENCE).unwrap();
        let from_ns = clock::now().0;
        let go = Command::MoveJoint {
            target: START_POSE,
            speed_rad_s: 1.0,
            acceleration_rad_s2: 10.0,
            checked: None,
        };
        for command in bring_up(Mode::Position).iter().chain([&go]) {
            arm.ask(command).unwrap();
        }
        std::thread::sleep(Duration::from_millis(800));
        let to_ns = clock::now().0;
        let answer = truth(client, from_ns, to_ns);
        let RigEvent::Truth {
            peak_tip_speed_m_s,
            touched,
            ..
        } = answer
        else {
            panic!("{answer:?}");
        };
        // Joint 1 alone sweeps a tip some 0.6 m away.
        assert!(
            peak_tip_speed_m_s > 0.1 && peak_tip_speed_m_s < 5.0,
            "{peak_tip_speed_m_s} m/s"
        );
        assert!(!touched);
    });
}
