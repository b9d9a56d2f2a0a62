//! Settings of the arm that decide how it moves and when it stops by itself: read at every
//! bring-up and compared with what the laboratory configured.
//!
//! They are changed with the vendor's tool, by other programs and by a reset, and nothing
//! says so later: an arm that compensates no load bends its path and stops with C31 in the
//! middle of a throw, one with sensitivity 0 does not stop when it hits somebody.

use crate::xarm::Command;
use crate::xarm::report::{NormalReport, RichReport};
use core::ops::RangeInclusive;
use serde::{Deserialize, Serialize};

/// Loads of an xArm 7 (kg), as its manual says.
const LOADS_KG: RangeInclusive<f64> = 0.0..=3.5;
/// Loads closer than this are equal (kg).
const LOAD_EQUAL_KG: f64 = 0.01;
/// Centres of mass closer than this are equal (m).
const CENTRE_EQUAL_M: f64 = 0.005;
/// Farthest centre of mass from the flange (m).
const CENTRE_MAX_M: f64 = 0.5;
/// The arm stands upright when gravity is closer to (0, 0, -1) than this: 1 degree.
const UPRIGHT: f64 = 0.0175;

/// What the arm compensates at its flange: pole, holder and rope.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Mass (kg).
    pub mass_kg: f64,
    /// Its centre in the flange frame (m).
    pub centre_m: [f64; 3],
}

/// What the arm must be set to; table `[arm_settings]` of the controller's file. What is
/// left out is read and reported, and refused only where no throw would be safe.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ArmSettings {
    /// Load. Absent: any but none, where the limits have a tool.
    pub load: Option<Load>,
    /// Collision sensitivity, 0 (off) to 5. Absent: any but off.
    pub collision_sensitivity: Option<u8>,
    /// Whether the arm stops before it touches itself. Absent: either.
    pub self_collision: Option<bool>,
    /// Whether the arm's safety boundary is on. Absent: either.
    pub fence: Option<bool>,
}

/// A setting of the arm that is not as it must be.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// What was found, what it must be, and what to do.
    pub message: String,
    /// The command that sets it, where there is one.
    pub mend: Option<Command>,
}

impl ArmSettings {
    /// The first value that no arm can be set to: its key, the value, what is allowed.
    pub(crate) fn impossible(&self) -> Option<(&'static str, f64, &'static str)> {
        let mass_kg = self.load.map(|load| load.mass_kg);
        let mass_kg = mass_kg
            .filter(|kg| !LOADS_KG.contains(kg))
            .map(|kg| ("arm_settings.load.mass_kg", kg, "0 to 3.5 kg"));
        let centre_m = self.load.into_iter().flat_map(|load| load.centre_m);
        let allowed_m = "-0.5 to 0.5 m each (metres, not millimetres)";
        let mut centre_m = centre_m
            .filter(|m| !(-CENTRE_MAX_M..=CENTRE_MAX_M).contains(m))
            .map(|m| ("arm_settings.load.centre_m", m, allowed_m));
        let key = "arm_settings.collision_sensitivity";
        let level = self.collision_sensitivity.filter(|level| *level > 5);
        let level = level.map(|level| (key, level.into(), "0 (off) to 5"));
        mass_kg.or_else(|| centre_m.next()).or(level)
    }

    /// What is not as it must be in an arm whose tool centre point is `tool_m` from its
    /// flange. Older firmware has no `rich` report.
    #[must_use]
    pub fn differences(
        &self,
        normal: &NormalReport,
        rich: Option<&RichReport>,
        tool_m: [f64; 3],
    ) -> Vec<Difference> {
        let mut found = Vec::new();
        let mut differ = |message: String, mend: Option<Command>| {
            found.push(Difference { message, mend });
        };
        if let Some((message, mend)) = self.load_difference(normal, tool_m) {
            differ(message, mend);
        }
        let level = normal.collision_sensitivity;
        match self.collision_sensitivity {
            Some(wanted) if wanted != level => differ(
                format!(
                    "the arm's collision sensitivity is {level}, the configuration says {wanted}"
                ),
                Some(Command::CollisionSensitivity(wanted)),
            ),
            None if level == 0 => differ(
                "the arm's collision detection is off (sensitivity 0): switch it on with the vendor's tool, or allow it with `arm_settings.collision_sensitivity = 0`".to_owned(),
                None,
            ),
            _ => {}
        }
        let upright = [0.0, 0.0, -1.0];
        let norm = normal.gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
        if !near(&normal.gravity.map(|g| g / norm), &upright, UPRIGHT) {
            let message = format!(
                "the arm is set for gravity along {:.3?} in its base frame, throws are planned for an upright arm {upright:?}: set its mounting with the vendor's tool",
                normal.gravity
            );
            differ(message, None);
        }
        let Some(rich) = rich else {
            let message = "the arm's reports do not say whether reduced mode, self-collision check and safety boundary are on: use the rich report (port 30002) of firmware 2.4 or newer";
            differ(message.to_owned(), None);
            return found;
        };
        for (what, key, wanted, is_on) in [
            (
                "self-collision check",
                "self_collision",
                self.self_collision,
                rich.self_collision,
            ),
            ("safety boundary", "fence", self.fence, rich.fence),
        ] {
            if let Some(wanted) = wanted.filter(|wanted| *wanted != is_on) {
                let message = format!(
                    "the arm's {what} is {}, `arm_settings.{key}` says {}: set one to the other, the arm with the vendor's tool",
                    on(is_on),
                    on(wanted)
                );
                differ(message, None);
            }
        }
        if rich.reduced {
            let message = "the arm is in reduced mode, which limits speeds and joint ranges on its own: switch it off with the vendor's tool";
            differ(message.to_owned(), None);
        }
        found
    }

    fn load_difference(
        &self,
        normal: &NormalReport,
        tool_m: [f64; 3],
    ) -> Option<(String, Option<Command>)> {
        let (kg, centre_m) = (normal.load_kg, normal.load_centre_m);
        let teach = "weigh pole, holder and rope, and teach the payload with the vendor's tool or give it as `arm_settings.load`";
        if let Some(load) = self.load {
            let (mass_kg, wanted_m) = (load.mass_kg, load.centre_m);
            let message = format!(
                "the arm compensates a load of {kg:.3} kg at {centre_m:.3?} m, the configuration says {mass_kg:.3} kg at {wanted_m:.3?} m"
            );
            let agrees = near(&[kg], &[mass_kg], LOAD_EQUAL_KG)
                && near(&centre_m, &wanted_m, CENTRE_EQUAL_M);
            let centre_m = wanted_m;
            return (!agrees).then_some((message, Some(Command::TcpLoad { mass_kg, centre_m })));
        }
        let possible = LOADS_KG.contains(&kg) && centre_m.iter().all(|m| m.is_finite());
        let carries_a_tool = tool_m.iter().any(|m| *m != 0.0);
        if !possible {
            let message = format!(
                "the arm says that it carries {kg:.3} kg at {centre_m:.3?} m, which no xArm 7 can: {teach}"
            );
            return Some((message, None));
        }
        (carries_a_tool && kg < LOAD_EQUAL_KG).then(|| {
            let message =
                format!("the arm compensates no load, but its limits have a tool: {teach}");
            (message, None)
        })
    }
}

/// The settings found, in one line.
#[must_use]
pub fn summary(normal: &NormalReport, rich: Option<&RichReport>) -> String {
    let rest = rich.map_or_else(String::new, |rich| {
        format!(
            ", self-collision check {}, safety boundary {}, reduced mode {}{}",
            on(rich.self_collision),
            on(rich.fence),
            on(rich.reduced),
            if rich.simulated {
                ", the arm's own simulation on"
            } else {
                ""
            }
        )
    });
    format!(
        "load {:.3} kg at {:.3?} m, collision sensitivity {}{rest}",
        normal.load_kg, normal.load_centre_m, normal.collision_sensitivity
    )
}

const fn on(is_on: bool) -> &'static str {
    if is_on { "on" } else { "off" }
}

/// Whether all numbers differ by `most` at most; what is no number is near nothing.
pub(crate) fn near(a: &[f64], b: &[f64], most: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= most)
}

#[cfg(test)]
mod tests {
    use super::*;

    const POLE_M: [f64; 3] = [0.0, 0.0, 0.2];

    /// An arm that is set as it must be for a pole.
    fn arm() -> (NormalReport, RichReport) {
        let normal = NormalReport {
            load_kg: 0.3,
            load_centre_m: [0.0, 0.0, 0.1],
            collision_sensitivity: 3,
            gravity: [0.0, 0.0, -1.0],
            ..NormalReport::default()
        };
        (normal, RichReport::default())
    }

    fn found(
        wanted: ArmSettings,
        change: impl FnOnce(&mut NormalReport, &mut RichReport),
    ) -> Vec<Difference> {
        let (mut normal, mut rich) = arm();
        change(&mut normal, &mut rich);
        wanted.differences(&normal, Some(&rich), POLE_M)
    }

    #[test]
    fn without_wishes_only_what_is_never_safe_is_refused() {
        type Change = fn(&mut NormalReport, &mut RichReport);
        let any = ArmSettings::default();
        assert_eq!(found(any, |_, _| ()), []);
        let harmless: [Change; 5] = [
            |n, _| n.gravity = [0.0, 0.0, -9.81],
            |n, _| n.load_kg = 1.2,
            |n, _| n.collision_sensitivity = 5,
            |_, r| r.self_collision = true,
            |_, r| r.fence = true,
        ];
        for change in harmless {
            assert_eq!(found(any, change), []);
        }
        let unsafe_ones: [(Change, &str); 10] = [
            (|n, _| n.load_kg = 0.0, "no load"),
            (|n, _| n.load_kg = f64::NAN, "NaN kg"),
            (|n, _| n.load_kg = -0.3, "-0.300 kg"),
            (|n, _| n.load_centre_m[1] = f64::NAN, "NaN, "),
            (|n, _| n.gravity = [0.0; 3], "gravity"),
            (|n, _| n.collision_sensitivity = 0, "sensitivity 0"),
            (|n, _| n.gravity = [0.0, 0.0, 1.0], "gravity"),
            (|n, _| n.gravity[0] = 0.1, "gravity"),
            (|n, _| n.gravity[2] = f64::NAN, "gravity"),
            (|_, r| r.reduced = true, "reduced mode"),
        ];
        for (change, words) in unsafe_ones {
            let found = found(any, change);
            assert_eq!(found.len(), 1, "{words}: {found:?}");
            assert!(found[0].message.contains(words), "{found:?}");
            // Nothing says what it should be set to.
            assert_eq!(found[0].mend, None, "{found:?}");
        }
        let (normal, rich) = arm();
        let bare = NormalReport {
            load_kg: 0.0,
            ..normal
        };
        let without_tool = any.differences(&bare, Some(&rich), [0.0; 3]);
        assert_eq!(without_tool, []);
        let unknown = any.differences(&normal, None, POLE_M);
        assert!(unknown[0].message.contains("30002"), "{unknown:?}");
    }

    #[test]
    fn each_wish_is_compared_and_what_has_a_command_is_mended_by_it() {
        let wanted = ArmSettings {
            load: Some(Load {
                mass_kg: 0.3,
                centre_m: [0.0, 0.0, 0.1],
            }),
            collision_sensitivity: Some(3),
            self_collision: Some(false),
            fence: Some(false),
        };
        assert_eq!(found(wanted, |_, _| ()), []);
        let load = Command::TcpLoad {
            mass_kg: 0.3,
            centre_m: [0.0, 0.0, 0.1],
        };
        let mend = |found: Vec<Difference>| {
            assert_eq!(found.len(), 1, "{found:?}");
            found[0].mend
        };
        assert_eq!(mend(found(wanted, |n, _| n.load_kg = 0.0)), Some(load));
        let centre = found(wanted, |n, _| n.load_centre_m[1] = 0.02);
        assert_eq!(mend(centre), Some(load));
        let level = found(wanted, |n, _| n.collision_sensitivity = 0);
        assert_eq!(mend(level), Some(Command::CollisionSensitivity(3)));
        assert_eq!(mend(found(wanted, |_, r| r.self_collision = true)), None);
        assert_eq!(mend(found(wanted, |_, r| r.fence = true)), None);
        let off = ArmSettings {
            collision_sensitivity: Some(0),
            ..wanted
        };
        assert_eq!(found(off, |n, _| n.collision_sensitivity = 0), []);
    }

    #[test]
    fn settings_no_arm_has_are_refused_by_key_and_limit() {
        let parse = toml::from_str::<ArmSettings>;
        for (text, words) in [
            ("load = { mass_kg = 300.0, centre_m = [0, 0, 0] }", "3.5 kg"),
            ("load = { mass_kg = nan, centre_m = [0, 0, 0] }", "3.5 kg"),
            (
                "load = { mass_kg = 0.3, centre_m = [0, 0, 100] }",
                "not millimetres",
            ),
            ("collision_sensitivity = 6", "0 (off) to 5"),
        ] {
            let (key, _, allowed) = parse(text).unwrap().impossible().unwrap();
            let (wanted, _) = text.split_once(' ').unwrap();
            assert!(key.contains(wanted) && allowed.contains(words), "{key}");
        }
        assert!(
            parse("load = { mass_kg = 0.3 }").is_err(),
            "without a centre"
        );
    }
}
