//! Prints a checksum over everything the control core answers in a seeded run
//! with faults, so that builds can be compared: the same number from every one.
//!
//! Release and debug builds are compared before every change is taken in.

#[path = "../tests/recording/random_run.rs"]
mod random_run;

fn main() {
    let recording = random_run::record_run(11, 20_000);
    println!("{:08x}", crc32fast::hash(&recording));
}
