//! `wag latency --stops`: how long, and how far, an arm goes on that is told to stop.
//!
//! Joint 1 swings the arm about its column as fast as set-up motions, wiggles and throws may be,
//! and is stopped at full speed: by the controller's brake, and by asking the arm itself (state
//! 4), as the guardian does. What is measured is in the arm's joint reports.

use crate::cli::LatencyArgs;
use crate::command::area::{asks, limits, reach_measured, require_clear_area};
use crate::command::on_arm::{AT_START, MOVE_SPEED, on_arm};
use crate::config;
use anyhow::{Context, ensure};
use arm_model::joint::START_POSE;
use arm_model::kinematics::tool_speed_m_s;
use arm_model::{JointTrajectory, Limits, Pole};
use cli_output::{OrInput, Outcome, Stage, table};
use rt_controller::armed_speed::ArmedSpeed;
use rt_controller::control::OperatingModeSpeeds;
use rt_controller::os::now_ns;
use rt_controller::session::ArmSession;
use rt_controller::stopping::{StopMethod, Stopping, fastest_swing};
use serde_json::{Value, json};
use session::Session;
use session::arm::{self, ArmLink, BringUp, refusal};
use shared_types::OperatingMode;
use shared_types::ipc::message::{ControllerEvent, ControllerRequest};
use shared_types::plan::trajectory_hash;
use std::net::SocketAddr;
use std::time::Duration;

/// How long the joints are watched after a stop.
const WATCHED: Duration = Duration::from_millis(1500);
/// How the arm is before it returns for the next swing.
const STOPPED: &str = "The arm was stopped; it will be enabled and returns to the start.";
/// A stop from below this part of the swing's full speed is measured again: it was told late.
const FULL_SPEED_PART: f64 = 0.8;
/// How often in a row a stop may be told late.
const LATE_MAX: usize = 3;
/// Longest wait for an answer of the arm.
const ANSWERED: Duration = Duration::from_secs(1);

/// One stop.
#[derive(Debug, serde::Serialize)]
struct Stopped {
    operating_mode: OperatingMode,
    /// How it was stopped.
    by: &'static str,
    /// Speed of the pole's end when it was told to (m/s).
    speed_m_s: f64,
    /// From then until every joint stood (s).
    time_s: f64,
    /// Way of the pole's end in that time (m).
    distance_m: f64,
}

/// The fastest swing that is allowed.
fn swing(mode: OperatingMode, limits: &Limits, pole: &Pole) -> anyhow::Result<JointTrajectory> {
    let swing = fastest_swing(&ArmedSpeed {
        armed: mode,
        limits,
        pole,
        speeds: OperatingModeSpeeds::default(),
    });
    swing.context("joint 1 cannot swing from the start pose within the limits")
}

/// Swings and stops once, of an arm that stands in the start pose and is armed.
fn stop(
    session: &mut Session,
    link: &ArmLink,
    arm: SocketAddr,
    pole: &Pole,
    swing: &JointTrajectory,
    (mode, method): (OperatingMode, StopMethod),
) -> anyhow::Result<Stopped> {
    let mut line = ArmSession::connect(arm, ANSWERED)?;
    line.keep_heartbeat();
    session.tick()?;
    let motion = link.call(&ControllerRequest::Execute {
        trajectory: Box::new(*swing),
        sha256: trajectory_hash(swing),
    })?;
    let start_ns = match session.next(&motion, 5.0)? {
        ControllerEvent::Started { start_ns } => start_ns,
        other => return Err(refusal("the swing", &other)),
    };
    let half_ns = start_ns + (0.5e9 * swing.duration_s()) as u64;
    while now_ns() < half_ns {
        session.tick()?;
        if let Some(event) = motion.try_next()? {
            return Err(refusal("the swing", &event))
                .context("it ended before it was to be stopped");
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    let told_ns = now_ns();
    let by = match method {
        StopMethod::Brake => {
            session.ask(link, &ControllerRequest::Stop, 5.0, |_| ())?;
            "controller's brake"
        }
        StopMethod::State4 => {
            let taken = line.stop_arm()?;
            ensure!(
                taken,
                "the arm was asked to stop and does not say that it has"
            );
            "arm (state 4)"
        }
    };
    let end = session.finish(&motion, 5.0, |_| ());
    session.end_hold();
    let end = end?;
    if !method.has_caused(&end) {
        return Err(refusal("the swing", &end)).context("something else stopped it");
    }
    session.idle(WATCHED)?;
    let reports = session.received.cycles.reports();
    let stopping = Stopping::measured(&reports, told_ns, pole).map_err(anyhow::Error::msg)?;
    Ok(Stopped {
        operating_mode: mode,
        by,
        speed_m_s: stopping.speed_m_s,
        time_s: stopping.time_s,
        distance_m: stopping.distance_m,
    })
}

/// Stops the arm at rising speeds; what was measured is the run's summary.
pub(super) fn measure(args: &LatencyArgs) -> Outcome<Value> {
    let Some(address) = reach_measured(&args.arm)? else {
        return Err(bad_input!(
            "name the arm with --arm ADDR: its stops are measured while it moves"
        ));
    };
    let limits = limits(&args.arm, Some(&address))?;
    let pole = config::cell().or_input()?.pole;
    use OperatingMode::{SetUp, Throw, Wiggle};
    let swings =
        [SetUp, Wiggle, Throw].map(|mode| Ok((mode, swing(mode, &limits, &pole).or_input()?)));
    let swings = swings.into_iter().collect::<Outcome<Vec<_>>>()?;
    let both = [StopMethod::Brake, StopMethod::State4];
    let wanted = swings.iter().flat_map(|swing| both.map(|by| (swing, by)));
    let wanted: Vec<_> = wanted.collect();
    require_clear_area(&args.arm, &address, "MOVE")?;
    let is_asked = asks(&args.arm, &address);
    let arm = SocketAddr::new(address.ip, address.command);
    let work = |session: &mut Session, link: &ArmLink| {
        let mut stops = Vec::new();
        let mut measure_all = || -> anyhow::Result<()> {
            let (mut has_moved, mut late) = (false, 0);
            while let Some(((mode, swing), method)) = wanted.get(stops.len()) {
                if has_moved {
                    // Who looked at the arm acknowledges the stop.
                    is_asked
                        .then(|| session.confirm(STOPPED, "MOVE"))
                        .transpose()?;
                    arm::enable(session, link, true, &mut BringUp::default())?;
                    arm::arm_for(session, link, SetUp, None)?;
                    arm::move_to(session, link, START_POSE, MOVE_SPEED)?;
                }
                let word = is_asked
                    .then(|| session.confirm(AT_START, "MEASURE"))
                    .transpose()?;
                session.await_hold()?;
                let stage = Stage::begin("stop");
                arm::arm_for(session, link, *mode, Some(word.unwrap_or_else(now_ns)))?;
                has_moved = true;
                let stopped = stop(session, link, arm, &pole, swing, (*mode, *method))?;
                let half = swing.state_at(0.5 * swing.duration_s());
                let full_m_s = tool_speed_m_s(&half.q, &half.qd, &pole.end_m());
                let is_late = stopped.speed_m_s < FULL_SPEED_PART * full_m_s;
                let again = if is_late {
                    ": told late, once more"
                } else {
                    ""
                };
                stage.done(&format!(
                    "{:?}, by the {}: {:.2} m/s to rest in {:.0} ms and {:.0} mm{again}",
                    mode,
                    stopped.by,
                    stopped.speed_m_s,
                    1e3 * stopped.time_s,
                    1e3 * stopped.distance_m
                ));
                if !is_late {
                    stops.push(stopped);
                    late = 0;
                    continue;
                }
                late += 1;
                ensure!(
                    late < LATE_MAX,
                    "{late} times in a row the swing of {full_m_s:.2} m/s was stopped when it \
                         was slower: is this computer busy with something else?"
                );
            }
            Ok(())
        };
        let measured = measure_all();
        // What was measured before a failure is worth knowing.
        if !stops.is_empty() {
            show(&stops);
        }
        measured?;
        Ok(json!({ "command": "latency", "stops": stops }))
    };
    let place = (args.out.as_deref(), "stops", None);
    let (_, found) = on_arm(
        &args.arm,
        address,
        &limits,
        START_POSE,
        place,
        work,
        |_, _, value| Ok(value),
    )?;
    Ok(found)
}

fn show(stops: &[Stopped]) {
    let rows = stops.iter().map(|stop| {
        [
            format!("{:?}", stop.operating_mode),
            format!("{:.2}", stop.speed_m_s),
            format!("{:.0}", 1e3 * stop.time_s),
            format!("{:.0}", 1e3 * stop.distance_m),
            stop.by.to_owned(),
        ]
    });
    let header = [
        "armed for",
        "pole's end (m/s)",
        "time to rest (ms)",
        "distance (mm)",
        "stopped by",
    ];
    println!("{}", table::numbers(header, 1, rows));
}
