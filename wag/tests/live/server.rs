//! The server: who is let in, and that nobody holds others up.

use super::client::{Watch, read_answer};
use super::fake::{Fake, run_folder};
use super::support::{alone, has, shared_memory_of};
use serde_json::json;
use std::io::{BufReader, Write};
use std::net::TcpStream;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

fn domain(tag: &str) -> String {
    format!("watch-{tag}-{}", std::process::id())
}

#[test]
fn strangers_are_sent_away_and_every_answer_says_what_a_page_may_do() {
    let _alone = alone();
    let watch = Watch::start(&format!("--domain {}", domain("strange")));
    let (home, host) = (watch.home(), watch.host());
    let get = |path: &str, lines: &str| watch.raw(&format!("GET {path} HTTP/1.1\r\n{lines}\r\n"));
    let own = format!("Host: {host}\r\n");
    let page = get(home, &own);
    assert_eq!(page.status, 200);
    assert!(String::from_utf8_lossy(&page.body).contains("watch.js"));
    has(&page.head, &["default-src 'none'", "no-store", "nosniff"]);
    has(&page.head, &["no-referrer"]);
    assert!(!page.head.to_lowercase().contains("cookie"));
    // No token, a wrong one, the token elsewhere.
    let wrong = format!("/{}x/", &home[1..home.len() - 2]);
    for path in [
        "/",
        "/state",
        "/watch.js",
        "/picture",
        "//state",
        "state",
        &format!("/x{home}state"),
        &wrong,
        &format!("/state?{}", &home[1..]),
    ] {
        assert_eq!(get(path, &own).status, 403, "{path}");
    }
    // The token, from another page or under another name.
    for foreign in [
        "http://evil.example",
        "null",
        "https://127.0.0.1",
        "http://127.0.0.1:1",
    ] {
        let lines = format!("{own}Origin: {foreign}\r\n");
        assert_eq!(get(home, &lines).status, 403, "Origin {foreign}");
        let stop = watch.raw(&format!("POST {home}ask/stop HTTP/1.1\r\n{lines}\r\n"));
        assert_eq!(stop.status, 403, "Origin {foreign}");
    }
    assert_eq!(get(home, "Host: evil.example\r\n").status, 403);
    assert_eq!(watch.ask("GET", "nothing").status, 404);
    assert_eq!(watch.ask("POST", "ask/move").status, 404);
    assert_eq!(watch.ask("GET", "ask/stop").status, 405);
    assert_eq!(watch.ask("DELETE", "state").status, 405);
    assert_eq!(get(&home[..home.len() - 1], &own).status, 308);
    // Too much.
    let long = format!("{own}X: {}\r\n", "x".repeat(100_000));
    assert_eq!(get(home, &long).status, 431);
    assert_eq!(watch.end(), Some(0));
}

#[test]
fn a_stop_needs_no_operator_and_nothing_else_goes_without_one() {
    let _alone = alone();
    let fake = Fake::start(&domain("ask"));
    let watch = Watch::start(&format!("--domain {}", fake.domain));
    let mut states = watch.states();
    states.until("a streaming controller", |s| {
        s["controller"]["mode"] == "streaming"
    });
    let began = Instant::now();
    let stopped = watch.ask("POST", "ask/stop");
    let took = began.elapsed();
    assert_eq!(stopped.status, 200, "{stopped:?}");
    assert_eq!(fake.wires.stops.load(Ordering::SeqCst), 1);
    assert!(took < Duration::from_secs(3), "{took:?}");
    let state = states.until("the stop", |s| s["controller"]["stop"]["latched"] == true);
    assert_eq!(state["controller"]["stop"]["code"], "operator_stop");
    let words = state["controller"]["stop"]["words"].as_str().unwrap();
    assert!(words.contains("asked for a stop"), "{words}");
    assert_eq!(state["asks"][0], json!(["stop", null]));
    assert_eq!(state["asks"][1], json!(["disarm", "there is no operator"]));
    let refused = watch.ask("POST", "ask/disarm");
    assert_eq!(refused.status, 409);
    assert_eq!(refused.body, b"there is no operator");
    // A stop is acknowledged at the arm.
    assert_eq!(watch.ask("POST", "ask/acknowledge").status, 404);
    assert_eq!(fake.wires.disarms.load(Ordering::SeqCst), 0);
    fake.operate(true);
    states.until("the operator", |s| s["controller"]["operator"] == true);
    assert_eq!(watch.ask("POST", "ask/disarm").status, 200);
    assert_eq!(fake.wires.disarms.load(Ordering::SeqCst), 1);
    fake.operate(false);
    states.until("no operator", |s| s["controller"]["operator"] == false);
}

#[test]
fn it_is_there_before_a_run_and_after_it_and_sees_the_next() {
    let _alone = alone();
    let name = domain("next");
    let dir = tempfile::tempdir().unwrap();
    run_folder(dir.path(), &name);
    let watch = Watch::start(dir.path().to_str().unwrap());
    let mut states = watch.states();
    let before = states.next();
    assert!(before["controller"].is_null());
    let note = before["note"].as_str().unwrap();
    assert!(note.contains("no controller runs yet"), "{note}");
    assert_eq!(watch.ask("POST", "ask/stop").body, b"no controller runs");
    for run in 0..2 {
        let fake = Fake::start(&name);
        let state = states.until("the run", |s| {
            s["arm"].as_array().unwrap().len() == 27 && s["rope"].as_array().unwrap().len() > 30
        });
        let rope = "the identified rope, simulated";
        assert_eq!(state["rope_is"], rope, "run {run}");
        drop(fake);
        let over = states.until("its end", |s| s["controller"].is_null());
        assert!(over["note"].as_str().unwrap().contains("has ended"));
        let (summary, report) = (
            dir.path().join("summary.json"),
            dir.path().join("report.html"),
        );
        std::fs::write(
            summary,
            r#"{"task": "strike", "score": {"closest_m": 0.0031}}"#,
        )
        .unwrap();
        std::fs::write(&report, "").unwrap();
        let named = format!(
            "the run has ended: Hit: 3.1 mm; report `{}`;",
            report.display()
        );
        states.until("what came of it", |s| {
            s["note"].as_str().unwrap().contains(&named)
        });
        let shown = over["arm"].as_array().unwrap().len();
        assert_eq!(shown, 27, "it stays in view");
    }
    assert_eq!(watch.end(), Some(0));
    assert_eq!(shared_memory_of(&name), Vec::<String>::new());
}

#[test]
fn readers_that_never_read_hold_nobody_up() {
    let _alone = alone();
    let fake = Fake::start(&domain("slow"));
    let watch = Watch::start(&format!("--domain {}", fake.domain));
    let (home, host) = (watch.home(), watch.host());
    // Ten that follow and never read, ten that never end their question.
    let mut idle: Vec<TcpStream> = (0..20).map(|_| watch.connect()).collect();
    for (k, stream) in idle.iter_mut().enumerate() {
        let whole = format!("GET {home}state HTTP/1.1\r\nHost: {host}\r\n\r\n");
        let sent = if k % 2 == 0 { whole.len() } else { 20 };
        stream.write_all(&whole.as_bytes()[..sent]).unwrap();
    }
    let mut states = watch.states();
    states.until("a controller", |s| !s["controller"].is_null());
    let (began, mut count, mut cycles) = (Instant::now(), 0, Vec::new());
    let span_s = 3.0;
    while began.elapsed().as_secs_f64() < span_s {
        cycles.push(states.next()["controller"]["cycle"].as_u64().unwrap());
        count += 1;
    }
    let rate_hz = f64::from(count) / began.elapsed().as_secs_f64();
    // A busy machine tells less often, never in bursts of what is old.
    let long = std::env::var_os("WAG_LONG_TESTS").is_some();
    let wanted_hz = if long { 10.0 } else { 2.0 };
    eprintln!("told {rate_hz:.1} times a second");
    assert!(rate_hz >= wanted_hz, "{rate_hz} Hz");
    assert!(cycles.is_sorted(), "{cycles:?}");
    // One that comes late gets the newest, not what it missed.
    std::thread::sleep(Duration::from_millis(500));
    let mut late = watch.states();
    assert!(late.next()["controller"]["cycle"].as_u64() > cycles.last().copied());
    // Pictures, one after the other on one connection, never the same twice.
    let stream = watch.connect();
    let mut reader = BufReader::new(stream.try_clone().unwrap());
    let (mut seen, began, mut pictures) = (0_u64, Instant::now(), 0);
    while began.elapsed() < Duration::from_secs(2) {
        watch.get(&stream, &format!("picture?after={seen}"));
        let answer = read_answer(&mut reader);
        if answer.status == 204 {
            continue;
        }
        assert_eq!((answer.status, &answer.body[..2]), (200, &[0xff, 0xd8][..]));
        let number: u64 = answer.line("X-Number").unwrap().parse().unwrap();
        assert!(number > seen, "{number} after {seen}");
        seen = number;
        pictures += 1;
    }
    assert!((4..=32).contains(&pictures), "{pictures} pictures in 2 s");
    let resident_mb = watch.resident_mb();
    assert!(resident_mb < 150.0, "{resident_mb} MB");
    assert_eq!(watch.ask("POST", "ask/stop").status, 200);
}
