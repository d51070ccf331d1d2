//! BROWSER: a headless Chromium, driven over the protocol of its developer tools.
//!
//! One page. A command is one JSON message with an answer of the same number; events between are passed over. Conditions
//! are JavaScript expressions that are evaluated until they hold.

use std::{
    net::TcpStream,
    path::{Path, PathBuf},
    process::Command,
    time::Duration,
};

use serde_json::{Value, json};
use tungstenite::{Message, WebSocket, stream::MaybeTlsStream};

use crate::cluster::{Process, until};

/// Names under which systems install it.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// The browser of this machine, if it has one.
pub fn find() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name))).find(|p| p.is_file())
}

/// A browser with one page.
pub struct Browser {
    wire: WebSocket<MaybeTlsStream<TcpStream>>,
    next: u64,
    _process: Process,
}

impl Browser {
    /// Starts it with its profile in `folder`.
    ///
    /// # Panics
    /// If it does not come up.
    pub fn start(program: &Path, folder: &Path) -> Self {
        let mut command = Command::new(program);
        command
            .args(["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--remote-debugging-port=0"])
            // Software drawing: machines of CI have no graphics card.
            .args(["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-first-run"])
            .arg(format!("--user-data-dir={}", folder.display()))
            .arg("about:blank");
        let process = Process::start("chromium", &mut command);
        let line = process.wait_for("DevTools listening on ws://");
        let address = line.split("ws://").nth(1).and_then(|rest| rest.split('/').next()).expect("an address");
        let target = until(|| "the browser's page".to_owned(), || page_of(address));
        let (wire, _) = tungstenite::connect(target).expect("developer tools answer");
        if let MaybeTlsStream::Plain(stream) = wire.get_ref() {
            stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a time limit");
        }
        Self { wire, next: 0, _process: process }
    }

    /// Sends a command and waits for its answer.
    ///
    /// # Panics
    /// If it fails.
    pub fn call(&mut self, method: &str, params: Value) -> Value {
        self.next += 1;
        let text = json!({ "id": self.next, "method": method, "params": params }).to_string();
        self.wire.send(Message::text(text)).expect("sent");
        loop {
            let Message::Text(text) = self.wire.read().expect("an answer") else { continue };
            let mut value: Value = serde_json::from_str(&text).expect("JSON");
            if value["id"] == self.next {
                assert!(value["error"].is_null(), "{method}: {}", value["error"]);
                return value["result"].take();
            }
        }
    }

    /// Evaluates an expression; promises are waited for.
    ///
    /// # Panics
    /// If it throws.
    pub fn evaluate(&mut self, expression: &str) -> Value {
        let params = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let mut result = self.call("Runtime.evaluate", params);
        assert!(result["exceptionDetails"].is_null(), "{expression}: {}", result["exceptionDetails"]);
        result["result"]["value"].take()
    }

    /// Evaluates until the value is neither null nor false nor empty.
    ///
    /// # Panics
    /// At the deadline.
    pub fn wait_for(&mut self, expression: &str) -> Value {
        until(
            || expression.to_owned(),
            || {
                let value = self.evaluate(expression);
                let nothing = value.is_null() || value == json!(false) || value == json!("");
                (!nothing).then_some(value)
            },
        )
    }

    /// A picture of the page as PNG, base64, at a width, in light or dark.
    pub fn picture(&mut self, width: u32, height: u32, dark: bool) -> String {
        let metrics =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600 });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
        let scheme = if dark { "dark" } else { "light" };
        let features = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        self.call("Emulation.setEmulatedMedia", features);
        self.evaluate("new Promise(done => setTimeout(done, 1500))");
        self.shoot(json!({ "format": "png", "captureBeyondViewport": true }))
    }

    /// A picture of one element as PNG, base64, with a margin, as the page stands.
    ///
    /// # Panics
    /// If there is no such element.
    pub fn picture_of(&mut self, selector: &str) -> String {
        let clip = self.evaluate(&format!(
            "(() => {{ const r = document.querySelector({}).getBoundingClientRect(); return {{ x: r.x + scrollX - 6, \
             y: r.y + scrollY - 6, width: r.width + 12, height: r.height + 12, scale: 1 }} }})()",
            json!(selector)
        ));
        self.shoot(json!({ "format": "png", "captureBeyondViewport": true, "clip": clip }))
    }

    fn shoot(&mut self, params: Value) -> String {
        self.call("Page.captureScreenshot", params)["data"].as_str().unwrap_or_default().to_owned()
    }
}

/// The address of the developer tools of the first page.
fn page_of(address: &str) -> Option<String> {
    use std::io::{Read, Write};
    let mut stream = TcpStream::connect(address).ok()?;
    stream.set_read_timeout(Some(Duration::from_secs(10))).ok()?;
    write!(stream, "GET /json/list HTTP/1.1\r\nHost: {address}\r\n\r\n").ok()?;
    let mut bytes = Vec::new();
    let mut buffer = [0; 4096];
    // It may keep the connection open: the list ends with its bracket.
    while let Ok(n) = stream.read(&mut buffer) {
        bytes.extend_from_slice(&buffer[..n]);
        if n == 0 || bytes.trim_ascii_end().ends_with(b"]") {
            break;
        }
    }
    let text = String::from_utf8(bytes).ok()?;
    let list: Value = serde_json::from_str(&text[text.find("\r\n\r\n")?..]).ok()?;
    let pages = list.as_array()?.iter().find(|target| target["type"] == "page")?;
    pages["webSocketDebuggerUrl"].as_str().map(str::to_owned)
}
