//! Tables of joints and poses in CSV.

use crate::folder;
use run_log::files::{read_joints, read_pose, write_joints};

/// Reads `data` as both; joints that were read can be written.
pub fn run(data: &[u8]) {
    let path = folder().join("table.csv");
    std::fs::write(&path, data).expect("a table");
    if let Ok(joints) = read_joints(&path) {
        let rows = || joints.times_s.iter().copied().zip(joints.q.iter().copied());
        write_joints(&path, rows()).expect("what was read is written");
        // Times are written to the microsecond.
        if joints.times_s.windows(2).all(|t| t[1] - t[0] > 2e-6) {
            let again = read_joints(&path).expect("what was written is read");
            for ((_, q), again) in rows().zip(&again.q) {
                assert!(q.zip_with(*again, |a, b| a - b).max_abs() < 1e-9);
            }
        }
    }
    if let Ok(rows) = read_pose(&path) {
        assert!(rows.is_sorted_by(|a, b| a.t_s < b.t_s));
    }
}

/// Both as we write them, and with a column more.
pub fn seeds() -> Vec<Vec<u8>> {
    [
        "t,q1,q2,q3,q4,q5,q6,q7\n0,0,0,0,1.5,0,1.5,0\n0.004,0.001,0,0,1.5,0,1.5,1e-3\n",
        "t,x,y,z,qw,qx,qy,qz\n0,0.4,0,0.5,1,0,0,0\n0.01,0.4,0,0.5,0.6,0.8,0,0\n",
        "t,q1,q2,q3,q4,q5,q6,q7,note\n-1, 0,0,0,0,0,0,0,\"a\"\n1, 0,0,0,0,0,0,-0.5,\"b,c\"\n",
    ]
    .map(|text| text.as_bytes().to_vec())
    .to_vec()
}
