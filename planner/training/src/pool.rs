//! The pool of simulated ropes: keypoint paths in the world, kept in shards.
//!
//! A shard is a function of the recipe (seed, ropes, wiggle, keypoints) and its
//! number alone: shards can be made in any order, on several machines, and again
//! after an interruption. A shard file begins with the recipe's hash and the path of one
//! rope's tip, by which a shard of another simulator is known, ends with a checksum, and is
//! written whole or not at all. Positions are kept in units of 1/16384 m (61 µm, a fiftieth
//! of a pixel).

use crate::config::DataConfig;
use crate::error::{Result, TrainingError};
use crate::files::{read, sealed, unsealed, write_whole};
use crate::hypercube::{Hypercube, Share};
use planner::observation::ObservedPoints;
use planner::phi::hex;
use planner::synthetic::{KeypointLayout, RecordOptions, RopeFilm, record};
use planner::wiggle::wiggling_arm;
use sha2::{Digest, Sha256};
use shared_types::RopeParams;
use shared_types::rope::ROPE_PARAMETERS;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Ropes in a shard.
pub(crate) const SHARD_ROPES: usize = 1000;
const MAGIC: &[u8; 8] = b"WAGPOOL2";
const UNITS_PER_M: f32 = 16384.0;
/// Bytes of a rope: its parameters, and whether its simulation stayed finite.
const ROPE: usize = 8 * ROPE_PARAMETERS + 1;
/// Places of a tip that tell one simulator from another, uniform in time.
const PROBE_POINTS: usize = 32;
/// Distance in each direction below which they are the same (m). A processor without vectors of
/// single precision simulates in double precision, which ends up to 0.13 mm elsewhere.
const PROBE_TOLERANCE_M: f32 = 2e-4;

/// The tip's path of one rope under the recipe's wiggle (m).
type Probe = [f32; 3 * PROBE_POINTS];

/// What is simulated.
#[derive(Debug, Clone)]
pub(crate) struct Recipe {
    data: DataConfig,
    share: Share,
    options: RecordOptions,
}

impl Recipe {
    /// The recipe of a share of the configured data; `threads` change nothing.
    pub(crate) fn new(data: &DataConfig, share: Share, threads: usize) -> Self {
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
    pub(crate) fn ropes(&self) -> usize {
        match self.share {
            Share::Training => self.data.ropes,
            Share::HeldOut => self.data.held_out,
        }
    }

    /// Number of shards.
    pub(crate) fn shards(&self) -> usize {
        self.ropes().div_ceil(SHARD_ROPES)
    }

    fn range(&self, shard: usize) -> Range<usize> {
        let first = shard * SHARD_ROPES;
        first..(first + SHARD_ROPES).min(self.ropes())
    }

    /// Hash of everything that decides the ropes' motions, but for the simulator: see [`Self::probe`].
    fn hash(&self) -> [u8; 32] {
        let (data, share, version) = (&self.data, self.share, env!("CARGO_PKG_VERSION"));
        let o = &self.options;
        let times = format!("{} {} {}", o.duration_s, o.period_s, o.step_s);
        Sha256::digest(format!("{data:?} {share:?} {times} {version}")).into()
    }

    /// What a shard's file begins with: magic, the recipe's hash, first rope, ropes.
    fn header(&self, shard: usize) -> Vec<u8> {
        let ropes = self.range(shard);
        let numbers = [ropes.start, ropes.len()].map(|n| (n as u32).to_le_bytes());
        [&MAGIC[..], &self.hash(), &numbers.concat()].concat()
    }

    /// What this program's simulator makes of the recipe's first rope.
    fn probe(&self) -> Result<Probe> {
        let arm = wiggling_arm(&self.data.wiggle)?;
        let rope = Hypercube::new(self.data.seed, self.share, self.ropes()).rope(0);
        let options = RecordOptions {
            layout: KeypointLayout::Uniform(2),
            ..self.options
        };
        let films = record(&[rope], &arm, &options)?;
        let path = films.first().map_or(&[][..], |film| &film.positions_m);
        let samples = path.len() / 6;
        Ok(core::array::from_fn(|i| {
            let sample = i / 3 * samples / PROBE_POINTS;
            path.get(6 * sample + 3 + i % 3)
                .copied()
                .unwrap_or(f32::NAN)
        }))
    }

    fn path(&self, folder: &Path, shard: usize) -> PathBuf {
        let share = match self.share {
            Share::Training => "training",
            Share::HeldOut => "held-out",
        };
        folder.join(format!("{share}-{shard:04}.pool"))
    }

    /// Simulates the ropes of a shard.
    pub(crate) fn simulate(&self, shard: usize) -> Result<Pool> {
        let arm = wiggling_arm(&self.data.wiggle)?;
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
    pub(crate) fn make(
        &self,
        folder: &Path,
        shards: Range<usize>,
        progress: &mut dyn FnMut(usize),
    ) -> Result<()> {
        let probe = self.probe()?;
        for shard in shards {
            let path = self.path(folder, shard);
            if self.load_shard(&path, shard, &probe).is_err() {
                let made = self.simulate(shard)?;
                write_whole(&path, &made.to_bytes(self, shard, &probe))?;
            }
            progress(shard);
        }
        Ok(())
    }

    /// Loads all shards.
    pub(crate) fn load(&self, folder: &Path) -> Result<Pool> {
        let (mut pool, probe) = (self.empty(), self.probe()?);
        for shard in 0..self.shards() {
            let path = self.path(folder, shard);
            pool.append(self.load_shard(&path, shard, &probe)?);
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

    fn load_shard(&self, path: &Path, shard: usize, probe: &Probe) -> Result<Pool> {
        let bytes = read(path)?;
        Pool::from_bytes(&bytes, self, shard, probe).map_err(|reason| {
            let reason = format!("{reason}: run `phi-train dataset` again to replace it");
            TrainingError::file(path, reason)
        })
    }
}

/// Ropes with the paths of their keypoints.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pool {
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
    pub(crate) fn len(&self) -> usize {
        self.ropes.len()
    }

    pub(crate) fn rope(&self, index: usize) -> &RopeParams {
        &self.ropes[index].0
    }

    /// Ropes whose simulation blew up; their films are still.
    pub(crate) fn failed(&self) -> usize {
        self.ropes.iter().filter(|(_, finite)| !finite).count()
    }

    /// The paths of a rope; `None` if there is no such rope.
    pub(crate) fn film(&self, index: usize) -> Option<RopeFilm> {
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
    pub(crate) fn sha256(&self) -> String {
        let mut hash = Sha256::new_with_prefix(self.rope_bytes());
        for part in self.positions.chunks(1 << 16) {
            let bytes: Vec<u8> = part.iter().flat_map(|x| x.to_le_bytes()).collect();
            hash.update(&bytes);
        }
        hex(hash.finalize().as_slice())
    }

    /// [`ROPE`] bytes for each rope.
    fn rope_bytes(&self) -> Vec<u8> {
        let bytes = |(rope, finite): &(RopeParams, bool)| {
            let values = rope.to_array().into_iter().flat_map(f64::to_le_bytes);
            values.chain([u8::from(*finite)]).collect::<Vec<u8>>()
        };
        self.ropes.iter().flat_map(bytes).collect()
    }

    fn push(&mut self, film: &RopeFilm) {
        self.ropes.push((film.rope, film.is_finite));
        let unit = |x: &f32| (x * UNITS_PER_M).round() as i16;
        for sample in film.positions_m.chunks_exact(3 * film.keypoints) {
            let filled = self.positions.len() + 3 * self.keypoints;
            self.positions.extend(sample.iter().map(unit));
            self.positions.resize(filled, 0);
        }
    }

    fn append(&mut self, other: Self) {
        self.ropes.extend(other.ropes);
        self.positions.extend(other.positions);
    }

    fn to_bytes(&self, recipe: &Recipe, shard: usize, probe: &Probe) -> Vec<u8> {
        let samples = self.positions.len() / (self.len().max(1) * self.keypoints * 3);
        let mut out = recipe.header(shard);
        out.extend(probe.iter().flat_map(|x| x.to_le_bytes()));
        out.extend(
            [samples, self.keypoints]
                .map(|n| (n as u32).to_le_bytes())
                .concat(),
        );
        out.extend(self.rope_bytes());
        out.extend(self.positions.iter().flat_map(|x| x.to_le_bytes()));
        sealed(out)
    }

    fn from_bytes(
        bytes: &[u8],
        recipe: &Recipe,
        shard: usize,
        probe: &Probe,
    ) -> core::result::Result<Self, &'static str> {
        const CUT: &str = "cut short or damaged";
        let body = unsealed(bytes).ok_or(CUT)?;
        let header = recipe.header(shard);
        if !body.starts_with(&header[..MAGIC.len() + 32]) {
            return Err("made from another configuration");
        }
        let body = body
            .strip_prefix(&header[..])
            .ok_or("another shard under this name")?;
        let (made, body) = body.split_at_checked(4 * probe.len()).ok_or(CUT)?;
        let (made, _) = made.as_chunks::<4>();
        let apart_m = |(made, now): (&[u8; 4], &f32)| (f32::from_le_bytes(*made) - now).abs();
        if !made
            .iter()
            .zip(probe)
            .map(apart_m)
            .all(|m| m < PROBE_TOLERANCE_M)
        {
            return Err("made by another simulator");
        }
        let (sizes, body) = body.split_first_chunk::<8>().ok_or(CUT)?;
        let [samples, keypoints] = [0, 4].map(|i| {
            let number = [sizes[i], sizes[i + 1], sizes[i + 2], sizes[i + 3]];
            u32::from_le_bytes(number) as usize
        });
        let count = recipe.range(shard).len();
        let (ropes, positions) = body.split_at_checked(count * ROPE).ok_or(CUT)?;
        if positions.len() != count * samples * keypoints * 6 || keypoints != recipe.data.keypoints
        {
            return Err(CUT);
        }
        let rope = |bytes: &[u8]| {
            let (values, finite) = bytes.as_chunks::<8>();
            let values = core::array::from_fn(|i| f64::from_le_bytes(values[i]));
            (RopeParams::from_array(values), *finite == [1])
        };
        let (positions, _) = positions.as_chunks::<2>();
        Ok(Self {
            ropes: ropes.chunks_exact(ROPE).map(rope).collect(),
            positions: positions.iter().map(|x| i16::from_le_bytes(*x)).collect(),
            ..recipe.empty()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use planner::wiggle::WiggleConfig;

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
        let folder = tempfile::tempdir().unwrap();
        let recipe = Recipe::new(&data(), Share::Training, 1);
        recipe.make(folder.path(), 0..1, &mut |_| ()).unwrap();
        let pool = recipe.load(folder.path()).unwrap();
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
            assert_eq!(film.keypoints, links);
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
        let folder = tempfile::tempdir().unwrap();
        let recipe = Recipe::new(&data(), Share::HeldOut, 1);
        recipe.make(folder.path(), 0..1, &mut |_| ()).unwrap();
        let path = recipe.path(folder.path(), 0);
        let good = std::fs::read(&path).unwrap();
        let mut bad = good.clone();
        bad[500] ^= 1;
        for wrong in [&bad[..], &good[..good.len() - 7], b"WAG"] {
            std::fs::write(&path, wrong).unwrap();
            let refused = recipe.load(folder.path()).unwrap_err();
            assert!(refused.to_string().contains("dataset"), "{refused}");
        }
        recipe.make(folder.path(), 0..1, &mut |_| ()).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), good);
        let mut foreign = recipe.probe().unwrap();
        foreign[40] += 3e-4;
        let foreign = recipe.simulate(0).unwrap().to_bytes(&recipe, 0, &foreign);
        std::fs::write(&path, foreign).unwrap();
        let refused = recipe.load(folder.path()).unwrap_err().to_string();
        assert!(refused.contains("another simulator"), "{refused}");
        recipe.make(folder.path(), 0..1, &mut |_| ()).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), good);
        let other = DataConfig { seed: 5, ..data() };
        let refused = Recipe::new(&other, Share::HeldOut, 1).load(folder.path());
        assert!(
            refused
                .unwrap_err()
                .to_string()
                .contains("another configuration")
        );
    }
}
