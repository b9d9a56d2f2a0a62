//! Drives an arm through a running controller and prints what happened:
//! bring-up, a move to the start pose, a small swing, a throw, latencies.
//!
//! `drive DOMAIN [REPEATS]`; the operator's heartbeat beats in a thread. The
//! last motion is a fast throw that takes 97 % of the tool's speed limit.

use arm_model::joint::START_POSE;
use arm_model::{JointTrajectory, JointVector};
use shared_types::ipc::message::{ControllerEvent, ControllerRequest, ControllerRpc};
use shared_types::ipc::rpc::RpcClient;
use shared_types::ipc::{Bus, IpcError, OperatorEnd};
use shared_types::plan::trajectory_hash;
use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Longest wait for the end of any request.
const TIMEOUT: Duration = Duration::from_secs(60);

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let domain = arguments.next().unwrap_or_else(|| "wag".to_owned());
    let repeats: usize = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let bus = Bus::join(&domain)?;
    let client = RpcClient::<ControllerRpc>::open(&bus)?;
    let quit = Arc::new(AtomicBool::new(false));
    let heart = beat(domain, Arc::clone(&quit));

    ask(&client, &ControllerRequest::Status)?;
    ask(&client, &ControllerRequest::Bringup)?;
    ask(&client, &ControllerRequest::Acknowledge)?;
    let to_start = ControllerRequest::MoveTo {
        q: START_POSE,
        speed_part: 0.3,
    };
    ask(&client, &to_start)?;
    ask(&client, &ControllerRequest::Latency)?;
    let motions = core::iter::repeat_n(swing()?, repeats).chain([throw()?]);
    for trajectory in motions {
        let execute = ControllerRequest::Execute {
            sha256: trajectory_hash(&trajectory),
            trajectory: Box::new(trajectory),
        };
        ask(&client, &execute)?;
    }
    ask(&client, &ControllerRequest::Latency)?;
    ask(&client, &ControllerRequest::Status)?;

    quit.store(true, Ordering::Relaxed);
    match heart.join() {
        Ok(result) => Ok(result?),
        Err(_panic) => Err("the heartbeat thread panicked".into()),
    }
}

/// Four seconds of joint 6 swinging by 12 degrees, 0.75 Hz, fading in and out.
fn swing() -> Result<JointTrajectory, Box<dyn Error>> {
    let duration_s = 4.0;
    let (times_s, poses): (Vec<f64>, Vec<JointVector>) = (0..=100)
        .map(|k| {
            let t_s = duration_s * f64::from(k) / 100.0;
            let window = (core::f64::consts::PI * t_s / duration_s).sin().powi(2);
            let mut q = START_POSE;
            q[5] += 12_f64.to_radians() * window * (core::f64::consts::TAU * 0.75 * t_s).sin();
            (t_s, q)
        })
        .unzip();
    Ok(JointTrajectory::new(&times_s, &poses)?)
}

/// Joints 2, 4 and 6 back and forth, as fast as the tool may go.
fn throw() -> Result<JointTrajectory, Box<dyn Error>> {
    let (mut back, mut forth) = (START_POSE, START_POSE);
    (back[1], back[3], back[5]) = (0.6, 2.6, 1.8);
    (forth[1], forth[3], forth[5]) = (1.0, 1.9, 1.1);
    let poses = [START_POSE, back, forth, START_POSE];
    for hundredths in 20..200 {
        let step_s = f64::from(hundredths) / 100.0;
        let times_s = [0.0, step_s, 2.0 * step_s, 3.0 * step_s];
        let throw = JointTrajectory::new(&times_s, &poses)?;
        let limits = arm_model::Limits::default();
        let within = limits.worst_violation(&throw).is_none();
        if within && limits.tcp_margin(&throw).left > 0.03 {
            println!("throw: {}", limits.tcp_margin(&throw).describe());
            return Ok(throw);
        }
    }
    Err("no throw is slow enough".into())
}

fn beat(domain: String, quit: Arc<AtomicBool>) -> std::thread::JoinHandle<Result<(), IpcError>> {
    std::thread::spawn(move || {
        let bus = Bus::join(&domain)?;
        // A killed operator leaves its place taken until it is cleaned up.
        bus.remove_leftovers();
        let mut operator = OperatorEnd::take(&bus)?;
        while !quit.load(Ordering::Relaxed) {
            operator.beat();
            std::thread::sleep(Duration::from_millis(50));
        }
        Ok(())
    })
}

fn ask(
    client: &RpcClient<ControllerRpc>,
    request: &ControllerRequest,
) -> Result<ControllerEvent, IpcError> {
    match request {
        ControllerRequest::Execute { .. } => println!("> Execute"),
        other => println!("> {other:?}"),
    }
    let pending = client.call(request)?;
    let last = pending.finish::<IpcError>(TIMEOUT, || Ok(()), |event| println!("  {event:?}"))?;
    match &last {
        ControllerEvent::Latency(report) => println!("  {report:#?}"),
        event => println!("  {event:?}"),
    }
    Ok(last)
}
