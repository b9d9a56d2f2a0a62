//! The reference trajectories of `shared/reference/rope-truth`.

#[path = "../../../hil-tests/support/missing.rs"]
mod missing;

use rope_sim::{
    Candidate, FrameTimes, Kernel, PoseRow, PoseTrack, Precision, Rollout, Scene, SimOptions,
    Start, npy, roll_out_in_with,
};
use shared_types::RopeParams;
use std::path::{Path, PathBuf};

/// Where the reference trajectories are, if they are.
pub fn truth_folder() -> Option<PathBuf> {
    let manifest = missing::shared("reference/rope-truth/manifest.json")?;
    manifest.parent().map(Path::to_owned)
}

/// One rope on one motion with its reference trajectory.
pub struct Case {
    /// Name as in the manifest, such as `A1-M3`.
    pub id: String,
    /// The rope.
    pub rope: RopeParams,
    /// The motion.
    pub motion: PoseTrack,
    /// Rotation vector of joint 0 at the start (rad).
    pub joint0_rotvec: [f64; 3],
    /// Reference node positions, shape (frames, N + 1, 3).
    pub truth: npy::Array,
    /// Frame rate of the reference (Hz).
    pub rate_hz: f64,
}

/// Reads the cases whose name passes `wanted`.
pub fn cases(folder: &std::path::Path, wanted: impl Fn(&str) -> bool) -> Vec<Case> {
    let text = std::fs::read_to_string(folder.join("manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&text).unwrap();
    let mut out = Vec::new();
    for case in manifest["cases"].as_array().unwrap() {
        let id = case["id"].as_str().unwrap().to_owned();
        if !wanted(&id) {
            continue;
        }
        let rope = &manifest["ropes"][case["rope"].as_str().unwrap()];
        let motion = &manifest["motions"][case["motion"].as_str().unwrap()];
        let rotvec = motion["initial_joint0_rotvec"].as_array();
        let nodes = std::fs::File::open(folder.join(case["nodes"].as_str().unwrap())).unwrap();
        out.push(Case {
            id,
            rope: rope_of(rope),
            motion: read_poses(&folder.join(motion["pose_csv"].as_str().unwrap())),
            joint0_rotvec: core::array::from_fn(|i| rotvec.map_or(0.0, |v| v[i].as_f64().unwrap())),
            truth: npy::read(nodes).unwrap(),
            rate_hz: case["rate"].as_f64().unwrap(),
        });
    }
    out
}

/// A rope from the JSON form of the reference programs.
pub fn rope_of(json: &serde_json::Value) -> RopeParams {
    let keys = "N L c k r mu m_L r_L link_extra_scale";
    let mut numbers = keys.split(' ').map(|key| json[key].as_f64().unwrap());
    RopeParams::from_array(core::array::from_fn(|_| numbers.next().unwrap()))
}

/// Pose table `t,x,y,z,qw,qx,qy,qz`.
fn read_poses(path: &std::path::Path) -> PoseTrack {
    let text = std::fs::read_to_string(path).unwrap();
    let rows: Vec<PoseRow> = text
        .lines()
        .skip(1)
        .map(|line| {
            let v: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
            PoseRow {
                t_s: v[0],
                p_m: [v[1], v[2], v[3]],
                q_wxyz: [v[4], v[5], v[6], v[7]],
            }
        })
        .collect();
    PoseTrack::new(&rows).unwrap()
}

/// Options for a case in steps of `step_s`: all frames of the reference.
pub fn options_of(case: &Case, step_s: f64) -> SimOptions {
    let count = case.truth.shape[0];
    let horizon_s = (count - 1) as f64 / case.rate_hz;
    SimOptions {
        start: Start::Straight {
            joint0_rotvec: case.joint0_rotvec,
        },
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 1.0 / case.rate_hz,
            count,
        },
        ..SimOptions::new(step_s, Precision::F64, horizon_s)
    }
}

/// Simulates a case in steps of at most `step_s` with one kernel.
pub fn simulate(case: &Case, kernel: Kernel, step_s: f64) -> Rollout {
    // A whole number of steps per frame, as the published figures have it.
    let step_s = 1.0 / (case.rate_hz * (1.0 / (case.rate_hz * step_s)).round());
    let candidate = Candidate::new(&case.rope, &case.motion);
    let options = options_of(case, step_s);
    roll_out_in_with(kernel, &Scene::EMPTY, &[candidate], &options)
        .unwrap()
        .remove(0)
}

/// Largest distance of the tip from the reference over all frames (mm).
pub fn max_tip_error_mm(case: &Case, rollout: &Rollout) -> f64 {
    let [frames, nodes, _] = rollout.nodes.shape();
    assert_eq!(case.truth.shape, [frames, nodes, 3]);
    let mut worst = 0.0_f64;
    for frame in 0..frames {
        let tip = rollout.nodes.position(frame, nodes - 1);
        let at = (frame * nodes + nodes - 1) * 3;
        let d = (0..3)
            .map(|i| (tip[i] - case.truth.values[at + i]).powi(2))
            .sum::<f64>()
            .sqrt();
        // NaN must count as wrong.
        worst = if d > worst || d.is_nan() { d } else { worst };
    }
    worst * 1e3
}
