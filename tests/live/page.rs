//! `--serve`, in a browser, over a real render.

use crate::browser::Browser;
use crate::{picture, render, run, temporary};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Stdio};

/// A run with a page, and where that is.
struct Served {
    process: Child,
    url: String,
    rest: BufReader<std::process::ChildStderr>,
}

impl Drop for Served {
    fn drop(&mut self) {
        // Of a test that failed; else it has ended.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Served {
    fn start(folder: &Path, arguments: &[&str]) -> Self {
        let mut process = render(folder, arguments).stderr(Stdio::piped()).spawn().expect("the program starts");
        let mut rest = BufReader::new(process.stderr.take().expect("standard error"));
        let mut line = String::new();
        while !line.contains("http://") {
            line.clear();
            assert!(rest.read_line(&mut line).expect("UTF-8") > 0, "no address was told");
        }
        let url = line.split_whitespace().last().expect("an address").to_owned();
        Served { process, url, rest }
    }

    /// Presses Ctrl-C, then as `finish`.
    fn interrupt(self) -> (i32, String) {
        let status = std::process::Command::new("kill").args(["-INT", &self.process.id().to_string()]).status();
        assert!(status.expect("kill").success());
        self.finish()
    }

    /// Waits for the end; gives the exit code and what else was told.
    fn finish(mut self) -> (i32, String) {
        let mut text = String::new();
        self.rest.read_to_string(&mut text).expect("UTF-8");
        (self.process.wait().expect("an end").code().expect("no signal"), text)
    }
}

/// Opens the page while the program renders, and sees it to the end.
#[test]
fn the_page_shows_a_render_as_it_forms() {
    let folder = temporary("page");
    let Some(mut browser) = Browser::start(&folder) else {
        println!("skipped: there is no chromium");
        return;
    };
    let (code, stderr) = run(&folder, &["-q", "-D", "res=48", "--spp", "256", "--seed", "9", "-o", "true.exr"]);
    assert_eq!(code, 0, "{stderr}");
    // Two seconds or more of rendering, on whatever machine.
    let arguments = ["-D", "res=48", "--seconds", "4", "--error-vs", "true.exr", "--serve", "0", "-o", "box.exr"];
    // Kept, for the browser may be slower than what the program waits for.
    let arguments = [&arguments[..], &["--serve-keep"]].concat();
    let served = Served::start(&folder, &arguments);
    browser.resize(1280, 800);
    browser.open(&served.url);
    browser.wait("document.querySelector('#canvas') !== null && document.querySelector('#canvas').width === 48");
    // On its way: rate, time left, samples; then it goes on by itself.
    browser.wait("/Left\\s*about [0-9.]+ s/.test(document.querySelector('#facts').innerText)");
    let facts = browser.eval("document.querySelector('#facts').innerText");
    let facts = facts.as_str().expect("text");
    assert!(facts.contains("million samples/s") && facts.contains("Estimated relMSE"), "{facts}");
    browser.screenshot(&folder.join("early.png"));
    let early = browser.eval("document.querySelector('#canvas').toDataURL()");
    browser.wait("document.documentElement.dataset.over === 'true'");
    let (code, stderr) = served.interrupt();
    assert_eq!(code, 0, "{stderr}");
    assert_ne!(browser.eval("document.querySelector('#canvas').toDataURL()"), early, "more samples change the picture");
    let status = browser.eval("document.querySelector('#status').innerText");
    assert!(status.as_str().expect("text").starts_with("The render is over. box.exr: 48 x 48 pixels"), "{status}");

    let (_, _, values) = picture(&folder.join("box.exr"));
    check_values(&mut browser, &values, 48);
    check_keys(&mut browser);
    // Both curves, as far as the table has them.
    let rows = browser.eval("document.querySelectorAll('#rows tr').length").as_u64().expect("a number");
    let shown = browser.eval("document.querySelectorAll('#plot rect.known').length").as_u64().expect("a number");
    let guessed = browser.eval("document.querySelectorAll('#plot circle.guess').length").as_u64().expect("a number");
    assert!(rows >= 6 && shown == rows && guessed == rows - 4, "{rows} {shown} {guessed}");
    for width in [360, 640, 800, 1280, 1920, 2560] {
        browser.resize(width, 900);
        let wide = browser.eval("document.documentElement.scrollWidth - innerWidth");
        assert!(wide.as_i64().is_some_and(|w| w <= 0), "{wide} too wide at {width}");
        browser.screenshot(&folder.join(format!("{width}.png")));
    }
    assert_eq!(browser.complaints, [] as [String; 0]);
}

/// The float values of pixels under the mouse, and what the canvas shows for them.
fn check_values(browser: &mut Browser, values: &[f32], width: usize) {
    let at = |browser: &mut Browser, side: &str| {
        browser
            .eval(&format!("document.querySelector('#canvas').getBoundingClientRect().{side}"))
            .as_f64()
            .expect("a number")
    };
    let [left, top, shown] = ["left", "top", "width"].map(|side| at(browser, side));
    for (x, y) in [(7_usize, 31_usize), (24, 40), (40, 12)] {
        let place = |i: usize| (i as f64 + 0.5) * shown / width as f64;
        browser.point(left + place(x), top + place(y));
        let parts = "[...document.querySelectorAll('#pixel span')].map((s) => s.lastChild.textContent)";
        browser.wait(&format!("{parts}[0] === '{x}, {y}'"));
        let shown = browser.eval(parts);
        let number = |c: usize| shown[c + 1].as_str().and_then(|text| text.parse::<f32>().ok());
        let i = 3 * (y * width + x);
        assert_eq!([0, 1, 2].map(number), [0, 1, 2].map(|c| Some(values[i + c])), "{x}, {y}");
        // From a copy: reading makes the browser complain otherwise.
        let bytes = browser.eval(&format!(
            "(() => {{ const copy = document.createElement('canvas').getContext('2d', {{ willReadFrequently: true }}); \
             copy.drawImage(document.querySelector('#canvas'), 0, 0); \
             return [...copy.getImageData({x}, {y}, 1, 1).data]; }})()"
        ));
        for c in 0..3 {
            let wanted = f64::from(lucerna::core::image::linear_to_srgb_byte(values[i + c]));
            let byte = bytes[c].as_f64().expect("a byte");
            assert!((byte - wanted).abs() <= 1.0, "{bytes} instead of {wanted}");
        }
    }
}

/// Keys move the pixel, change exposure, size and axis.
fn check_keys(browser: &mut Browser) {
    let text =
        |browser: &mut Browser, id: &str| match browser.eval(&format!("document.querySelector('{id}').innerText")) {
            Value::String(text) => text,
            other => panic!("{other}"),
        };
    assert!(text(browser, "#pixel").contains("40, 12"));
    for (key, expected) in
        [("d", "41, 12"), ("s", "41, 13"), ("A", "31, 13"), ("w", "31, 12"), ("W", "31, 2"), ("W", "31, 0")]
    {
        browser.press(key);
        assert!(text(browser, "#pixel").contains(expected), "{key}");
    }
    let canvas = "document.querySelector('#canvas').toDataURL()";
    let before = browser.eval(canvas);
    browser.press("e");
    assert_eq!(text(browser, "#stops"), "+0.5");
    assert_ne!(browser.eval(canvas), before);
    browser.press("E");
    assert_eq!(browser.eval(canvas), before);
    let fitted = text(browser, "#zoom");
    browser.press("+");
    assert_ne!(text(browser, "#zoom"), fitted);
    browser.press("f");
    assert_eq!(text(browser, "#zoom"), fitted);
    let over = text(browser, "#caption");
    browser.press("x");
    assert_ne!(text(browser, "#caption"), over);
}

/// `--serve-keep` stays for whoever comes later, until Ctrl-C; without it, nobody is waited for.
#[test]
fn the_page_stays_if_asked_to() {
    let folder = temporary("keep");
    let arguments = ["-D", "res=8", "--spp", "4", "--serve", "0", "-o", "box.exr"];
    let (code, stderr) = Served::start(&folder, &arguments).finish();
    assert_eq!(code, 0, "{stderr}");
    assert!(stderr.contains("box.exr: 8 x 8 pixels, 4 spp"), "{stderr}");

    let mut served = Served::start(&folder, &[&arguments[..], &["--serve-keep"]].concat());
    let mut line = String::new();
    while !line.contains("the page stays") {
        line.clear();
        assert!(served.rest.read_line(&mut line).expect("UTF-8") > 0, "it ended");
    }
    let state = get(&served.url, "state");
    let state: Value = serde_json::from_slice(&state).expect("JSON");
    assert!(state["ended"].as_str().is_some_and(|text| text.contains("box.exr")), "{state}");
    assert_eq!((&state["spp"], &state["size"][0]), (&Value::from(4), &Value::from(8)));
    // The picture in the bytes of the file.
    let bytes = get(&served.url, "picture");
    let (_, _, values) = picture(&folder.join("box.exr"));
    assert_eq!(bytes[4..16], [4_u32, 8, 8].map(u32::to_le_bytes).concat());
    assert_eq!(bytes[16..], values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>());
    assert_eq!(served.interrupt().0, 0);
}

/// A port that is taken is told before anything is rendered.
#[test]
fn a_port_that_is_taken_is_told() {
    let folder = temporary("port");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port().to_string();
    let (code, stderr) = run(&folder, &["-q", "-D", "res=8", "--serve", &port, "-o", "box.exr"]);
    assert_eq!((code, stderr.lines().count()), (2, 1), "{stderr}");
    assert!(stderr.starts_with("error: --serve: port ") && stderr.contains(&port), "{stderr}");
    assert!(!folder.join("box.exr").exists());
}

fn get(url: &str, path: &str) -> Vec<u8> {
    use std::io::Write;
    let host = url.trim_start_matches("http://").trim_end_matches('/');
    let mut stream = std::net::TcpStream::connect(host).expect("a page");
    stream.write_all(format!("GET /{path} HTTP/1.1\r\nHost: {host}\r\n\r\n").as_bytes()).expect("sent");
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).expect("an answer");
    let body = bytes.windows(4).position(|w| w == b"\r\n\r\n").expect("a head") + 4;
    bytes.split_off(body)
}
