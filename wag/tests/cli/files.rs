//! The files that the cases name.

use super::support::plan_json;
use arm_model::JointTrajectory;
use arm_model::joint::START_POSE;
use shared_types::RopeParams;
use std::fs;

/// A network that reads what no camera shows.
pub(crate) const LINKS: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../configs/models/phi-nn-links.onnx"
);

pub(crate) const ROPE: &str = "links = 23\nlength_m = 0.55\njoint_damping_nms_per_rad = 0.006\n\
    joint_stiffness_nm_per_rad = 0.15\nradius_m = 0.0055\nmass_per_length_kg_per_m = 0.05\n\
    lead_mass_kg = 0.05\nlead_radius_m = 0.02\nlink_extra_scale = 1.0\n";

fn pose_csv() -> String {
    let mut text = "t,x,y,z,qw,qx,qy,qz\n".to_owned();
    for i in 0..200 {
        text.push_str(&format!("{:.3},0,0,1,1,0,0,0\n", f64::from(i) * 1e-3));
    }
    text
}

/// A folder with files of all kinds, most of them wrong.
pub(crate) fn prepare() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| fs::write(dir.path().join(name), text).unwrap();
    put("rope.toml", ROPE);
    for (name, value, wrong) in [
        ("negative.toml", "mass_kg = 0.05", "mass_kg = -0.05"),
        ("zero.toml", "links = 23", "links = 0"),
        ("missing.toml", "length_m = 0.55\n", ""),
        ("nan.toml", "radius_m = 0.0055", "radius_m = nan"),
    ] {
        put(name, &ROPE.replace(value, wrong));
    }
    put("unknown.toml", &format!("{ROPE}wibble = 3\n"));
    let unconfirmed = "[fit]\ndoubts = [\"the rope's end is not confirmed\"]\n";
    put("unconfirmed.toml", &format!("{ROPE}{unconfirmed}"));
    let (rope, here) = (toml::from_str::<RopeParams>(ROPE).unwrap(), START_POSE);
    let still = JointTrajectory::new(&[0.0, 1.0], &[here, here]).unwrap();
    let mut unconfirmed = plan_json(&still, &rope);
    unconfirmed["unconfirmed"] = ["the rope's end is not confirmed"].into();
    put("unconfirmed.json", &unconfirmed.to_string());
    put("pose.csv", &pose_csv());
    for (name, row, wrong) in [
        ("nan.csv", "0.010,0,", "0.010,nan,"),
        ("unsorted.csv", "0.010,0,", "0.001,0,"),
        ("noquat.csv", "0.010,0,0,1,1,", "0.010,0,0,1,3,"),
    ] {
        put(name, &pose_csv().replace(row, wrong));
    }
    put("short.csv", "t,x,y,z,qw,qx,qy,qz\n0,0,0,1,1,0,0,0\n");
    put("columns.csv", "t,x,y\n0,0,0\n");
    put("text.toml", "this is not toml");
    put("damaged.json", "{\"version\": ");
    put(
        "notvideo.avi",
        "RIFF but not really, and long enough for a header",
    );
    put("empty.bin", "");
    fs::write(dir.path().join("bare.mcap"), b"\x89MCAP0\r\n").unwrap();
    put("cut.bin", "WAGR\u{1}\0\u{1}\0");
    put("other.bin", &format!("WAGR\u{9}{}", "\0".repeat(40)));
    put("camera.toml", "calibration = \"none.conf\"\n");
    put("limits.toml", "rate_hz = -250\n");
    put("degrees.toml", "pose_rad = [0, 0, 0, 90, 0, 60, 0]\n");
    put("mm.toml", "tcp_speed_max_m_s = 900\n");
    put("slip.toml", "tcp_sped_max_m_s = 0.5\n");
    let stuck = "[[fault]]\nat_s = 1\nkind = \"joint_stuck\"\njoint = 9\n";
    put("faults.toml", stuck);
    let camera = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/camera/");
    let bright = fs::read_to_string(format!("{camera}example.toml")).unwrap();
    let bright = bright.replace("example.conf", &format!("{camera}example.conf"));
    put(
        "bright.toml",
        &format!("{bright}\n[live]\nexposure_raw = 5000\n"),
    );
    dir
}
