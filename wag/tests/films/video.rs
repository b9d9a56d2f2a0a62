//! From a rendered video of another simulator's rope (MuJoCo) to a fling: the identified
//! rope moves like the true one in a motion it was not identified from.

use super::support::{json_in, shared};
use nalgebra::Vector3;
use rope_sim::{Candidate, FrameTimes, PoseTrack, Precision, SimOptions, roll_out};
use run_log::files::read_pose;
use serde_json::Value;
use shared_types::RopeParams;
use std::path::Path;

/// The fling lasts a second; half of one more is held.
const FLING_S: f64 = 1.5;
const RATE_HZ: f64 = 240.0;
/// Extra scale of links that are solid cylinders, as in the videos.
const CYLINDER_SCALE: f64 = 0.913;

fn identified(folder: &Path) -> RopeParams {
    let (dir, folder) = (tempfile::tempdir().unwrap(), folder.display());
    let files = format!("--camera {folder}/camera.toml --pose {folder}/pose.csv --out rope.toml");
    let line = format!("identify --video {folder}/video.avi {files}");
    let report = json_in(dir.path(), &line);
    let [score, limit] =
        ["score", "limit"].map(|key| report["out_of_distribution"][key].as_f64().unwrap());
    assert!(score < limit, "{report}");
    assert_eq!(report["out_of_distribution_score"], score);
    serde_json::from_value(report["rope"].clone()).unwrap()
}

fn truth(folder: &Path) -> RopeParams {
    let text = std::fs::read_to_string(folder.join("truth.json")).unwrap();
    let value: Value = serde_json::from_str(&text).unwrap();
    let number = |key: &str| value["rope"][key].as_f64().unwrap();
    RopeParams {
        links: u32::try_from(value["rope"]["links"].as_u64().unwrap()).unwrap(),
        length_m: number("length_m"),
        joint_damping_nms_per_rad: number("ball_damping_Nms_per_rad"),
        joint_stiffness_nm_per_rad: number("ball_stiffness_Nm_per_rad"),
        radius_m: number("radius_m"),
        mass_per_length_kg_per_m: number("mass_per_length_kg_per_m"),
        lead_mass_kg: number("lead_mass_kg"),
        lead_radius_m: number("lead_radius_m"),
        link_extra_scale: CYLINDER_SCALE,
        extras: None,
    }
}

/// Path of the tip in the fling of the reference trajectories.
fn fling(rope: &RopeParams) -> Vec<Vector3<f64>> {
    let path = shared("reference/rope-truth/pose-M3.csv").unwrap();
    let motion = PoseTrack::new(&read_pose(&path).unwrap()).unwrap();
    let options = SimOptions {
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 1.0 / RATE_HZ,
            count: 360,
        },
        ..SimOptions::new(5e-4, Precision::F64, FLING_S)
    };
    let rollouts = roll_out(&[Candidate::new(rope, &motion)], &options).unwrap();
    let nodes = &rollouts[0].nodes;
    (0..nodes.frames())
        .map(|frame| nodes.position(frame, nodes.nodes() - 1))
        .collect()
}

#[test]
fn ropes_seen_in_videos_are_flung_like_the_true_ones() {
    for name in ["a1", "a2"] {
        let Some(folder) = shared(&format!("data/wiggle/{name}")) else {
            return;
        };
        let (found, truth) = (identified(&folder), truth(&folder));
        let length_off_m = found.length_m - truth.length_m;
        let ratio = |r: &RopeParams| r.lead_mass_kg / r.mass_per_length_kg_per_m;
        let ratio_off = ratio(&found) / ratio(&truth) - 1.0;
        let (a, b) = (fling(&found), fling(&truth));
        let squares = a.iter().zip(&b).map(|(a, b)| (a - b).norm_squared());
        let off_m = (squares.sum::<f64>() / a.len() as f64).sqrt();
        let way = b.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>();
        println!(
            "{name}: length off by {:.2} mm, lead over rope by {:.2} %, fling by {:.1} mm RMS on a way of {way:.1} m",
            1e3 * length_off_m,
            1e2 * ratio_off,
            1e3 * off_m
        );
        assert!(way > 1.0, "the tip must fly");
        assert!(length_off_m.abs() <= 0.015, "{name}: {found:?}");
        assert!(ratio_off.abs() <= 0.20, "{name}: {found:?}");
        assert!(off_m <= 0.02, "{name}: {off_m} m, {found:?}");
    }
}
