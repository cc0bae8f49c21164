//! A page in headless Chromium, driven as a reader would: by mouse and keys, through the browser's
//! own protocol over two pipes.
//!
//! Without Chromium these tests skip with a message, or fail with `ASPERITY_NO_SKIPS=1`.

use std::env;
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use serde_json::{Value, json};

use crate::support::binary::text;

/// The name of the browser, and options that keep it from calling home.
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];
const QUIET: [&str; 9] = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
];

/// The browser, unless the test skips.
pub(crate) fn browser() -> Option<PathBuf> {
    let folders =
        env::var_os("PATH").map(|path| env::split_paths(&path).collect::<Vec<_>>()).unwrap_or_default();
    let candidates = NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    if let Some(found) = candidates.into_iter().find(|path| path.is_file()) {
        return Some(found);
    }
    let reason = format!("no browser is installed (accepted: one of {} on PATH)", NAMES.join(", "));
    let no_skips = env::var_os("ASPERITY_NO_SKIPS").is_some_and(|value| value == "1");
    assert!(!no_skips, "page must not be skipped: {reason}");
    // Not eprintln, which the test harness captures: a skip must be seen.
    writeln!(std::io::stderr(), "SKIPPED page: {reason}").expect("stderr can be written");
    None
}

/// A page that is looked at. It goes with the value.
pub(crate) struct Tab {
    child: Child,
    to: File,
    from: BufReader<File>,
    session: Value,
    calls: u64,
    /// Messages that the browser sent by itself.
    told: Vec<Value>,
    _profile: tempfile::TempDir,
}

impl Tab {
    /// Opens a page by its file, in a window of this size, by day or by night.
    pub(crate) fn open(browser: &Path, page: &Path, size: [u32; 2], scheme: &str) -> Tab {
        let mut tab = Tab::start(browser);
        tab.go(page, size, scheme);
        tab
    }

    /// A browser without a page.
    pub(crate) fn start(browser: &Path) -> Tab {
        let profile = asperity_testkit::folder();
        let [to, from] = ["to", "from"].map(|name| profile.path().join(name));
        assert!(Command::new("mkfifo").args([&to, &from]).status().expect("mkfifo starts").success());
        // Should the browser hang, so that no one waits for ever.
        let line = format!(
            "exec timeout 300 {} {} --remote-debugging-pipe --user-data-dir={} about:blank 3<{} 4>{}",
            text(browser),
            QUIET.join(" "),
            text(&profile.path().join("profile")),
            text(&to),
            text(&from)
        );
        let mut shell = Command::new("sh");
        let child = shell.args(["-c", &line]).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        let to = File::options().write(true).open(to).expect("the browser reads its pipe");
        let from = BufReader::new(File::open(from).expect("the browser writes its pipe"));
        let child = child.expect("a shell starts");
        let (session, told) = (Value::Null, Vec::new());
        let mut tab = Tab { child, to, from, session, calls: 0, told, _profile: profile };
        let target = tab.call("Target.createTarget", json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        tab.session = tab.call("Target.attachToTarget", attach)["sessionId"].clone();
        for part in ["Page", "Runtime", "Log", "Network"] {
            tab.call(&format!("{part}.enable"), json!({}));
        }
        tab
    }

    /// Goes to a page, as `open` does, and forgets what was said before.
    pub(crate) fn go(&mut self, page: &Path, size: [u32; 2], scheme: &str) {
        let [width, height] = size;
        let window = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", window);
        let feature = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
        self.call("Emulation.setEmulatedMedia", json!({ "features": feature }));
        self.told.clear();
        self.call("Page.navigate", json!({ "url": format!("file://{}", text(page)) }));
        self.wait_for("Page.loadEventFired");
        self.painted();
    }

    fn message(&mut self) -> Value {
        let mut bytes = Vec::new();
        self.from.read_until(0, &mut bytes).expect("the browser's pipe can be read");
        bytes.pop();
        serde_json::from_slice(&bytes).unwrap_or_else(|error| panic!("the browser ended: {error}"))
    }

    /// Calls a method of the protocol.
    fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.calls += 1;
        let mut call = json!({ "id": self.calls, "method": method, "params": parameters });
        if !self.session.is_null() {
            call["sessionId"] = self.session.clone();
        }
        self.to.write_all(format!("{call}\0").as_bytes()).expect("the browser reads its pipe");
        loop {
            let message = self.message();
            if message["id"] == self.calls {
                assert!(message["error"].is_null(), "{method}: {message}");
                return message["result"].clone();
            }
            self.told.push(message);
        }
    }

    fn wait_for(&mut self, event: &str) {
        while !self.told.iter().any(|message| message["method"] == event) {
            let message = self.message();
            self.told.push(message);
        }
    }

    /// The value of an expression in the page's own script.
    pub(crate) fn eval(&mut self, script: &str) -> Value {
        let parameters = json!({ "expression": script, "awaitPromise": true, "returnByValue": true });
        let result = self.call("Runtime.evaluate", parameters);
        assert!(result["exceptionDetails"].is_null(), "{script}: {result}");
        result["result"]["value"].clone()
    }

    /// Waits until the requested drawing is done.
    pub(crate) fn painted(&mut self) {
        self.eval("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(0))))");
    }

    /// Evaluates a script that returns a text.
    pub(crate) fn says(&mut self, script: &str) -> String {
        match self.eval(script) {
            Value::String(text) => text,
            other => other.to_string(),
        }
    }

    /// Clicks at a place in the window.
    pub(crate) fn click(&mut self, x: f64, y: f64) {
        for kind in ["mouseMoved", "mousePressed", "mouseReleased"] {
            let parameters = json!({ "type": kind, "x": x, "y": y, "button": "left", "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", parameters);
        }
        self.painted();
    }

    /// Scrolls to the element that a selector finds; returns the position of its centre in the window.
    fn middle_of(&mut self, selector: &str) -> [f64; 2] {
        let script = format!(
            "(() => {{ const one = document.querySelector({selector:?}); one.scrollIntoView({{ block: 'center' }}); \
             const box = one.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; }})()"
        );
        let at = self.eval(&script);
        [0, 1].map(|n| at[n].as_f64().unwrap_or_else(|| panic!("{selector} is nowhere")))
    }

    /// Scrolls to the element that a selector finds, and clicks on its centre.
    pub(crate) fn click_on(&mut self, selector: &str) {
        let [x, y] = self.middle_of(selector);
        self.click(x, y);
    }

    /// Presses a key, by its name and with the text that it types.
    pub(crate) fn press(&mut self, key: &str) {
        let code = match key {
            "Tab" => 9,
            "Enter" => 13,
            "Escape" => 27,
            "ArrowLeft" => 37,
            "ArrowUp" => 38,
            "ArrowRight" => 39,
            "ArrowDown" => 40,
            _ => 0,
        };
        let typed = match key {
            "Enter" => "\r",
            key if key.chars().count() == 1 => key,
            _ => "",
        };
        for kind in ["keyDown", "keyUp"] {
            let mut parameters = json!({ "type": kind, "key": key, "windowsVirtualKeyCode": code });
            if kind == "keyDown" && !typed.is_empty() {
                parameters["text"] = json!(typed);
            }
            self.call("Input.dispatchKeyEvent", parameters);
        }
        self.painted();
    }

    /// Double-clicks on the centre of the element that a selector finds.
    pub(crate) fn double_click_on(&mut self, selector: &str) {
        let [x, y] = self.middle_of(selector);
        for count in [1, 2] {
            for kind in ["mousePressed", "mouseReleased"] {
                let parameters =
                    json!({ "type": kind, "x": x, "y": y, "button": "left", "clickCount": count });
                self.call("Input.dispatchMouseEvent", parameters);
            }
        }
        self.painted();
    }

    /// The contents of the window, as a PNG.
    pub(crate) fn picture(&mut self) -> Vec<u8> {
        let taken = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        from_base64(taken["data"].as_str().unwrap_or_default())
    }

    /// The page as it is printed: a PDF.
    pub(crate) fn pdf(&mut self) -> Vec<u8> {
        let printed = self.call("Page.printToPDF", json!({ "printBackground": true }));
        from_base64(printed["data"].as_str().unwrap_or_default())
    }

    /// What the policy of the page refused, in the words of the browser.
    pub(crate) fn refused(&mut self) -> Vec<String> {
        // All pending messages have arrived.
        self.painted();
        let entries = self.told.iter().filter(|message| message["method"] == "Log.entryAdded");
        let entries = entries.map(|message| &message["params"]["entry"]);
        entries.filter(|entry| entry["source"] == "security").map(|entry| entry["text"].to_string()).collect()
    }

    /// Checks that the page reported no error, and requested no file but itself.
    pub(crate) fn assert_quiet(&mut self) {
        // All pending messages have arrived.
        self.painted();
        let failure = self.says("document.documentElement.dataset.failure || ''");
        assert_eq!(failure, "", "the script failed");
        let mut requests = Vec::new();
        for message in &self.told {
            match message["method"].as_str().unwrap_or_default() {
                "Runtime.exceptionThrown" => panic!("{message}"),
                "Runtime.consoleAPICalled" | "Log.entryAdded" => panic!("the console says {message}"),
                "Network.requestWillBeSent" => {
                    let url = message["params"]["request"]["url"].as_str().unwrap_or_default();
                    // Embedded data are no requests.
                    if !url.starts_with("data:") {
                        requests.push(url.to_owned());
                    }
                }
                _ => {}
            }
        }
        assert_eq!(requests.len(), 1, "{requests:?}");
    }
}

/// Decodes base64 to bytes.
fn from_base64(text: &str) -> Vec<u8> {
    let value = |letter: u8| match letter {
        b'A'..=b'Z' => letter - b'A',
        b'a'..=b'z' => letter - b'a' + 26,
        b'0'..=b'9' => letter - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let (mut bytes, mut held, mut count) = (Vec::new(), 0_u32, 0);
    for letter in text.bytes().filter(|letter| *letter != b'=') {
        held = (held << 6 | u32::from(value(letter))) & 0xffff;
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((held >> count) as u8);
        }
    }
    bytes
}

impl Drop for Tab {
    fn drop(&mut self) {
        // It may have ended already; a browser that is killed leaves child processes.
        self.to.write_all(b"{\"id\":0,\"method\":\"Browser.close\"}\0").ok();
        self.child.wait().ok();
    }
}
