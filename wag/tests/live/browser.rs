//! What a real browser makes of the report and of the live page, without a network.
//! Where there is no Chromium, these say so and pass, but not in CI.

use super::chromium::Chromium;
use super::client::Watch;
use super::fake::{Fake, put_rope, run_folder};
use super::support::{alone, record, throw, until, wag};
use rt_controller::recording::RecordedCycle;
use serde_json::{Value, json};
use shared_types::ipc::{ControllerMode, CycleRecord};
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Largest report (bytes), so that it can be sent by mail.
const REPORT_MAX_BYTES: u64 = 6_000_000;

/// Of the canvas: pixels drawn, pixels in the rope's colour, and their mean place.
const DRAWN: &str = "(() => {
  const c = document.getElementById('view'), g = c.getContext('webgl');
  const p = new Uint8Array(c.width * c.height * 4);
  g.readPixels(0, 0, c.width, c.height, g.RGBA, g.UNSIGNED_BYTE, p);
  let drawn = 0, rope = 0, x = 0, y = 0;
  for (let i = 0; i < p.length; i += 4) {
    if (!p[i + 3]) continue;
    drawn++;
    if (p[i] > 2 * p[i + 2] && p[i + 1] > 0.4 * p[i]) {
      rope++; x += (i / 4) % c.width; y += Math.floor(i / 4 / c.width);
    }
  }
  return [drawn, rope, x / rope, y / rope];
})()";

fn drawn(page: &mut Chromium) -> [f64; 4] {
    let value = page.value(DRAWN);
    [0, 1, 2, 3].map(|i| value[i].as_f64().unwrap_or(0.0))
}

/// A short throw as a run folder holds it.
fn throw_folder(run: &Path) {
    let throw = throw([0.4, 0.9]);
    let cycles = (0..250_u32).map(|cycle| {
        let t = f64::from(cycle) * 0.004;
        let record = CycleRecord {
            cycle: cycle.into(),
            deadline_ns: u64::from(cycle) * 4_000_000 + 1_000_000_000,
            mode: ControllerMode::Streaming as u8,
            sent: 1,
            wake_late_ns: (10 + cycle % 50) * 1000,
            compute_ns: 20_000,
            send_ns: 60_000,
            trajectory_s: t,
            q_c: throw.state_at(t).q,
            ..CycleRecord::default()
        };
        RecordedCycle {
            record,
            ..RecordedCycle::default()
        }
    });
    record(run, cycles);
    put_rope(run);
    let summary = json!({ "ok": true, "command": "throw", "target_m": [0.9, 0.1, 0.2] });
    std::fs::write(run.join("summary.json"), summary.to_string()).unwrap();
}

#[test]
fn a_report_is_drawn_its_slider_moves_the_rope_and_two_fingers_come_nearer() {
    let _alone = alone();
    let Some(mut page) = Chromium::start() else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    throw_folder(dir.path());
    let made = wag(&format!("report {}", dir.path().display()));
    assert!(made.status.success(), "{made:?}");
    let file = dir.path().join("report.html");
    assert!(file.metadata().unwrap().len() < REPORT_MAX_BYTES);
    page.open(&format!("file://{}", file.display()));
    let before = drawn(&mut page);
    assert!(before[0] > 3000.0 && before[1] > 50.0, "{before:?}");
    page.value(
        "(() => { const t = document.getElementById('time'); t.value = t.max;
         t.dispatchEvent(new Event('input')); })()",
    );
    let after = drawn(&mut page);
    let moved = (after[2] - before[2]).hypot(after[3] - before[3]);
    assert!(after[1] > 50.0 && moved > 5.0, "{before:?} {after:?}");
    pinch(&mut page);
    let near = drawn(&mut page);
    assert!(near[1] > 1.5 * after[1], "{after:?} {near:?}");
    page.picture("report-test.png");
    assert_eq!(page.errors, Vec::<String>::new());
    let own = |url: &String| url.starts_with("file://") || url.starts_with("data:");
    assert!(page.requests.iter().all(own), "{:?}", page.requests);
}

/// Two fingers on the view move apart.
fn pinch(page: &mut Chromium) {
    page.call(
        "Emulation.setTouchEmulationEnabled",
        &json!({ "enabled": true, "maxTouchPoints": 2 }),
    );
    let place = page.value(
        "(() => { const c = document.getElementById('view'); c.scrollIntoView({ block: 'center' });
         const r = c.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; })()",
    );
    let [x, y] = [0, 1].map(|i| place[i].as_f64().unwrap());
    let fingers = |apart: f64| json!([{ "x": x - apart, "y": y, "id": 0 }, { "x": x + apart, "y": y, "id": 1 }]);
    let mut touch = |kind: &str, points: Value| {
        page.call(
            "Input.dispatchTouchEvent",
            &json!({ "type": kind, "touchPoints": points }),
        );
    };
    touch("touchStart", fingers(40.0));
    for apart in [50.0, 60.0, 70.0, 80.0] {
        touch("touchMove", fingers(apart));
    }
    touch("touchEnd", json!([]));
}

#[test]
fn the_live_page_follows_a_run_and_stops_it() {
    let _alone = alone();
    let Some(mut page) = Chromium::start() else {
        return;
    };
    let long = std::env::var_os("WAG_LONG_TESTS").is_some();
    let fake = Fake::start(&format!("watch-page-{}", std::process::id()));
    let dir = tempfile::tempdir().unwrap();
    run_folder(dir.path(), &fake.domain);
    let watch = Watch::start(dir.path().to_str().unwrap());
    page.open(&watch.url);
    page.until(
        "the rope",
        "watched.last !== null && watched.last.rope.length > 30",
    );
    page.until("a picture", "watched.pictures > 3");
    let counts = |page: &mut Chromium| {
        ["watched.states", "watched.drawn"].map(|count| page.value(count).as_f64().unwrap())
    };
    let (began, first) = (Instant::now(), counts(&mut page));
    let before = drawn(&mut page);
    let span = Duration::from_secs(if long { 600 } else { 3 });
    let mut most_mb = 0_f64;
    let mut moved = 0_f64;
    while began.elapsed() < span {
        std::thread::sleep(Duration::from_millis(if long { 2000 } else { 300 }));
        let now = drawn(&mut page);
        moved = moved.max((now[2] - before[2]).hypot(now[3] - before[3]));
        most_mb = most_mb.max(watch.resident_mb());
    }
    let (last, span_s) = (counts(&mut page), began.elapsed().as_secs_f64());
    let [reported_hz, drawn_hz] = [0, 1].map(|i| (last[i] - first[i]) / span_s);
    eprintln!(
        "told {reported_hz:.1} times a second, drew {drawn_hz:.1} in {span_s:.0} s, at most {most_mb:.1} MB"
    );
    assert!(before[0] > 3000.0 && before[1] > 50.0, "{before:?}");
    assert!(moved > 2.0, "moved {moved}");
    assert!(most_mb < 150.0, "{most_mb} MB");
    // How fast a busy processor tells and draws is no matter of the program; that it does
    // is. The long run is for a machine of its own.
    let [told_wanted_hz, drawn_wanted_hz] = if long { [10.0, 10.0] } else { [2.0, 1.0] };
    assert!(
        reported_hz >= told_wanted_hz,
        "{reported_hz} states a second"
    );
    assert!(drawn_hz >= drawn_wanted_hz, "drew {drawn_hz} a second");
    assert_eq!(page.value("document.getElementById('picture').width"), 128);
    // Without an operator there is nothing but the stop, and the page says why.
    let buttons = page.value("document.querySelectorAll('#asks button').length");
    assert_eq!(buttons, 1);
    let why = page.value("document.getElementById('asknote').textContent");
    assert!(why.as_str().unwrap().contains("no operator"), "{why}");
    page.value("document.getElementById('stop').click()");
    page.until(
        "the stop",
        "document.getElementById('answer').textContent === 'Stop: done'",
    );
    assert_eq!(fake.wires.stops.load(Ordering::SeqCst), 1);
    page.picture("watch-test.png");
    assert_eq!(page.errors, Vec::<String>::new());
    let own = |url: &String| url.starts_with(&watch.url) || url.starts_with("data:");
    assert!(page.requests.iter().all(own), "{:?}", page.requests);
}

/// Every press of the stop button reaches the controller, as a mouse presses it; how soon is
/// printed: of a page that draws, and of one that does not, where a machine draws without a
/// graphics card.
#[test]
fn each_press_of_stop_arrives() {
    let _alone = alone();
    let Some(mut page) = Chromium::start() else {
        return;
    };
    let presses = match std::env::var_os("WAG_LONG_TESTS") {
        Some(_) => 200,
        None => 20,
    };
    let fake = Fake::start(&format!("stops-{}", std::process::id()));
    let watch = Watch::start(&format!("--domain {}", fake.domain));
    page.open(&watch.url);
    page.until("the button", "document.getElementById('stop') !== null");
    let mut pressed = 0;
    for (how, pace) in [("drawing", "() => 0"), ("not drawing", "() => Infinity")] {
        page.value(&format!("void (pace_ms = {pace})"));
        let mut late_ms = Vec::new();
        for _ in 0..presses {
            let stop = page.middle_of("stop");
            let ready = "!document.getElementById('stop').disabled";
            page.until("the last answer", ready);
            let began = Instant::now();
            page.mouse("mousePressed", stop);
            pressed += 1;
            until("the stop", Duration::from_secs(5), || {
                (fake.wires.stops.load(Ordering::SeqCst) == pressed).then_some(())
            });
            late_ms.push(began.elapsed().as_secs_f64() * 1e3);
            page.mouse("mouseReleased", stop);
        }
        late_ms.sort_by(f64::total_cmp);
        let [median, longest] = [late_ms[presses / 2], late_ms[presses - 1]];
        eprintln!("{how}: {presses} stops arrived, median {median:.0} ms, longest {longest:.0} ms");
    }
}
