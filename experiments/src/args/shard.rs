//! A part of a study's trials.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Most shards of one study.
const SHARDS_MAX: u64 = 100_000;

/// Every `of`-th trial, from trial `number - 1` on: shards of equal length and of equal work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Shard {
    /// Which shard, from 1.
    pub number: u64,
    /// How many there are.
    pub of: u64,
}

impl Shard {
    /// All trials.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// How many of `count` trials it has.
    pub fn len(self, count: u64) -> u64 {
        (count + self.of - self.number) / self.of
    }

    /// Which trial its `place`-th one is, from 0.
    pub fn trial(self, place: u64) -> u64 {
        self.number - 1 + place * self.of
    }

    /// Whether it is all trials.
    pub fn is_whole(&self) -> bool {
        *self == Self::WHOLE
    }
}

impl Default for Shard {
    fn default() -> Self {
        Self::WHOLE
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl TryFrom<String> for Shard {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Shard> for String {
    fn from(shard: Shard) -> Self {
        shard.to_string()
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = text.split_once('/').and_then(|(number, of)| {
            let (number, of) = (number.parse().ok()?, of.parse().ok()?);
            (1..=of).contains(&number).then_some(Self { number, of })
        });
        parsed
            .filter(|shard| shard.of <= SHARDS_MAX)
            .ok_or_else(|| {
                format!("`{text}` is no shard: 2/8 is the second of eight, of at most {SHARDS_MAX}")
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_hold_every_trial_once() {
        for count in 0..40 {
            for of in 1..12 {
                let shards = (1..=of).map(|number| Shard { number, of });
                let trials = shards.flat_map(|s| (0..s.len(count)).map(move |k| s.trial(k)));
                let mut trials: Vec<u64> = trials.collect();
                trials.sort_unstable();
                assert!(trials.into_iter().eq(0..count), "{count} in {of}");
            }
        }
    }

    #[test]
    fn what_is_no_shard_is_told() {
        assert_eq!("3/8".parse(), Ok(Shard { number: 3, of: 8 }));
        let read = serde_json::from_str::<Shard>;
        assert_eq!(read("\"3/8\"").unwrap(), Shard { number: 3, of: 8 });
        assert!(read("\"4/3\"").is_err() && read("\"0/3\"").is_err());
        for text in ["0/8", "9/8", "1", "a/b", "1/0", "-1/2", "1/100001"] {
            let refusal = text.parse::<Shard>().unwrap_err();
            assert!(refusal.contains("2/8 is the second of eight"), "{refusal}");
        }
    }
}
