//! `wag sim rope`: where a rope starts.

use super::files::ROPE;
use super::support::json_in;

/// From a tilted attach frame that holds still a rope falls where it starts straight, and stays
/// where it starts hanging.
#[test]
fn a_rope_that_starts_hanging_hangs_still() {
    let dir = tempfile::tempdir().unwrap();
    let (w, y) = (0.25_f64.cos(), 0.25_f64.sin());
    let row = |i: usize| format!("\n{},0,0,1,{w},0,{y},0", 0.05 * i as f64);
    let pose: String = (0..12).map(row).collect();
    let put = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    put("pose.csv", &format!("t,x,y,z,qw,qx,qy,qz{pose}"));
    put("rope.toml", ROPE);
    let speed_m_s = |more: &str| {
        let line = format!("sim rope --rope rope.toml --pose pose.csv --fps 60 --out o.npy {more}");
        let told = json_in(dir.path(), &line);
        told["peak_tip_speed_m_s"].as_f64().unwrap()
    };
    let (falling, hanging) = (speed_m_s(""), speed_m_s("--hanging"));
    assert!(falling > 0.5 && hanging < 1e-3, "{falling} {hanging} m/s");
}
