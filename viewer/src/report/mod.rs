//! A run as one HTML file that asks nobody for anything: made of what lies in the
//! run folder, the same bytes every time.
//!
//! What a folder does not hold is left out and said to be; what it holds and is
//! wrong is an error that names the file. Everything from the run travels as one
//! block of JSON, which the page's script puts in as text, never as markup.

mod approach;
mod data;
mod headline;
mod latency;
mod limits;
mod names;
mod page;
mod pictures;
mod planned;
mod read;
mod replay;

pub use data::{Histogram, RopeRow};
pub use latency::histogram;
pub use limits::LimitRow;
pub use page::{PLOTS, STYLE, VIEW};
pub use planned::PlannedMotion;
pub use read::{headline_of, rope_rows, simulated_rope};
pub use replay::{arm_points, tenths_mm};

use anyhow::ensure;
use page::SIZE_MAX_BYTES;
use run_log::{CellHere, files};
use std::path::{Path, PathBuf};

/// A run's report in its folder.
pub(crate) const REPORT: &str = "report.html";

/// A report that was written.
#[derive(Debug)]
pub struct Written {
    /// Where.
    pub path: PathBuf,
    /// Its size.
    pub bytes: usize,
    /// What the run folder does not hold.
    pub missing: Vec<String>,
}

/// Makes the report of a run folder and writes it to `out`, by default into the
/// folder. `here` is the cell of a run that does not tell its own.
///
/// # Errors
/// The run is no folder of a run, one of its files is wrong, or the report cannot be
/// written.
pub fn write(run: &Path, out: Option<&Path>, here: &CellHere) -> anyhow::Result<Written> {
    let data = read::read_run(run, here)?;
    let html = page::page(&data)?;
    ensure!(
        html.len() <= SIZE_MAX_BYTES,
        "the report of `{}` would have {} bytes, more than {SIZE_MAX_BYTES}; take out pictures",
        run.display(),
        html.len()
    );
    let path = out.map_or_else(|| run.join(REPORT), Path::to_owned);
    files::write_atomic(&path, html.as_bytes())?;
    Ok(Written {
        path,
        bytes: html.len(),
        missing: data.missing,
    })
}
