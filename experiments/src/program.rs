//! Which program makes a result: kept trials of another would be those of another simulator,
//! planner or tracker.

use anyhow::Context;
use planner::phi::hex;
use sha2::{Digest, Sha256};
use std::path::Path;
use std::sync::OnceLock;

/// Digits of the hash that are kept.
const DIGITS: usize = 16;

/// Version and hash of the running program's file, which changes with the code.
pub(crate) fn program() -> anyhow::Result<String> {
    static HASH: OnceLock<String> = OnceLock::new();
    let hash = match HASH.get() {
        Some(hash) => hash,
        None => {
            // The file that runs, even if another has taken its place since.
            let hash = program_at(Path::new("/proc/self/exe"))?;
            HASH.get_or_init(|| hash)
        }
    };
    Ok(hash.clone())
}

/// The same of a program in a file.
pub(crate) fn program_at(path: &Path) -> anyhow::Result<String> {
    let fail = || format!("the program `{}`", path.display());
    let file = std::fs::read(path).with_context(fail)?;
    let hash = hex(Sha256::digest(file).as_slice());
    Ok(format!("{}-{}", shared_types::VERSION, &hash[..DIGITS]))
}
