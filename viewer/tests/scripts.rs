//! What the pages' scripts calculate, in Node. Where there is none, this says so and passes,
//! but not in CI; what the pages draw is looked at in a browser by the tests of `wag`.

#[path = "../../hil-tests/support/missing.rs"]
mod missing;

use std::process::Command;

#[test]
fn the_scripts_of_the_pages_calculate_as_they_should() {
    let test = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/scripts.js");
    let Ok(made) = Command::new("node").arg(test).output() else {
        missing::without("no node on this machine: the pages' scripts were not run");
        return;
    };
    let said = String::from_utf8_lossy(&made.stderr);
    assert!(made.status.success(), "{said}");
}
