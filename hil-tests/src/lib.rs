//! What the tests of the whole system share: the controller and the simulated arm in
//! virtual time, and scenarios of faults.
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

pub mod scenario;
pub mod virtual_rig;
