//! The score of rendered throws whose tip passes through or close by the target: in the
//! frames that matter, lead and target cover each other.
#![cfg(test)]

use arm_model::Cell;
use arm_model::joint::START_POSE;
use camera_ingest::{StereoFrame, score};
use hil_tests::{for_each_seed, quantile};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rig_sim::CameraConfig;
use rig_sim::render::{Appearance, Renderer, RopeShape, ScenePose};
use shared_types::StereoCamera;

/// Frames of a throw; the tip passes the target in the middle of them.
const FRAMES: u32 = 18;
/// Throws of each set of colours.
const THROWS: u32 = 7;

/// Way of a tip: speed and acceleration at the moment it is nearest to the target.
struct Throw {
    target_m: Vector3<f64>,
    miss_m: Vector3<f64>,
    speed_m_s: Vector3<f64>,
    acceleration_m_s2: Vector3<f64>,
    nearest_s: f64,
}

fn direction(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    loop {
        let v = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
        if let Some(unit) = v.try_normalize(0.1).filter(|_| v.norm() < 1.0) {
            return unit;
        }
    }
}

impl Throw {
    fn random(rng: &mut ChaCha8Rng, period_s: f64) -> Self {
        let heading = direction(rng);
        let sideways = |v: Vector3<f64>| v - heading * v.dot(&heading);
        let miss_m = sideways(direction(rng)).normalize() * rng.random_range(0.0..0.03);
        let bend = sideways(direction(rng)) * rng.random_range(5.0..40.0);
        let slowing = heading * rng.random_range(-8.0..8.0);
        Self {
            target_m: Vector3::new(
                rng.random_range(0.6..0.9),
                rng.random_range(-0.15..0.15),
                rng.random_range(0.1..0.4),
            ),
            miss_m,
            speed_m_s: heading * rng.random_range(1.5..6.0),
            acceleration_m_s2: bend + slowing,
            nearest_s: period_s * (f64::from(FRAMES) / 2.0 + rng.random_range(-1.0..1.0)),
        }
    }

    fn tip(&self, t_s: f64) -> Vector3<f64> {
        let dt = t_s - self.nearest_s;
        self.target_m + self.miss_m + self.speed_m_s * dt + self.acceleration_m_s2 * (dt * dt / 2.0)
    }

    /// Least distance of the tip from the target (m).
    fn closest_m(&self, until_s: f64) -> f64 {
        let steps = 20_000;
        (0..=steps)
            .map(|i| until_s * f64::from(i) / f64::from(steps))
            .map(|t| (self.tip(t) - self.target_m).norm())
            .fold(f64::INFINITY, f64::min)
    }

    /// The rope behind its tip.
    fn pose(&self, t_s: f64) -> ScenePose {
        let tip = self.tip(t_s);
        let back = (Vector3::z() * 2.0 - self.speed_m_s.normalize()).normalize();
        ScenePose {
            q: START_POSE,
            nodes: (0..=10)
                .rev()
                .map(|i| tip + back * (0.05 * f64::from(i)))
                .collect(),
        }
    }

    fn film(
        &self,
        renderer: &mut Renderer,
        config: &CameraConfig,
        camera: &StereoCamera,
    ) -> Vec<StereoFrame> {
        renderer.place_target(Some(self.target_m));
        let mut bytes = vec![0; renderer.frame_bytes()];
        (0..FRAMES)
            .map(|index| {
                let start_s = f64::from(index) / config.frame_rate_hz;
                let at = |part: f64| self.pose(start_s + camera.frame_time_s() * part);
                let count = renderer.sub_frames(&at(0.0), &at(1.0));
                let poses: Vec<ScenePose> = (0..count)
                    .map(|i| at((i as f64 + 0.5) / count as f64))
                    .collect();
                renderer.render(&poses, u64::from(index), &mut bytes);
                let size = [2 * camera.width_px as usize, camera.height_px as usize];
                let stamp_ns = (1e9 * start_s).round() as u64;
                StereoFrame::from_yuyv(&bytes, size, stamp_ns, u64::from(index)).unwrap()
            })
            .collect()
    }
}

/// The score of a throw that was not refused.
struct Scored {
    holds: bool,
    error_m: f64,
    width_m: f64,
}

/// Renders and scores the throws of one seed.
fn scores_of(seed: u64, config: &CameraConfig) -> Vec<Option<Scored>> {
    let camera = config.stereo_camera();
    let appearance = Appearance::from_seed(seed);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let shape = RopeShape {
        radius_m: 0.005,
        lead_radius_m: rng.random_range(0.015..0.045),
    };
    let mut renderer = Renderer::new(
        &camera,
        &Cell::default(),
        shape,
        appearance,
        config.noise_levels,
        seed,
    );
    let mut scored = |index: u32| {
        let throw = Throw::random(&mut rng, 1.0 / config.frame_rate_hz);
        let mut film = throw.film(&mut renderer, config, &camera);
        let truth_m = throw.closest_m(f64::from(FRAMES) / config.frame_rate_hz);
        let colours = (appearance.lead_rgb, appearance.target_rgb);
        let found = score(&mut film, &camera, colours.0, colours.1)
            .inspect_err(|error| println!("seed {seed} throw {index}: {error}"))
            .ok()?;
        let holds = (found.interval_m[0]..=found.interval_m[1]).contains(&truth_m);
        println!(
            "seed {seed} throw {index}: {:.1} mm, truth {:.1} mm, interval {:.1} to {:.1} mm{}",
            1e3 * found.closest_m,
            1e3 * truth_m,
            1e3 * found.interval_m[0],
            1e3 * found.interval_m[1],
            if holds { "" } else { ": missed" }
        );
        Some(Scored {
            holds,
            error_m: (found.closest_m - truth_m).abs(),
            width_m: found.interval_m[1] - found.interval_m[0],
        })
    };
    (0..THROWS).map(&mut scored).collect()
}

/// Renders and scores throws of many colours.
fn assert_intervals_hold(config: &CameraConfig) {
    let long = std::env::var_os("WAG_LONG_TESTS").is_some();
    // The first were looked at while the intervals were made, the others were not.
    let seeds: Vec<u64> = if long { 3000..3020 } else { 100..102 }.collect();
    let throws = for_each_seed(&seeds, |seed| scores_of(seed, config))
        .into_iter()
        .flatten()
        .collect::<Vec<_>>();
    let scores: Vec<&Scored> = throws.iter().flatten().collect();
    let (count, refused) = (scores.len(), throws.len() - scores.len());
    let held = scores.iter().filter(|s| s.holds).count();
    let errors_m: Vec<f64> = scores.iter().map(|s| s.error_m).collect();
    let widths_m: Vec<f64> = scores.iter().map(|s| s.width_m).collect();
    let (error_m, width_m) = (quantile(&errors_m, 0.5), quantile(&widths_m, 0.5));
    println!(
        "{held} of {count} hold the truth; median error {:.1} mm, largest {:.1} mm, median \
         width {:.1} mm",
        1e3 * error_m,
        1e3 * quantile(&errors_m, 1.0),
        1e3 * width_m
    );
    // Two standard errors hold nineteen of twenty, so that one of these few may be
    // missed; and wide enough for everything would be no answer.
    assert!(held as f64 >= 0.9 * count as f64, "{held} of {count}");
    assert!(refused * 10 <= count, "{refused} refused");
    assert!(error_m < 0.015 && width_m < 0.06);
}

#[test]
fn intervals_hold_the_truth_where_lead_and_target_cover_each_other() {
    assert_intervals_hold(&CameraConfig::default());
}

#[test]
fn intervals_hold_the_truth_where_rows_are_exposed_one_after_the_other() {
    assert_intervals_hold(&CameraConfig {
        line_time_s: 26.1e-6,
        ..CameraConfig::default()
    });
}
