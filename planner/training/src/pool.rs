//! The pool of simulated ropes: keypoint paths in the world, kept in shards.
//!
//! A shard is a function of the recipe (seed, ropes, wiggle, keypoints) and its
//! number alone: shards can be made in any order, on several machines, and again
//! after an interruption. A shard file begins with the recipe's hash and ends with
//! a checksum, and is written whole or not at all. Positions are kept in units of
//! 1/16384 m (61 µm, a fiftieth of a pixel).

use crate::TrainingError;
use crate::config::DataConfig;
use crate::files::{read, write_whole};
use crate::hypercube::{Hypercube, Share};
use arm_model::Limits;
use arm_model::Pole;
use planner::observation::ObservedPoints;
use planner::phi::hex;
use planner::synthetic::{KeypointLayout, RecordOptions, RopeFilm, record};
use planner::wiggle::wiggle;
use rope_sim::PlannedArm;
use sha2::{Digest, Sha256};
use shared_types::RopeParams;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Ropes in a shard.
pub const SHARD_ROPES: usize = 1000;
const MAGIC: &[u8; 8] = b"WAGPOOL1";
const UNITS_PER_M: f32 = 16384.0;
/// Bytes before the ropes: magic, recipe, first rope, ropes, samples, keypoints.
const HEADER: usize = 8 + 32 + 4 * 4;

/// What is simulated.
#[derive(Debug, Clone)]
pub struct Recipe {
    data: DataConfig,
    share: Share,
    options: RecordOptions,
}

impl Recipe {
    /// The recipe of a share of the configured data; `threads` change nothing.
    #[must_use]
    pub fn new(data: &DataConfig, share: Share, threads: usize) -> Self {
        let layout = match data.points {
            ObservedPoints::ArcLength => KeypointLayout::Uniform(data.keypoints),
            ObservedPoints::LinkCentres => KeypointLayout::LinkCentres,
        };
        Self {
            data: data.clone(),
            share,
            options: RecordOptions {
                duration_s: data.wiggle.filmed_s + 0.1,
                ..RecordOptions::for_training(layout, threads)
            },
        }
    }

    /// Number of ropes.
    #[must_use]
    pub fn ropes(&self) -> usize {
        match self.share {
            Share::Training => self.data.ropes,
            Share::HeldOut => self.data.held_out,
        }
    }

    /// Number of shards.
    #[must_use]
    pub fn shards(&self) -> usize {
        self.ropes().div_ceil(SHARD_ROPES)
    }

    fn range(&self, shard: usize) -> Range<usize> {
        let first = shard * SHARD_ROPES;
        first..(first + SHARD_ROPES).min(self.ropes())
    }

    /// Hash of everything that decides the ropes' motions, but for the simulator.
    fn hash(&self) -> [u8; 32] {
        let RecordOptions {
            duration_s,
            period_s,
            step_s,
            ..
        } = self.options;
        let text = format!(
            "{:?} {:?} {duration_s} {period_s} {step_s} {}",
            self.data,
            self.share,
            env!("CARGO_PKG_VERSION")
        );
        Sha256::digest(text.as_bytes()).into()
    }

    fn path(&self, folder: &Path, shard: usize) -> PathBuf {
        let share = match self.share {
            Share::Training => "training",
            Share::HeldOut => "held-out",
        };
        folder.join(format!("{share}-{shard:04}.pool"))
    }

    /// Simulates the ropes of a shard.
    ///
    /// # Errors
    /// A wiggle that cannot be executed, or what the simulator refuses.
    pub fn simulate(&self, shard: usize) -> Result<Pool, TrainingError> {
        let arm = PlannedArm::new(
            wiggle(&self.data.wiggle, &Limits::default())?,
            Pole::default(),
        );
        let cube = Hypercube::new(self.data.seed, self.share, self.ropes());
        let ropes: Vec<RopeParams> = self.range(shard).map(|i| cube.rope(i)).collect();
        let mut pool = self.empty();
        // Enough at once to fill the simulator's lanes with ropes of each link
        // count.
        for part in ropes.chunks(250) {
            for film in record(part, &arm, &self.options)? {
                pool.push(&film);
            }
        }
        Ok(pool)
    }

    /// Makes the shards that are not in the folder yet; tells each.
    ///
    /// # Errors
    /// A shard that cannot be simulated or written.
    pub fn make(
        &self,
        folder: &Path,
        shards: Range<usize>,
        progress: &mut dyn FnMut(usize),
    ) -> Result<(), TrainingError> {
        for shard in shards {
            let path = self.path(folder, shard);
            if self.load_shard(&path, shard).is_err() {
                let bytes = self.simulate(shard)?.to_bytes(self, shard);
                write_whole(&path, &bytes)?;
            }
            progress(shard);
        }
        Ok(())
    }

    /// Loads all shards.
    ///
    /// # Errors
    /// A shard that is missing, damaged, or of another recipe.
    pub fn load(&self, folder: &Path) -> Result<Pool, TrainingError> {
        let mut pool = self.empty();
        for shard in 0..self.shards() {
            let path = self.path(folder, shard);
            pool.append(self.load_shard(&path, shard)?);
        }
        Ok(pool)
    }

    fn empty(&self) -> Pool {
        Pool {
            keypoints: self.data.keypoints,
            points: self.data.points,
            period_s: self.options.period_s,
            ropes: Vec::new(),
            positions: Vec::new(),
        }
    }

    fn load_shard(&self, path: &Path, shard: usize) -> Result<Pool, TrainingError> {
        let bytes = read(path)?;
        Pool::from_bytes(&bytes, self, shard).map_err(|reason| {
            let reason = format!("{reason}: run `phi-train dataset` again to replace it");
            TrainingError::bad_file(path, reason)
        })
    }
}

/// Ropes with the paths of their keypoints.
#[derive(Debug, Clone, PartialEq)]
pub struct Pool {
    keypoints: usize,
    points: ObservedPoints,
    period_s: f64,
    /// Ropes, each with whether its simulation stayed finite.
    ropes: Vec<(RopeParams, bool)>,
    /// Rope by rope, sample by sample, keypoint by keypoint, x y z; zeros for links that
    /// a rope does not have.
    positions: Vec<i16>,
}

impl Pool {
    /// Number of ropes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ropes.len()
    }

    /// Whether there is no rope.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ropes.is_empty()
    }

    /// Parameters of a rope.
    ///
    /// # Panics
    /// If there is no such rope, as indexing does.
    #[must_use]
    pub fn rope(&self, index: usize) -> &RopeParams {
        &self.ropes[index].0
    }

    /// Ropes whose simulation blew up; their films are still.
    #[must_use]
    pub fn failed(&self) -> usize {
        self.ropes.iter().filter(|(_, finite)| !finite).count()
    }

    /// The paths of a rope; `None` if there is no such rope.
    #[must_use]
    pub fn film(&self, index: usize) -> Option<RopeFilm> {
        let each = self.positions.len() / self.len().max(1);
        let positions = self.positions.get(index * each..(index + 1) * each)?;
        let rope = self.ropes[index].0;
        let keypoints = match self.points {
            ObservedPoints::ArcLength => self.keypoints,
            ObservedPoints::LinkCentres => self.keypoints.min(rope.links as usize),
        };
        let positions = positions
            .chunks_exact(3 * self.keypoints)
            .flat_map(|sample| &sample[..3 * keypoints])
            .map(|x| f32::from(*x) / UNITS_PER_M);
        RopeFilm::from_positions(rope, self.period_s, keypoints, positions.collect())
    }

    /// Hash of all ropes and motions (SHA-256, hexadecimal).
    #[must_use]
    pub fn sha256(&self) -> String {
        let mut hash = Sha256::new();
        for (rope, finite) in &self.ropes {
            for value in rope.to_array() {
                hash.update(value.to_le_bytes());
            }
            hash.update([u8::from(*finite)]);
        }
        for part in self.positions.chunks(1 << 16) {
            let bytes: Vec<u8> = part.iter().flat_map(|x| x.to_le_bytes()).collect();
            hash.update(&bytes);
        }
        hex(hash.finalize().as_slice())
    }

    fn push(&mut self, film: &RopeFilm) {
        self.ropes.push((*film.rope(), film.is_finite()));
        let unit = |x: &f32| (x * UNITS_PER_M).round() as i16;
        for sample in film.positions_m().chunks_exact(3 * film.keypoints()) {
            let filled = self.positions.len() + 3 * self.keypoints;
            self.positions.extend(sample.iter().map(unit));
            self.positions.resize(filled, 0);
        }
    }

    fn append(&mut self, other: Self) {
        self.ropes.extend(other.ropes);
        self.positions.extend(other.positions);
    }

    fn to_bytes(&self, recipe: &Recipe, shard: usize) -> Vec<u8> {
        let samples = self.positions.len() / (self.len().max(1) * self.keypoints * 3);
        let mut out = Vec::with_capacity(HEADER + self.len() * 73 + self.positions.len() * 2 + 4);
        out.extend_from_slice(MAGIC);
        out.extend_from_slice(&recipe.hash());
        let first = recipe.range(shard).start;
        for number in [first, self.len(), samples, self.keypoints] {
            out.extend_from_slice(&(number as u32).to_le_bytes());
        }
        for (rope, finite) in &self.ropes {
            for value in rope.to_array() {
                out.extend_from_slice(&value.to_le_bytes());
            }
            out.push(u8::from(*finite));
        }
        out.extend(self.positions.iter().flat_map(|x| x.to_le_bytes()));
        let checksum = crc32fast::hash(&out);
        out.extend_from_slice(&checksum.to_le_bytes());
        out
    }

    fn from_bytes(bytes: &[u8], recipe: &Recipe, shard: usize) -> Result<Self, &'static str> {
        const CUT: &str = "cut short or damaged";
        let (body, checksum) = bytes.split_last_chunk::<4>().ok_or(CUT)?;
        if crc32fast::hash(body) != u32::from_le_bytes(*checksum) {
            return Err(CUT);
        }
        let (magic, body) = body.split_first_chunk::<8>().ok_or(CUT)?;
        let (hash, body) = body.split_first_chunk::<32>().ok_or(CUT)?;
        if magic != MAGIC || *hash != recipe.hash() {
            return Err("made from another configuration");
        }
        let (numbers, body) = body.split_first_chunk::<16>().ok_or(CUT)?;
        let number = |i: usize| {
            let at = &numbers[4 * i..4 * i + 4];
            u32::from_le_bytes([at[0], at[1], at[2], at[3]]) as usize
        };
        let (first, count, samples, keypoints) = (number(0), number(1), number(2), number(3));
        if first != recipe.range(shard).start || count != recipe.range(shard).len() {
            return Err("another shard under this name");
        }
        let (ropes, positions) = body.split_at_checked(count * 73).ok_or(CUT)?;
        if positions.len() != count * samples * keypoints * 6 || keypoints != recipe.data.keypoints
        {
            return Err(CUT);
        }
        let ropes = ropes
            .chunks_exact(73)
            .map(|rope| {
                let value = |i: usize| {
                    let mut bytes = [0; 8];
                    bytes.copy_from_slice(&rope[8 * i..8 * i + 8]);
                    f64::from_le_bytes(bytes)
                };
                let rope_params = RopeParams::from_array(core::array::from_fn(value));
                (rope_params, rope[72] == 1)
            })
            .collect();
        Ok(Self {
            ropes,
            positions: positions
                .chunks_exact(2)
                .map(|x| i16::from_le_bytes([x[0], x[1]]))
                .collect(),
            ..recipe.empty()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use planner::wiggle::WiggleConfig;

    /// A folder of this test's own, empty at first.
    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("phi-pool-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        folder
    }

    fn data() -> DataConfig {
        DataConfig {
            seed: 4,
            ropes: 6,
            held_out: 3,
            keypoints: 5,
            points: ObservedPoints::ArcLength,
            wiggle: WiggleConfig::default(),
        }
    }

    #[test]
    fn a_pool_is_the_same_made_again_or_by_more_threads() {
        let folder = folder("same");
        let recipe = Recipe::new(&data(), Share::Training, 1);
        recipe.make(&folder, 0..1, &mut |_| ()).unwrap();
        let pool = recipe.load(&folder).unwrap();
        let again = Recipe::new(&data(), Share::Training, 2)
            .simulate(0)
            .unwrap();
        assert_eq!(pool, again);
        assert_eq!(pool.sha256(), again.sha256());
        assert_eq!((pool.len(), pool.failed()), (6, 0));
        let film = pool.film(2).unwrap();
        let hanging = film.position(0.0, 0) - film.position(0.0, 4);
        assert!((hanging.norm() - pool.rope(2).length_m).abs() < 1e-3);
        assert!(pool.film(6).is_none());
        let held_out = Recipe::new(&data(), Share::HeldOut, 1).simulate(0).unwrap();
        assert_ne!(held_out.rope(0), pool.rope(0));
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn link_centres_are_kept_as_many_as_a_rope_has() {
        let data = DataConfig {
            keypoints: 26,
            points: ObservedPoints::LinkCentres,
            ..data()
        };
        let pool = Recipe::new(&data, Share::Training, 1).simulate(0).unwrap();
        let mut counts = Vec::new();
        for i in 0..pool.len() {
            let (rope, film) = (*pool.rope(i), pool.film(i).unwrap());
            let links = rope.links as usize;
            assert_eq!(film.keypoints(), links);
            let hanging = film.position(0.0, 0) - film.position(0.0, links - 1);
            let between = rope.length_m * (1.0 - 1.0 / f64::from(rope.links));
            assert!((hanging.norm() - between).abs() < 1e-3);
            counts.push(links);
        }
        counts.dedup();
        assert!(counts.len() > 1, "{counts:?}");
    }

    #[test]
    fn damaged_and_foreign_shards_are_refused_and_made_again() {
        let folder = folder("damaged");
        let recipe = Recipe::new(&data(), Share::HeldOut, 1);
        recipe.make(&folder, 0..1, &mut |_| ()).unwrap();
        let path = recipe.path(&folder, 0);
        let good = std::fs::read(&path).unwrap();
        let mut bad = good.clone();
        bad[500] ^= 1;
        for wrong in [&bad[..], &good[..good.len() - 7], b"WAG"] {
            std::fs::write(&path, wrong).unwrap();
            let refused = recipe.load(&folder).unwrap_err();
            assert!(refused.to_string().contains("dataset"), "{refused}");
        }
        recipe.make(&folder, 0..1, &mut |_| ()).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), good);
        let other = DataConfig { seed: 5, ..data() };
        let refused = Recipe::new(&other, Share::HeldOut, 1).load(&folder);
        assert!(
            refused
                .unwrap_err()
                .to_string()
                .contains("another configuration")
        );
        std::fs::remove_dir_all(folder).unwrap();
    }
}
