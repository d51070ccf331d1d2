//! The pictures of deploy/pictures that show a run: the page at two widths, its diagram of space and time, `bolide top`, the report.
//!
//! `cargo run --release -p tests --bin pictures -- [FOLDER]` (after `cargo build --release -p master`; needs Chromium and
//! `script`). A master and three workers run the free-slip benchmark of 64,000 elements; page and `top` are taken in mid-run,
//! diagram and report at the end.

use std::{
    path::{Path, PathBuf},
    process::{Command, ExitCode},
    time::Duration,
};

use serde_json::json;
use tests::{
    browser::{self, Browser},
    cluster::{Process, repository},
    terminal::Terminal,
};

fn main() -> ExitCode {
    let folder = std::env::args().nth(1).map_or_else(|| repository("deploy/pictures"), PathBuf::from);
    let Some(program) = browser::find() else {
        eprintln!("pictures: no chromium on this machine; nothing was drawn");
        return ExitCode::from(3);
    };
    let Ok(here) = std::env::current_exe() else { return ExitCode::FAILURE };
    match draw(&program, &here.with_file_name("bolide"), &folder) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("pictures: {error}");
            ExitCode::FAILURE
        }
    }
}

fn draw(program: &Path, bolide: &Path, folder: &Path) -> std::io::Result<()> {
    let files = tempfile::tempdir()?;
    let mut command = Command::new(bolide);
    command.args(["master", "--listen", "127.0.0.1:0", "--http", "127.0.0.1:0", "--spool"]);
    let master = Process::start("master", command.arg(files.path().join("spool")));
    let page = master.wait_for("page: http://").trim_start_matches("page: ").to_owned();
    let address = master.wait_for("listening on ").trim_start_matches("listening on ").to_owned();
    let worker = |name: &str, speed: &str| {
        let mut command = Command::new(bolide);
        command.args(["worker", "--master", &address, "--name", name, "--speed", speed, "--threads", "1"]);
        let worker = Process::start(name, &mut command);
        worker.wait_for("joined");
        worker
    };
    let _workers = [worker("pc-1", "1"), worker("pc-2", "1"), worker("old-pc", "0.5")];
    let mut browser = Browser::start(program, &files.path().join("profile"));
    // A page that opens on a wide screen shows all its boxes.
    browser.picture(1280, 900, false);
    browser.call("Page.navigate", json!({ "url": page }));
    browser.wait_for("document.getElementById('link')?.textContent === 'live'");
    let submit = |deck: &Path, cycles: &str| {
        let mut command = Command::new(bolide);
        command.args(["submit", "--master", &address, "--cycles", cycles, "--wait"]);
        Process::start("submit", command.arg(deck))
    };
    submit(&repository("tests/decks/plates-small.toml"), "200").wait();
    // Longer than the benchmark, so that it still runs when the last picture is taken.
    let text = std::fs::read_to_string(repository("deck/examples/plates-64k-free-slip.toml"))?;
    let longer = files.path().join("plates-64k-free-slip.toml");
    std::fs::write(&longer, text.replace("end_time = 100.0 ", "end_time = 2000.0 "))?;
    let mut submitted = submit(&longer, "4000");
    browser.wait_for("document.querySelectorAll('#jobs .job').length === 2");
    browser.evaluate("document.querySelector('#jobs .job').click()");
    browser.wait_for("document.getElementById('title').innerText.includes('64k')");
    // Some states and some seconds of what hosts do.
    browser.wait_for("Number(document.getElementById('bodies').dataset.cycle) > 300");
    browser.wait_for("document.getElementById('no-phases').hidden");
    let running = |browser: &mut Browser, name: &str, png: &str| {
        let facts = browser.evaluate("document.getElementById('facts').innerText");
        assert!(
            facts.as_str().is_some_and(|facts| facts.contains("running")),
            "{name} is not of a live run: {facts}"
        );
        write(folder, name, png)
    };
    let png = browser.picture(1280, 900, false);
    running(&mut browser, "page-live-1280.png", &png)?;
    let png = browser.picture(400, 900, true);
    running(&mut browser, "page-live-400.png", &png)?;

    let mut top = Terminal::start(&format!("{} top --master {address}", bolide.display()), 80, 14);
    // In the row of the job, not in the first line.
    top.wait_for("running  ");
    // The rate of cycles comes with the second look.
    std::thread::sleep(Duration::from_secs(3));
    let svg = files.path().join("top.svg");
    std::fs::write(&svg, top.screen().svg())?;
    top.press("q");
    assert_eq!(top.wait(), Some(0), "q leaves");

    // Workers say once a second what they did, each in its own second; at the end all speak of the same cycles.
    submitted.wait();
    browser.wait_for("document.querySelector('#facts .digest')?.textContent");
    // So narrow that the diagram has a row of its own.
    browser.picture(840, 900, false);
    let png = browser.picture_of("section:has(> #phases)");
    write(folder, "space-time.png", &png)?;
    browser.call("Page.navigate", json!({ "url": format!("file://{}", svg.display()) }));
    let png = browser.picture(696, 290, false);
    write(folder, "top.png", &png)?;
    let report = files.path().join("spool/job-2/report.html");
    browser.call("Page.navigate", json!({ "url": format!("file://{}", report.display()) }));
    let png = browser.picture(1000, 900, false);
    write(folder, "report.png", &png)
}

fn write(folder: &Path, name: &str, base64: &str) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let path = folder.join(name);
    let bytes = decode(base64);
    println!("{}: {} bytes", path.display(), bytes.len());
    std::fs::write(path, bytes)
}

/// Base64 as a browser writes it.
fn decode(text: &str) -> Vec<u8> {
    let digit = |byte: u8| match byte {
        b'A'..=b'Z' => Some(byte - b'A'),
        b'a'..=b'z' => Some(byte - b'a' + 26),
        b'0'..=b'9' => Some(byte - b'0' + 52),
        b'+' => Some(62),
        b'/' => Some(63),
        _ => None,
    };
    let digits: Vec<u8> = text.bytes().filter_map(digit).collect();
    let mut bytes = Vec::with_capacity(digits.len() * 3 / 4);
    for four in digits.chunks(4) {
        let word =
            four.iter().fold(0_u32, |word, digit| word << 6 | u32::from(*digit)) << (6 * (4 - four.len()));
        bytes.extend_from_slice(&word.to_be_bytes()[1..four.len()]);
    }
    bytes
}
