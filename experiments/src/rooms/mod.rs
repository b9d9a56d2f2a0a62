//! `experiments rooms` and `experiments track-rooms`: wiggles filmed in drawn rooms, and
//! how the tracker fares with them.

mod fate;
mod folder;
mod score;
mod side_by_side;
mod summary;
pub mod track;

use crate::args::{KindName, RoomsArgs};
use cli_output::{OrInput, Outcome, Stage};
use rig_sim::room::Kind;
use serde_json::{Value, json};
use side_by_side::each;
use std::path::{Path, PathBuf};

impl From<KindName> for Kind {
    fn from(name: KindName) -> Self {
        match name {
            KindName::Ordinary => Self::Ordinary,
            KindName::Hard => Self::Hard,
        }
    }
}

/// Folder of a seed's film.
fn folder_of(out: &Path, kind: Kind, seed: u64) -> PathBuf {
    out.join(format!("{}-{seed}", kind.name()))
}

/// Renders films. The value is what `--json` prints.
pub fn run(args: &RoomsArgs) -> Outcome<Option<Value>> {
    let kind = Kind::from(args.kind);
    let stage = Stage::begin("rooms");
    let seeds: Vec<u64> = args.seeds.clone().collect();
    each(&seeds, args.threads, |seed| {
        folder::write(&folder_of(&args.out, kind, seed), seed, kind)
    })
    .or_failed()?;
    let seconds = stage.done(&format!(
        "{} films in `{}`",
        seeds.len(),
        args.out.display()
    ));
    Ok(Some(json!({
        "ok": true, "command": "rooms", "kind": kind, "films": seeds.len(),
        "out": args.out, "seconds": seconds,
    })))
}
