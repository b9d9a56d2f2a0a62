//! Runs as tables and arrays, and as bags where the build has them: their values as the published
//! libraries read them, what is refused, and what is left behind.
#![cfg(test)]

#[path = "../../../hil-tests/support/exports.rs"]
mod exports;
#[path = "../../../hil-tests/support/missing.rs"]
mod missing;

#[cfg(feature = "ros2")]
mod bag;
mod small;

use run_export::{Write, csv, npz};
use run_log::files;
use std::fs;
use std::path::Path;

/// What an export that must fail as wrong input says.
fn refused(write: Write, run: &Path, out: &Path) -> String {
    let failure = write(run, Some(out)).unwrap_err();
    assert_eq!(failure.exit_code(), 2, "{failure}");
    failure.to_string()
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Cuts the run's file off at the record that ends the data, which lies before the index.
fn break_off(run: &Path) {
    let path = run.join(files::RUN);
    let bytes = fs::read(&path).unwrap();
    let index = u64::from_le_bytes(*bytes[bytes.len() - 28..].first_chunk().unwrap());
    fs::write(&path, &bytes[..usize::try_from(index).unwrap() - 5]).unwrap();
}

#[test]
fn other_libraries_find_the_values_of_the_run() {
    let place = tempfile::tempdir().unwrap();
    let run = place.path().join("run");
    small::write(&run);
    let before = names_in(&run);
    let written = [csv, npz].map(|write: Write| write(&run, None).unwrap());
    let count = |of: usize| written[of].files[0].count;
    assert_eq!([count(0), count(1)], [small::CYCLES, 38]);
    assert!(written.iter().all(|written| written.missing.is_empty()));
    // The same run makes the same bytes, also in place of what was there.
    let once = fs::read(run.join("run.npz")).unwrap();
    npz(&run, None).unwrap();
    assert!(fs::read(run.join("run.npz")).unwrap() == once);
    let exported = ["cycles.csv", "joints.csv", "run.npz"].map(str::to_owned);
    let mut all = [before, exported.to_vec()].concat();
    all.sort();
    assert_eq!(names_in(&run), all);
    exports::agree(&run, &[]);
}

#[test]
fn what_is_no_earlier_export_is_not_replaced_and_nothing_is_left() {
    let place = tempfile::tempdir().unwrap();
    let run = place.path().join("run");
    small::write(&run);
    // No file, and no place for one.
    assert!(refused(npz, &run, place.path()).contains("it is a folder"));
    let under_a_file = run.join(files::RUN).join("a.npz");
    assert!(refused(npz, &run, &under_a_file).contains(files::RUN));
    // The run's own recording, and what others wrote.
    let before = fs::read(run.join(files::RUN)).unwrap();
    refused(npz, &run, &run.join(files::RUN));
    assert!(fs::read(run.join(files::RUN)).unwrap() == before);
    fs::write(place.path().join("mine.npz"), "PK\u{3}\u{4} of mine").unwrap();
    refused(npz, &run, &place.path().join("mine.npz"));
    assert_eq!(names_in(place.path()), ["mine.npz", "run"]);
}

#[test]
fn a_run_that_breaks_off_is_exported_as_far_as_it_goes() {
    let place = tempfile::tempdir().unwrap();
    let run = place.path().join("run");
    small::write(&run);
    break_off(&run);
    for write in [csv, npz] {
        let told = write(&run, None).unwrap().missing;
        assert!(
            matches!(&told[..], [only] if only.contains("breaks off")),
            "{told:?}"
        );
    }
}
