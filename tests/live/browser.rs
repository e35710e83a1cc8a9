//! Drives chromium by its DevTools protocol over two pipes: pages, keys, the mouse, screenshots, and what the console said.

use crate::support::program::chromium;
use serde_json::{Value, json};
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Longest wait for anything.
const PATIENCE: Duration = Duration::from_secs(120);

pub struct Browser {
    process: Child,
    input: File,
    output: BufReader<File>,
    session: Option<String>,
    next: u64,
    /// Errors, warnings and exceptions so far.
    pub complaints: Vec<String>,
}

impl Browser {
    /// `None` if there is no chromium.
    pub fn start(folder: &Path) -> Option<Self> {
        let program = chromium()?;
        let pipes = ["to", "from"].map(|name| folder.join(name));
        let made = Command::new("mkfifo").args(&pipes).status().expect("mkfifo");
        assert!(made.success());
        let [to, from] = &pipes;
        // The shell gives the pipes the numbers that the browser expects. Both sides wait for each other.
        let process = Command::new("sh")
            .args(["-c", "exec \"$0\" \"$@\" 3<to 4>from", program])
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--remote-debugging-pipe"])
            .args(["--disable-background-networking", "--disable-component-update", "--disable-sync"])
            .arg(format!("--user-data-dir={}", folder.join("profile").display()))
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("chromium starts");
        let input = OpenOptions::new().write(true).open(to).expect("a pipe");
        let output = BufReader::new(File::open(from).expect("a pipe"));
        let mut browser = Browser { process, input, output, session: None, next: 0, complaints: Vec::new() };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }));
        let attached =
            browser.call("Target.attachToTarget", json!({ "targetId": target["targetId"], "flatten": true }));
        browser.session = attached["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page.enable", "Runtime.enable", "Log.enable"] {
            browser.call(domain, json!({}));
        }
        Some(browser)
    }

    /// Calls a method and waits for its result.
    pub fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.next += 1;
        let mut message = json!({ "id": self.next, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        self.input.write_all(format!("{message}\0").as_bytes()).expect("the browser listens");
        loop {
            let mut bytes = Vec::new();
            self.output.read_until(0, &mut bytes).expect("the browser answers");
            assert!(bytes.pop().is_some(), "the browser is gone");
            let answer: Value = serde_json::from_slice(&bytes).expect("JSON");
            if answer["id"] == json!(self.next) {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
            self.note(&answer);
        }
    }

    fn note(&mut self, event: &Value) {
        let p = &event["params"];
        let is_bad = match event["method"].as_str() {
            Some("Runtime.exceptionThrown") => true,
            Some("Runtime.consoleAPICalled") => {
                ["error", "warning", "assert"].contains(&p["type"].as_str().unwrap_or(""))
            }
            Some("Log.entryAdded") => ["error", "warning"].contains(&p["entry"]["level"].as_str().unwrap_or("")),
            _ => false,
        };
        if is_bad {
            self.complaints.push(p.to_string());
        }
    }

    pub fn open(&mut self, url: &str) {
        self.call("Page.navigate", json!({ "url": url }));
    }

    pub fn resize(&mut self, width: u32, height: u32) {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", size);
    }

    /// The value of an expression.
    pub fn eval(&mut self, expression: &str) -> Value {
        let found = self.call("Runtime.evaluate", json!({ "expression": expression, "returnByValue": true }));
        assert!(found.get("exceptionDetails").is_none(), "{expression}: {found}");
        found["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    pub fn wait(&mut self, expression: &str) {
        let started = Instant::now();
        while self.eval(expression) != json!(true) {
            let text = if started.elapsed() > PATIENCE { self.eval("document.body.innerText") } else { Value::Null };
            assert!(started.elapsed() < PATIENCE, "{expression} stays false: {text}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Presses a key as a hand does.
    pub fn press(&mut self, key: &str) {
        let shift = if key.chars().all(char::is_uppercase) { 8 } else { 0 };
        for kind in ["keyDown", "keyUp"] {
            self.call("Input.dispatchKeyEvent", json!({ "type": kind, "key": key, "text": key, "modifiers": shift }));
        }
    }

    /// Moves the mouse.
    pub fn point(&mut self, x: f64, y: f64) {
        self.call("Input.dispatchMouseEvent", json!({ "type": "mouseMoved", "x": x, "y": y }));
    }

    /// Writes what is seen to a file.
    pub fn screenshot(&mut self, path: &PathBuf) {
        use base64::Engine;
        let shot = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        let bytes = base64::engine::general_purpose::STANDARD.decode(shot["data"].as_str().expect("a picture"));
        std::fs::write(path, bytes.expect("base64")).expect("written");
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
