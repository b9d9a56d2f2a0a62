//! How a rope stands and moves at one instant: link by link, or its first mode alone.

use serde::{Deserialize, Serialize};

/// Attitudes and rates of a rope's links at one instant; what a simulation goes on from.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RopeState {
    /// Attitudes of the links from the clamp on, scalar first, link to world.
    pub attitudes: Vec<[f64; 4]>,
    /// Their angular velocities (rad/s, world); empty at rest.
    pub rates_rad_s: Vec<[f64; 3]>,
    /// Moments by which dry friction resists in the joints (N m, world); empty for none.
    pub friction_nm: Vec<[f64; 3]>,
}

/// Not the state of such a rope.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the state of a rope of {0} links must have as many unit quaternions, and as many finite angular velocities and moments of friction or none"
)]
pub struct RopeStateError(u32);

impl RopeState {
    /// At rest.
    #[must_use]
    pub fn at_rest(attitudes: Vec<[f64; 4]>) -> Self {
        Self {
            attitudes,
            ..Self::default()
        }
    }

    /// Whether it is the state of a rope of so many links.
    ///
    /// # Errors
    /// Another number of links, an attitude that is no unit quaternion, a number that is not
    /// finite.
    pub fn check(&self, links: u32) -> Result<(), RopeStateError> {
        const UNIT_TOLERANCE: f64 = 1e-3;
        let fits = |count: usize| u32::try_from(count) == Ok(links);
        let may_lack = |count: usize| count == 0 || fits(count);
        let unit = |q: &[f64; 4]| {
            let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
            (norm - 1.0).abs() <= UNIT_TOLERANCE
        };
        let finite = |vectors: &[[f64; 3]]| vectors.as_flattened().iter().all(|x| x.is_finite());
        let whole = fits(self.attitudes.len())
            && may_lack(self.rates_rad_s.len())
            && may_lack(self.friction_nm.len());
        if whole
            && self.attitudes.iter().all(unit)
            && finite(&self.rates_rad_s)
            && finite(&self.friction_nm)
        {
            return Ok(());
        }
        Err(RopeStateError(links))
    }
}

/// Swing left in a rope when a motion begins: its first mode in two planes, about. The rope
/// hangs as it would if gravity were turned, and moves as if that turn were growing.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sway {
    /// Turn of gravity about the world's x and y axes (rad).
    pub angle_rad: [f64; 2],
    /// Its rate (rad/s).
    pub rate_rad_s: [f64; 2],
}

impl Sway {
    /// A rope at rest.
    pub const NONE: Self = Self {
        angle_rad: [0.0; 2],
        rate_rad_s: [0.0; 2],
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_of_another_rope_or_of_no_rope_is_refused() {
        let state = RopeState::at_rest(vec![[1.0, 0.0, 0.0, 0.0]; 3]);
        assert_eq!(state.check(3), Ok(()));
        assert_eq!(state.check(4), Err(RopeStateError(4)));
        let spoilt: [fn(&mut RopeState); 4] = [
            |s| s.attitudes[1][0] = 0.5,
            |s| s.attitudes[2][3] = f64::NAN,
            |s| s.rates_rad_s = vec![[0.0; 3]; 2],
            |s| s.friction_nm = vec![[0.0, f64::INFINITY, 0.0]; 3],
        ];
        for spoil in spoilt {
            let mut state = state.clone();
            spoil(&mut state);
            assert_eq!(state.check(3), Err(RopeStateError(3)));
        }
    }
}
