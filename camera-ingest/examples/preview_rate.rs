//! What a running preview does, until it has been silent for three seconds:
//! `preview_rate DOMAIN` prints its rate, its time per frame, its states and
//! when it had lost the rope.

use std::error::Error;
use std::time::{Duration, Instant};

use shared_types::ipc::{Bus, DomainSweep, PreviewFrame, PreviewState};

/// Silence that ends the count.
const SILENCE: Duration = Duration::from_secs(3);

/// The value below which a part of the sorted ones lies.
fn quantile(sorted: &[u32], percent: usize) -> f64 {
    let at = sorted.len().saturating_sub(1) * percent / 100;
    sorted
        .get(at)
        .map_or(f64::NAN, |us| f64::from(*us) / 1000.0)
}

fn main() -> Result<(), Box<dyn Error>> {
    let domain = std::env::args().nth(1).ok_or("name a domain")?;
    let _sweep = DomainSweep::new(&domain);
    let bus = Bus::join(&domain)?;
    let previews = bus.preview_subscriber()?;
    let (mut reported, mut received): (Vec<PreviewFrame>, _) = (Vec::new(), Instant::now());
    while received.elapsed() < SILENCE || reported.is_empty() {
        while let Some(found) = previews.receive()? {
            received = Instant::now();
            reported.push(*found);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    reported.retain(|t| t.state() != PreviewState::NoCamera);
    let (Some(first), Some(last)) = (reported.first(), reported.last()) else {
        return Err("no frame was looked at".into());
    };
    let span_s = (last.rope.stamp_ns - first.rope.stamp_ns) as f64 * 1e-9;
    println!(
        "{span_s:.1} s: looked at {}, {:.1} a second, skipped {}, began anew {} times",
        reported.len(),
        reported.len() as f64 / span_s,
        last.skipped - first.skipped,
        last.restarts
    );
    for (state, lost) in [
        (PreviewState::NoArm, false),
        (PreviewState::Looking, false),
        (PreviewState::Following, false),
        (PreviewState::Following, true),
    ] {
        let those = reported
            .iter()
            .filter(|t| t.state() == state && t.rope.is_lost() == lost);
        let mut took: Vec<u32> = those.map(|t| t.took_us).collect();
        took.sort_unstable();
        println!(
            "{state:?}{}: {} frames; half {:.2} ms, 99 % {:.2} ms, at most {:.2} ms",
            if lost { ", lost" } else { "" },
            took.len(),
            quantile(&took, 50),
            quantile(&took, 99),
            quantile(&took, 100)
        );
    }
    // Where it was lost, from the first frame looked at.
    let lost = |t: &PreviewFrame| t.rope.is_lost();
    for span in reported.chunk_by(|a, b| lost(a) == lost(b)) {
        if let [begin, .., end] = span
            && lost(begin)
        {
            let since_s = |t: &PreviewFrame| (t.rope.stamp_ns - first.rope.stamp_ns) as f64 * 1e-9;
            println!(
                "lost from {:.2} to {:.2} s, {} frames",
                since_s(begin),
                since_s(end),
                span.len()
            );
        }
    }
    Ok(())
}
