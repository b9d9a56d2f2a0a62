//! What a preview has told lately, whoever started it.

use shared_types::ipc::{Bus, IpcError, PreviewFrame, PreviewState, PreviewSubscriber};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// As many frames as are kept to find one's keypoints.
const KEPT: usize = 256;
/// A preview that told nothing for so long is gone.
const SILENCE: Duration = Duration::from_millis(1500);
/// Frames are counted over this time (ns).
const WINDOW_NS: u64 = 1_000_000_000;
/// Keypoints may be of a frame so much earlier or later than a picture (ns): the next one
/// of a camera with 50 or more a second.
const NEAR_NS: u64 = 20_000_000;

#[derive(Debug)]
pub(crate) struct Received {
    port: PreviewSubscriber,
    kept: VecDeque<PreviewFrame>,
    last: Option<Instant>,
}

impl Received {
    pub(crate) fn open(bus: &Bus) -> Result<Self, IpcError> {
        Ok(Self {
            port: bus.preview_subscriber()?,
            kept: VecDeque::new(),
            last: None,
        })
    }

    pub(crate) fn listen(&mut self) -> anyhow::Result<()> {
        while let Some(reported) = self.port.receive()? {
            self.put(*reported, Instant::now());
        }
        Ok(())
    }

    fn put(&mut self, reported: PreviewFrame, at: Instant) {
        self.last = Some(at);
        self.kept.push_back(reported);
        if self.kept.len() > KEPT {
            self.kept.pop_front();
        }
    }

    /// Whether a preview runs.
    pub(crate) fn is_there(&self) -> bool {
        self.last.is_some_and(|at| at.elapsed() < SILENCE)
    }

    /// What it saw in a frame, or in the next one before or after it.
    pub(crate) fn near(&self, stamp_ns: u64) -> Option<&PreviewFrame> {
        self.kept
            .iter()
            .filter(|reported| reported.rope.stamp_ns.abs_diff(stamp_ns) <= NEAR_NS)
            .min_by_key(|reported| reported.rope.stamp_ns.abs_diff(stamp_ns))
    }

    /// What it does, in words; `None` where there is none.
    pub(crate) fn words(&self) -> Option<String> {
        let newest = self.kept.back().filter(|_| self.is_there())?;
        Some(match newest.state() {
            PreviewState::Following if !newest.rope.is_lost() => {
                let rate_hz = self.rate_hz(newest.rope.stamp_ns);
                let took_ms = f64::from(self.usual_us()) / 1e3;
                format!("line: the preview's keypoints, {rate_hz} a second, {took_ms:.1} ms each")
            }
            PreviewState::Following => "the preview has lost the rope".to_owned(),
            state => format!("the preview {}", state.words()),
        })
    }

    /// Frames looked at in the second up to this one.
    fn rate_hz(&self, until_ns: u64) -> usize {
        let newer =
            |reported: &&PreviewFrame| reported.rope.stamp_ns.saturating_add(WINDOW_NS) > until_ns;
        self.kept.iter().filter(newer).count()
    }

    /// Median time spent on a frame (µs).
    fn usual_us(&self) -> u32 {
        let mut took: Vec<u32> = self.kept.iter().map(|reported| reported.took_us).collect();
        took.sort_unstable();
        took.get(took.len() / 2).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::KeypointFrame;
    use shared_types::ipc::DomainSweep;

    fn reported(state: PreviewState, sequence: u64) -> PreviewFrame {
        PreviewFrame {
            state: state as u8,
            rope: KeypointFrame {
                count: 2,
                sequence,
                stamp_ns: sequence * 16_000_000,
                ..KeypointFrame::default()
            },
            took_us: 1200 + u32::try_from(sequence % 3).unwrap(),
            ..PreviewFrame::default()
        }
    }

    #[test]
    fn keypoints_are_those_of_the_picture_or_of_the_next_one_beside_it() {
        let domain = format!("test_heard_{}", std::process::id());
        let _sweep = DomainSweep::new(&domain);
        let bus = Bus::join(&domain).unwrap();
        let mut received = Received::open(&bus).unwrap();
        assert!(!received.is_there() && received.words().is_none());
        let preview = bus.preview_publisher().unwrap();
        preview
            .send_copy(reported(PreviewState::Looking, 1))
            .unwrap();
        received.listen().unwrap();
        assert!(received.words().unwrap().contains("must move to be found"));
        for sequence in [2, 3, 5] {
            preview
                .send_copy(reported(PreviewState::Following, sequence))
                .unwrap();
        }
        received.listen().unwrap();
        let at = |sequence: u64| {
            received
                .near(sequence * 16_000_000)
                .map(|t| t.rope.sequence)
        };
        assert_eq!((at(3), at(6), at(7)), (Some(3), Some(5), None));
        let words = received.words().unwrap();
        assert!(words.contains("4 a second, 1.2 ms each"), "{words}");
        let mut lost = reported(PreviewState::Following, 6);
        lost.rope.lost = 1;
        preview.send_copy(lost).unwrap();
        received.listen().unwrap();
        assert_eq!(received.words().unwrap(), "the preview has lost the rope");
        for sequence in 10..1000 {
            received.put(reported(PreviewState::Following, sequence), Instant::now());
        }
        assert_eq!(received.kept.len(), KEPT);
    }
}
