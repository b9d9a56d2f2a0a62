//! A headless Chromium, driven by its DevTools protocol over a pair of pipes.

use super::support::missing;
use serde_json::{Value, json};
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Longest wait for an answer of the browser; it draws without a graphics card here.
const PATIENCE: Duration = Duration::from_secs(60);
/// Names of the program, in the order in which they are tried.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// It draws without a graphics card and asks nobody for anything.
const OPTIONS: &str = "--headless=new --no-sandbox --remote-debugging-pipe \
    --use-angle=swiftshader --enable-unsafe-swiftshader --disable-dev-shm-usage \
    --disable-background-networking --no-first-run --window-size=700,900";

/// The browser's program: `WAG_CHROMIUM`, or one on the path.
fn program() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("WAG_CHROMIUM") {
        return Some(named.into());
    }
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .flat_map(|folder| NAMES.map(|name| folder.join(name)))
        .find(|file| file.is_file())
}

/// A browser with one page.
pub(crate) struct Chromium {
    process: Child,
    to: File,
    from: Receiver<Value>,
    requested: u64,
    session: String,
    /// Errors the page's console showed.
    pub(crate) errors: Vec<String>,
    /// Addresses the page asked for.
    pub(crate) requests: Vec<String>,
    _folder: tempfile::TempDir,
}

impl Chromium {
    /// Starts one that can reach nothing but this machine; `None`, and a word on
    /// standard error, where there is none. In CI there must be one.
    pub(crate) fn start() -> Option<Self> {
        let Some(program) = program() else {
            missing::without("no chromium (PATH, WAG_CHROMIUM): the page was not looked at");
            return None;
        };
        let folder = tempfile::tempdir().unwrap();
        let pipe = |name: &str| {
            let path = folder.path().join(name);
            let made = Command::new("mkfifo").arg(&path).status().unwrap();
            assert!(made.success());
            path
        };
        let (orders, answers) = (pipe("orders"), pipe("answers"));
        let profile = folder.path().join("profile");
        let process = Command::new("sh")
            .args(["-c", "exec \"$@\" 3<\"$ORDERS\" 4>\"$ANSWERS\"", "sh"])
            .arg(program)
            .args(OPTIONS.split_whitespace())
            .arg("--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1")
            .arg(format!("--user-data-dir={}", profile.display()))
            .env("ORDERS", &orders)
            .env("ANSWERS", &answers)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // Each side waits for the other to open the pipe.
        let to = File::options().write(true).open(&orders).unwrap();
        let from = File::open(&answers).unwrap();
        let mut browser = Self {
            process,
            to,
            from: listen(from),
            requested: 0,
            session: String::new(),
            errors: Vec::new(),
            requests: Vec::new(),
            _folder: folder,
        };
        let page = browser.call("Target.createTarget", &json!({ "url": "about:blank" }));
        let target = json!({ "targetId": page["targetId"], "flatten": true });
        let attached = browser.call("Target.attachToTarget", &target);
        browser.session = attached["sessionId"].as_str().unwrap().to_owned();
        for part in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{part}.enable"), &json!({}));
        }
        Some(browser)
    }

    fn note(&mut self, event: &Value) {
        let params = &event["params"];
        let error = match event["method"].as_str() {
            Some("Runtime.consoleAPICalled") if params["type"] == "error" => &params["args"],
            Some("Runtime.exceptionThrown") => &params["exceptionDetails"],
            Some("Log.entryAdded") if params["entry"]["level"] == "error" => &params["entry"],
            Some("Network.requestWillBeSent") => {
                let url = params["request"]["url"].as_str().unwrap();
                return self.requests.push(url.to_owned());
            }
            _ => return,
        };
        self.errors.push(error.to_string());
    }

    /// One method of the protocol; events that come meanwhile are noted.
    pub(crate) fn call(&mut self, method: &str, params: &Value) -> Value {
        self.requested += 1;
        let mut order = json!({ "id": self.requested, "method": method, "params": params });
        if !self.session.is_empty() {
            order["sessionId"] = self.session.as_str().into();
        }
        self.to.write_all(format!("{order}\0").as_bytes()).unwrap();
        let until = Instant::now() + PATIENCE;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let said = self.from.recv_timeout(left);
            let said = said.unwrap_or_else(|_| panic!("no answer to {method}"));
            if said["id"] == self.requested {
                assert!(said["error"].is_null(), "{method}: {}", said["error"]);
                return said["result"].clone();
            }
            self.note(&said);
        }
    }

    pub(crate) fn open(&mut self, url: &str) {
        let went = self.call("Page.navigate", &json!({ "url": url }));
        assert!(went["errorText"].is_null(), "{url}: {went}");
        self.until("the page", "document.readyState === 'complete'");
    }

    /// The value of an expression in the page.
    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let params =
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let result = self.call("Runtime.evaluate", &params);
        let thrown = &result["exceptionDetails"];
        assert!(thrown.is_null(), "{expression}: {result}");
        result["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    pub(crate) fn until(&mut self, what: &str, expression: &str) {
        let began = Instant::now();
        while self.value(expression) != Value::Bool(true) {
            assert!(began.elapsed() < PATIENCE, "{what} never came");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// The middle of an element in the window (CSS pixels), brought into view and at rest:
    /// what appears above it on the page moves it.
    pub(crate) fn middle_of(&mut self, id: &str) -> [f64; 2] {
        let began = Instant::now();
        let mut place = Value::Null;
        loop {
            let now = self.value(&format!(
                "(async () => {{ const e = document.getElementById('{id}'); e.scrollIntoView({{ block: 'center' }});
                 await new Promise((drawn) => requestAnimationFrame(drawn));
                 const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; }})()"
            ));
            if now == place {
                return [0, 1].map(|i| place[i].as_f64().unwrap());
            }
            assert!(began.elapsed() < PATIENCE, "{id} is never at rest: {now}");
            place = now;
        }
    }

    /// A mouse event: `mousePressed`, `mouseMoved`, `mouseReleased`.
    pub(crate) fn mouse(&mut self, kind: &str, [x, y]: [f64; 2]) {
        let event = json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", &event);
    }

    /// Presses and releases there.
    pub(crate) fn click(&mut self, place: [f64; 2]) {
        self.mouse("mousePressed", place);
        self.mouse("mouseReleased", place);
    }

    /// Keeps a picture of the window as PNG in `WAG_SCREENSHOTS`, if that names a folder.
    pub(crate) fn picture(&mut self, name: &str) {
        use base64::Engine;
        let shot = self.call("Page.captureScreenshot", &json!({ "format": "png" }));
        let png = base64::engine::general_purpose::STANDARD
            .decode(shot["data"].as_str().unwrap())
            .unwrap();
        assert!(png.len() > 10_000, "the window is empty");
        if let Some(folder) = std::env::var_os("WAG_SCREENSHOTS") {
            std::fs::write(Path::new(&folder).join(name), png).unwrap();
        }
    }
}

impl Drop for Chromium {
    fn drop(&mut self) {
        let _ = self
            .to
            .write_all(b"{\"id\":0,\"method\":\"Browser.close\"}\0");
        let began = Instant::now();
        while matches!(self.process.try_wait(), Ok(None)) && began.elapsed().as_secs() < 5 {
            std::thread::sleep(Duration::from_millis(20));
        }
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn listen(from: File) -> Receiver<Value> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for message in BufReader::new(from).split(0).map_while(Result::ok) {
            let value = serde_json::from_slice(&message).unwrap();
            if sender.send(value).is_err() {
                return;
            }
        }
    });
    receiver
}
