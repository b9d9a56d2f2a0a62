//! `wag run`: from wiggle to throw with an arm and a camera; what `wag demo` does on a rig of its
//! own.

mod rope;
mod stages;
mod summary;

pub use stages::{Entry, Run, Setup};

use super::area::{asks, limits, operator, reach_measured, require_clear_area};
use super::known_rope::KnownRope;
use super::on_arm::{confirmations, of_service, watch_operator};
use super::plan::LOOK;
use super::plan_again::LastThrow;
use super::runs::explain_stop;
use super::unconfirmed::confirm;
use super::{dry_run, identify, motion};
use crate::cli::{ArmArgs, CameraArgs, FromStage, RunArgs, WiggleArgs};
use crate::config;
use crate::pipeline::{ArmAddress, FramesFrom, RunFolder, Scene, find_rig, has_rig};
use anyhow::{Context, bail, ensure};
use arm_model::{JointTrajectory, Limits};
use cli_output::{Failure, OrInput, Outcome, Stage, watch_interrupts};
use planner::PlannerConfig;
use planner::plan::{check_reach, clear_of_arm};
use planner::wiggle::wiggle;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use run_log::files::{self, read_plan};
use run_log::{Run as RecordedRun, RunRecord};
use serde_json::Value;
use session::Session;
use shared_types::ipc::message::{RigEvent, RigRequest};
use shared_types::rope::RANGES;
use shared_types::{OperatingMode, StereoCamera, Task};
use std::path::Path;
use std::time::Instant;
use viewer::report;

/// A target drawn from the seed where ropes of every length can strike
/// (distance from the base axis, height, bearing).
pub fn random_target(seed: u64) -> [f64; 3] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(0x7a26_e701);
    let rho = rng.random_range(0.85..1.05);
    let height = rng.random_range(-0.10..0.60);
    let bearing: f64 = rng.random_range(-20.0_f64..20.0).to_radians();
    [rho * bearing.cos(), rho * bearing.sin(), height]
}

/// Does the `work` of a run in its folder and keeps what came of it: summary, keypoints, file of
/// the run, report.
pub fn in_folder(
    folder: &RunFolder,
    mut record: RunRecord,
    work: impl FnOnce(&mut Session, &mut RunRecord) -> anyhow::Result<()>,
) -> Outcome<Option<Value>> {
    let began = Instant::now();
    let mut session = Session::new(&folder.domain, &folder.log()).or_failed()?;
    let result = work(&mut session, &mut record);
    session.end(result.is_ok());
    record.wall_s = began.elapsed().as_secs_f64();
    record.confirmed = confirmations(&session);
    let keypoints_kept = session.received.keep_keypoints(&folder.path);
    record.error = result.as_ref().err().map(|e| format!("{e:#}"));
    let summary_kept = files::write_json(&folder.file(files::SUMMARY), &record);
    let recorded = session.finish_run_file();
    explain_stop(&folder.path);
    let result = result.with_context(|| format!("run `{}`", folder.path.display()));
    result.or_failed()?;
    keypoints_kept.or_failed()?;
    summary::show(&record);
    keep_report(&folder.path);
    recorded.or_failed()?;
    summary_kept.or_failed()?;
    Ok(Some(serde_json::to_value(&record).or_failed()?))
}

/// The run as a page to look at. Without it the run is as good as before.
fn keep_report(run: &Path) {
    match config::cell_here().and_then(|here| report::write(run, None, &here)) {
        Ok(written) => println!("report: {}", written.path.display()),
        Err(reason) => tracing::warn!("no report was written: {reason:#}"),
    }
}

/// Who films, and with which calibration as far as files tell.
fn camera(args: &CameraArgs) -> Outcome<(FramesFrom, Option<StereoCamera>)> {
    let Some(named) = &args.camera else {
        return Err(bad_input!(
            "name who films with --camera: the shared-memory domain of a camera that runs, or a device, /dev/videoN"
        ));
    };
    let calibration = Scene::of_file(args.calibration.as_deref()).or_input()?;
    let from = if named.starts_with('/') {
        FramesFrom::Device(named.into(), args.fps)
    } else {
        FramesFrom::Domain(named.clone())
    };
    if calibration.is_none() && matches!(from, FramesFrom::Device(..)) {
        return Err(uncalibrated(&from));
    }
    Ok((from, calibration))
}

fn uncalibrated(from: &FramesFrom) -> Failure {
    let nobody = match from {
        FramesFrom::Domain(domain) => {
            format!("no simulated rig films in domain `{domain}`, and where another camera ")
        }
        FramesFrom::Device(..) => "where the camera ".to_owned(),
    };
    bad_input!(
        "{nobody}stands is not known: name its camera.toml with --calibration, or put it into the folder of configurations (~/.config/wag); `wag calib extrinsics` estimates it"
    )
}

/// Where the run begins, and the target of the run that it goes on with.
fn entry(args: &RunArgs, settings: &PlannerConfig) -> Outcome<(Entry, Option<[f64; 3]>)> {
    let Some((stage, from)) = args.from().map_err(|why| bad_input!("{why}"))? else {
        return Ok((Entry::Wiggle, None));
    };
    let run = RecordedRun::open(&from).or_input()?;
    let planned = run.plan().or_input()?.map(|plan| plan.target_m);
    let summary = run.summary().or_input()?.unwrap_or_default();
    let target_m = planned.or_else(|| serde_json::from_value(summary["target_m"].clone()).ok());
    let rope = |known: KnownRope| (Entry::Rope(Box::new(known)), target_m);
    Ok(match stage {
        FromStage::Identify => {
            let accept = args.accept_unconfirmed;
            let (estimate, unconfirmed) = identify::again(&from, &settings.identify, accept)?;
            rope(KnownRope::identified(estimate, unconfirmed))
        }
        FromStage::Plan => {
            let known = KnownRope::read(&from.join(files::ROPE)).or_input()?;
            confirm(&known.unconfirmed, args.accept_unconfirmed, LOOK).or_failed()?;
            rope(known)
        }
        FromStage::Throw => {
            let plan = read_plan(&from.join(files::PLAN)).or_input()?;
            confirm(&plan.unconfirmed, args.accept_unconfirmed, LOOK).or_failed()?;
            config::cell_for(&plan).or_input()?;
            (Entry::Plan(Box::new(plan)), target_m)
        }
    })
}

/// A target that is named must lie where a rope can strike.
pub fn check_target(target_m: [f64; 3], settings: &PlannerConfig) -> Outcome {
    check_reach(target_m, RANGES[1].max, &settings.cell).or_input()?;
    clear_of_arm(target_m, &settings.cell).or_input()
}

/// The planner's values, with what the command line says of the rope.
fn settings(args: &RunArgs) -> Outcome<PlannerConfig> {
    let mut settings = config::here::<PlannerConfig>(None)
        .or_input()?
        .with_identify_seed(args.seed);
    let options = &mut settings.identify;
    options.lead_mass_kg = args.lead_mass.or(options.lead_mass_kg);
    options.length_m = args.length.or(options.length_m);
    Ok(settings)
}

pub fn run(args: &RunArgs) -> Outcome<Option<Value>> {
    if args.task != Task::Strike {
        let task = args.task.name();
        return Err(failed!(
            "a run of the {task} is not implemented in this version; `wag plan {task}` plans and judges one in simulation"
        ));
    }
    let settings = settings(args)?;
    if args.arm.dry_run {
        return tell(args, &settings);
    }
    if !args.arm.names_arm() {
        return Err(bad_input!(
            "name the arm with --arm ADDR, or a controller that runs with --controller NAME"
        ));
    }
    let (frames, calibration) = camera(&args.camera)?;
    let named = args.target.map(|target| target.0);
    named.map_or(Ok(()), |target_m| check_target(target_m, &settings))?;
    args.out
        .as_deref()
        .map_or(Ok(()), RunFolder::refuse_existing)?;
    watch_interrupts().or_failed()?;
    let last = args.again.as_deref();
    let last = last.map(|run| LastThrow::read(run, None)).transpose()?;
    let (entry, earlier) = match &last {
        Some(last) => (Entry::Wiggle, Some(last.plan.target_m)),
        None => entry(args, &settings)?,
    };
    let (address, limits) = reach_for_run(&args.arm)?;
    let entry = match last {
        Some(last) => {
            let response = address.arm_response.as_ref().map(|(_, r)| r.clone());
            let ways = (limits.clone(), settings.clone());
            Entry::Plan(Box::new(last.to_throw(ways, response)?))
        }
        None => entry,
    };
    let filmed = Filmed {
        frames,
        calibration,
        names_calibration: args.camera.calibration.is_some(),
        target_m: named.or(earlier),
        colours: [args.tip_rgb, args.target_rgb].map(|named| named.map(|colour| colour.0)),
        accept_unconfirmed: args.accept_unconfirmed,
        robust: args.robust,
    };
    let place = (args.out.as_deref(), "run", args.seed);
    on_camera(&args.arm, (address, limits, settings), filmed, place, entry)
}

/// The wiggle alone, filmed and tracked: what `wag identify --keypoints RUN` and
/// `wag run --from identify RUN` go on with.
pub fn wiggle_alone(args: &WiggleArgs) -> Outcome<Option<Value>> {
    let settings: PlannerConfig = config::here(None).or_input()?;
    let (frames, calibration) = camera(&args.camera)?;
    args.out
        .as_deref()
        .map_or(Ok(()), RunFolder::refuse_existing)?;
    watch_interrupts().or_failed()?;
    let (address, limits) = reach_for_run(&args.arm)?;
    let filmed = Filmed {
        frames,
        calibration,
        names_calibration: args.camera.calibration.is_some(),
        target_m: None,
        colours: [None; 2],
        accept_unconfirmed: args.accept_unconfirmed,
        robust: 0,
    };
    let place = (args.out.as_deref(), "wiggle", args.seed);
    let with = (address, limits, settings);
    on_camera(&args.arm, with, filmed, place, Entry::WiggleAlone)
}

/// Tells what would be done first, and checks it.
fn tell(args: &RunArgs, settings: &PlannerConfig) -> Outcome<Option<Value>> {
    let limits = limits(&args.arm, None)?;
    let (first, _) = entry(args, settings)?;
    let Some((trajectory, operating_mode)) = first_motion(&first, &limits, settings)? else {
        println!("the throw is planned with the rope first, and checked then");
        return Ok(None);
    };
    motion::check(None, &limits, &trajectory, operating_mode)?;
    let (name, _) = motion::words(operating_mode);
    dry_run::tell(&args.arm, &limits, &trajectory, name).map(Some)
}

/// The first motion of a run but for moves at set-up speed, where it is known.
fn first_motion(
    entry: &Entry,
    limits: &Limits,
    settings: &PlannerConfig,
) -> Outcome<Option<(JointTrajectory, OperatingMode)>> {
    Ok(match entry {
        Entry::Plan(plan) => Some((plan.trajectory, OperatingMode::Throw)),
        Entry::Wiggle | Entry::WiggleAlone => {
            let trajectory = wiggle(&settings.wiggle, limits).or_failed()?;
            Some((trajectory, OperatingMode::Wiggle))
        }
        // Its throw is still to be planned.
        Entry::Rope(_) => None,
    })
}

/// Refuses the first motion of a run if it must not be sent.
fn check_first(
    entry: &Entry,
    address: &ArmAddress,
    limits: &Limits,
    settings: &PlannerConfig,
) -> Outcome {
    let Some((trajectory, operating_mode)) = first_motion(entry, limits, settings)? else {
        return Ok(());
    };
    motion::check(Some(address), limits, &trajectory, operating_mode)?;
    motion::require_measured_joints(address, &trajectory, operating_mode)
}

/// The arm that is named, and its limits.
fn reach_for_run(arm: &ArmArgs) -> Outcome<(ArmAddress, Limits)> {
    let address = reach_measured(arm)?.ok_or_else(|| bad_input!("name the arm with --arm ADDR"))?;
    let limits = limits(arm, Some(&address))?;
    Ok((address, limits))
}

/// What the command line says of camera, target and rope.
struct Filmed {
    frames: FramesFrom,
    calibration: Option<StereoCamera>,
    /// Whether the command line names that calibration: then it goes before a simulated rig's.
    names_calibration: bool,
    target_m: Option<[f64; 3]>,
    /// Of tip and target.
    colours: [Option<[u8; 3]>; 2],
    accept_unconfirmed: bool,
    robust: usize,
}

/// Goes from `entry` to its end with an arm and a camera that are there.
fn on_camera(
    arm: &ArmArgs,
    (address, limits, settings): (ArmAddress, Limits, PlannerConfig),
    filmed: Filmed,
    (out, name, seed): (Option<&Path>, &'static str, u64),
    entry: Entry,
) -> Outcome<Option<Value>> {
    check_first(&entry, &address, &limits, &settings)?;
    require_clear_area(arm, &address, "MOVE")?;
    let operator = operator(arm, &address)?;
    let simulated = match &filmed.frames {
        FramesFrom::Domain(domain) => has_rig(domain).or_failed()?,
        FramesFrom::Device(..) => false,
    };
    if !simulated && filmed.calibration.is_none() {
        return Err(uncalibrated(&filmed.frames));
    }
    if !simulated && filmed.target_m.is_none() && !matches!(entry, Entry::WiggleAlone) {
        return Err(bad_input!("name the target with --target X,Y,Z"));
    }
    let mut folder = RunFolder::create(out, name)?;
    let service = address.service.as_ref().map(|s| &s.config.domain);
    match (&filmed.frames, service) {
        (FramesFrom::Domain(camera), Some(controller)) if camera != controller => {
            return Err(bad_input!(
                "the camera runs in shared-memory domain `{camera}`, the controller in `{controller}`: start both in the same"
            ));
        }
        (FramesFrom::Domain(domain), _) | (_, Some(domain)) => folder.domain.clone_from(domain),
        (FramesFrom::Device(..), None) => {}
    }
    let by_service = address.service.is_some();
    let mut record = RunRecord::new(name, seed, filmed.target_m, &folder.path);
    record.operator = operator;
    in_folder(&folder, record, |session, record| {
        let stage = Stage::begin("start");
        watch_operator(session, arm, &address)?;
        let rig = find_rig(session, (address.simulated, address.command))?;
        let mut scene = match (&rig, filmed.calibration) {
            (Some(rig), Some(camera)) if filmed.names_calibration => Scene {
                camera,
                ..Scene::of_rig(session, rig)?
            },
            (Some(rig), _) => Scene::of_rig(session, rig)?,
            (None, Some(camera)) => Scene {
                camera,
                tip_rgb: None,
                target_rgb: None,
            },
            (None, None) => bail!("the simulated rig that filmed is gone"),
        };
        let [tip_rgb, target_rgb] = filmed.colours;
        scene.tip_rgb = tip_rgb.or(scene.tip_rgb);
        scene.target_rgb = target_rgb.or(scene.target_rgb);
        if !matches!(entry, Entry::WiggleAlone) {
            let drawn = rig.is_some().then(|| random_target(seed));
            let target_m = filmed.target_m.or(drawn);
            let target_m = target_m.context("name the target with --target X,Y,Z")?;
            record.target_m = Some(target_m);
            if let Some(rig) = &rig {
                let place = RigRequest::PlaceTarget { target_m };
                let placed = session.ask(rig, &place, 5.0, |_| ())?;
                ensure!(placed == RigEvent::Done, "the rig answered with {placed:?}");
            }
        }
        let setup = Setup {
            settings,
            limits,
            asks: asks(arm, &address),
            acknowledges: arm.acknowledge,
            address,
            frames: filmed.frames,
            scene,
            rig,
            accept_unconfirmed: filmed.accept_unconfirmed,
            robust: filmed.robust,
        };
        let mut run = Run::start(&folder, session, record, setup, &stage)?;
        run.go(entry).map_err(|error| of_service(by_service, error))
    })
}
