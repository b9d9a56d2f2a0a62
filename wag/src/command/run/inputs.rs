//! What the command line and an earlier run say, checked before an arm is looked for.

use crate::cli::{CameraArgs, FromStage, RunArgs, WiggleArgs};
use crate::command::identify;
use crate::command::known_rope::KnownRope;
use crate::command::plan::LOOK;
use crate::command::plan_again::check_thrown;
use crate::command::run::Entry;
use crate::pipeline::{ArmAddress, FramesFrom, RunFolder, Scene};
use camera_ingest::calib::VideoMode;
use camera_ingest::live::LiveSettings;
use camera_ingest::process::RATE_HZ;
use cli_output::{Failure, OrInput, Outcome};
use planner::PlannerConfig;
use planner::plan::{check_reach, clear_of_arm};
use planner::wiggle::WiggleConfig;
use rig_sim::port_of_rig;
use run_log::files::{self, read_plan};
use run_log::{Colours, Earlier, Run as RecordedRun, confirm};
use shared_types::rope::RANGES;
use shared_types::{StereoCamera, Task};
use std::path::{Path, PathBuf};

/// Camera, target and rope as they are named.
#[derive(Debug)]
pub struct Inputs {
    pub frames: FramesFrom,
    /// What a file tells of the camera.
    pub calibration: Option<StereoCamera>,
    /// Whether the command line names that file: then it goes before a simulated rig's.
    pub names_calibration: bool,
    /// The command port of the simulated rig that films, if one does.
    rig_port: Option<u16>,
    /// The run that is resumed or corrected.
    resumed: Option<RecordedRun>,
    pub task: Task,
    pub target_m: Option<[f64; 3]>,
    pub colours: Colours,
    pub accept_unconfirmed: bool,
    pub robust: usize,
    pub keeps_films: bool,
    pub short_wiggle: Option<WiggleConfig>,
}

/// A target that is named must lie where a rope can strike.
pub fn check_target(target_m: [f64; 3], settings: &PlannerConfig) -> Outcome {
    check_reach(target_m, RANGES[1].max, &settings.cell).or_input()?;
    clear_of_arm(target_m, &settings.cell).or_input()
}

/// The stage that a run is resumed from, and the folder of that run.
fn resumed(args: &RunArgs) -> Outcome<Option<(FromStage, PathBuf)>> {
    let Some((stage, run)) = args.from().map_err(|why| bad_input!("{why}"))? else {
        return Ok(None);
    };
    let folder = RecordedRun::open(&run).or_input()?.folder().to_owned();
    let unused = [
        ("--target", args.target.is_some(), stage == FromStage::Throw),
        ("--robust", args.robust > 0, stage == FromStage::Throw),
        (
            "--length",
            args.length.is_some(),
            stage != FromStage::Identify,
        ),
        (
            "--lead-mass",
            args.lead_mass.is_some(),
            stage != FromStage::Identify,
        ),
    ];
    for (option, is_named, is_known) in unused {
        if is_named && is_known {
            return Err(bad_input!(
                "{option} changes nothing of what `{}` has found already: resume it from an earlier stage",
                folder.display()
            ));
        }
    }
    Ok(Some((stage, folder)))
}

/// Where the run begins, unless it corrects the throw of another.
pub fn entry(args: &RunArgs, settings: &PlannerConfig) -> Outcome<Entry> {
    let Some((stage, folder)) = resumed(args)? else {
        return Ok(Entry::Wiggle);
    };
    let accept = args.accept_unconfirmed;
    Ok(match stage {
        FromStage::Identify => {
            let (estimate, unconfirmed) = identify::again(&folder, &settings.identify, accept)?;
            Entry::Rope(Box::new(KnownRope::identified(estimate, unconfirmed)))
        }
        FromStage::Plan => {
            let run = RecordedRun::open(&folder).or_input()?;
            let known = KnownRope::read(&run.rope_file().or_input()?).or_input()?;
            confirm(&known.unconfirmed, accept, LOOK).or_failed()?;
            known.ensemble(args.robust, args.seed).or_input()?;
            Entry::Rope(Box::new(known))
        }
        FromStage::Throw => {
            let plan = read_plan(&folder.join(files::PLAN)).or_input()?;
            check_thrown(&plan, accept)?;
            earlier(args)?;
            Entry::Plan(Box::new(plan))
        }
    })
}

/// The run that is resumed or corrected, and what it tells.
fn earlier(args: &RunArgs) -> Outcome<(Earlier, Option<RecordedRun>)> {
    let (stage, folder) = resumed(args)?.unzip();
    let Some(folder) = folder.or_else(|| args.again.clone()) else {
        return Ok((Earlier::default(), None));
    };
    let run = RecordedRun::open(&folder).or_input()?;
    let found = run.earlier().or_input()?;
    if let (Some(FromStage::Throw), Some(thrown), Some(task)) = (stage, found.task, args.task)
        && thrown != task
    {
        return Err(bad_input!(
            "the plan of `{}` is for a {}, not for a {}: resume it from an earlier stage",
            folder.display(),
            thrown.name(),
            task.name()
        ));
    }
    Ok((found, Some(run)))
}

fn uncalibrated(domain: Option<&str>) -> Failure {
    let nobody = domain.map_or_else(
        || "where the camera ".to_owned(),
        |name| format!("no simulated rig films in domain `{name}`, and where another camera "),
    );
    bad_input!(
        "{nobody}stands is not known: name its camera.toml with --calibration, or put it into the folder of configurations (~/.config/wag); `wag calib extrinsics` estimates it"
    )
}

impl Inputs {
    /// What films, which may be a simulated rig.
    fn of_camera(args: &CameraArgs, out: Option<&Path>) -> Outcome<Self> {
        let Some(named) = &args.camera else {
            return Err(bad_input!(
                "name who films with --camera: the shared-memory domain of a camera that runs, or a device, /dev/videoN"
            ));
        };
        out.map_or(Ok(()), RunFolder::refuse_existing)?;
        let calibration = Scene::of_file(args.calibration.as_deref()).or_input()?;
        let (frames, rig_port) = if named.starts_with('/') {
            if !Path::new(named).exists() {
                return Err(bad_input!(
                    "there is no camera `{named}`; `ls /dev/video*` lists them"
                ));
            }
            let (camera, exposure) = calibration.clone().ok_or_else(|| uncalibrated(None))?;
            let mode = VideoMode::of_camera(&camera).map_err(|why| bad_input!("{why}"))?;
            let device = LiveSettings::new(named.into(), mode, RATE_HZ, exposure);
            let device = device.map_err(|why| bad_input!("`[live]` of its camera.toml: {why}"))?;
            (FramesFrom::Device(device), None)
        } else {
            let rig_port = port_of_rig(named).or_input()?;
            (FramesFrom::Domain(named.clone()), rig_port)
        };
        if calibration.is_none() && rig_port.is_none() {
            return Err(uncalibrated(Some(named)));
        }
        Ok(Self {
            frames,
            calibration: calibration.map(|(camera, _)| camera),
            names_calibration: args.calibration.is_some(),
            rig_port,
            task: Task::Strike,
            target_m: None,
            colours: [None; 2],
            accept_unconfirmed: false,
            robust: 0,
            resumed: None,
            keeps_films: args.keep_films,
            short_wiggle: None,
        })
    }

    pub fn of_wiggle(args: &WiggleArgs) -> Outcome<Self> {
        Ok(Self {
            accept_unconfirmed: args.accept_unconfirmed,
            ..Self::of_camera(&args.camera, args.out.as_deref())?
        })
    }

    pub fn of_run(
        args: &RunArgs,
        settings: &PlannerConfig,
        short_wiggle: Option<WiggleConfig>,
    ) -> Outcome<Self> {
        let named = args.target.map(|target| target.0);
        named.map_or(Ok(()), |target_m| check_target(target_m, settings))?;
        let (earlier, resumed) = earlier(args)?;
        let ([tip_rgb, target_rgb], task) = (earlier.colours, earlier.task);
        let found = Self::of_camera(&args.camera, args.out.as_deref())?;
        let of_task = args.task.is_none() || args.task == task;
        let target_m = named.or(earlier.target_m.filter(|_| of_task));
        if target_m.is_none() && found.rig_port.is_none() {
            return Err(bad_input!("name the target with --target X,Y,Z"));
        }
        Ok(Self {
            task: args.task.or(task).unwrap_or(Task::Strike),
            target_m,
            colours: [
                args.tip_rgb.map(|named| named.0).or(tip_rgb),
                args.target_rgb
                    .map(|named| named.0)
                    .or(target_rgb.filter(|_| of_task)),
            ],
            accept_unconfirmed: args.accept_unconfirmed,
            robust: args.robust,
            short_wiggle,
            resumed,
            ..found
        })
    }

    /// Whether a simulated rig films.
    pub const fn is_simulated(&self) -> bool {
        self.rig_port.is_some()
    }

    /// Refuses an arm that the camera does not film, a controller in another domain, and a real arm
    /// for what a rehearsal found.
    pub fn check_arm(&self, address: &ArmAddress) -> Outcome {
        if let Some(run) = &self.resumed {
            run.check_arm(address.simulated).or_input()?;
        }
        if let Some(port) = self.rig_port {
            if !address.simulated {
                return Err(bad_input!(
                    "the camera is a simulated rig's, but the arm does not prove that it is simulated: name the camera that films this arm"
                ));
            }
            if port != address.command {
                return Err(bad_input!(
                    "the camera films the simulated arm with command port {port}, not the one with port {}: name the ports of the one (--command-port), or the camera of the other",
                    address.command
                ));
            }
        }
        let service = address.service.as_ref().map(|s| &s.config.domain);
        match (&self.frames, service) {
            (FramesFrom::Domain(camera), Some(controller)) if camera != controller => {
                Err(bad_input!(
                    "the camera runs in shared-memory domain `{camera}`, the controller in `{controller}`: start both in the same"
                ))
            }
            _ => Ok(()),
        }
    }
}
