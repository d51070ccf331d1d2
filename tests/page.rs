//! The page in a real browser: drop a deck, see it run, turn the model, read the digest.

use std::process::Command;

use tests::{
    browser::{self, Browser},
    cluster::{Process, repository, said},
};

const BOLIDE: &str = env!("CARGO_BIN_EXE_bolide");

/// What a drop of files does, by their names and texts.
fn drop_files(files: &[(&str, &str)]) -> String {
    let files = serde_json::json!(files);
    format!(
        "(() => {{ const data = new DataTransfer(); \
         for (const [name, text] of {files}) data.items.add(new File([text], name)); \
         document.getElementById('drop').dispatchEvent(new DragEvent('drop', {{ dataTransfer: data, bubbles: true, \
         cancelable: true }})); return true; }})()"
    )
}

#[test]
fn a_dropped_deck_runs_is_turned_and_gives_the_digest_of_the_command_line() {
    let Some(program) = browser::find() else {
        assert!(std::env::var_os("CI").is_none(), "CI has a browser: .ci/run installs it");
        println!("skipped: no chromium on this machine");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let spool = folder.path().join("spool");
    let mut command = Command::new(BOLIDE);
    command.args(["master", "--listen", "127.0.0.1:0", "--http", "127.0.0.1:0", "--spool"]).arg(&spool);
    let master = Process::start("master", &mut command);
    let page = master.wait_for("page: http://");
    let page = page.trim_start_matches("page: ").to_owned();
    let listening = master.wait_for("listening on ");
    let address = listening.trim_start_matches("listening on ").to_owned();

    let mut browser = Browser::start(&program, &folder.path().join("profile"));
    browser.call("Page.navigate", serde_json::json!({ "url": page }));
    browser.wait_for("document.getElementById('link')?.textContent === 'live'");
    // The token has left the address bar; without workers the page says how to start one.
    assert_eq!(browser.evaluate("location.search"), "");
    let join = browser.wait_for(
        "!document.getElementById('no-hosts').hidden && document.getElementById('join').textContent",
    );
    assert_eq!(join, format!("bolide worker --master {address}"));
    let submit = browser.evaluate("document.getElementById('submit-line').textContent");
    assert_eq!(submit, format!("bolide submit DECK.toml --master {address}"));

    // A deck with a fault: shown at its line, not submitted.
    let path = repository("tests/decks/plates-small.toml");
    let deck = std::fs::read_to_string(&path).expect("a deck of this repository");
    let bad = deck.replace("gap_length = 0.1 ", "gap_length = -1 ");
    let line = 1 + deck.lines().position(|l| l.starts_with("gap_length")).expect("the deck has a gap");
    browser.evaluate(&drop_files(&[("bad.toml", &bad)]));
    let faults = browser
        .wait_for("!document.getElementById('faults').hidden && document.getElementById('faults').innerText");
    let faults = faults.as_str().expect("text");
    assert!(faults.contains(&format!("line {line}")) && faults.contains("bad.toml"), "{faults}");

    // A keyword deck without the mesh that it includes is refused at that line, and so are two decks at once.
    let read = |name: &str| {
        std::fs::read_to_string(repository(&format!("deck/examples/{name}")))
            .expect("an example of this repository")
    };
    let (block, mesh) = (read("block-on-plate.k"), read("block-on-plate-mesh.k"));
    let told = "!document.getElementById('faults').hidden && document.getElementById('faults').innerText";
    browser.evaluate("document.getElementById('faults').hidden = true");
    browser.evaluate(&drop_files(&[("block-on-plate.k", &block)]));
    let faults = browser.wait_for(told);
    assert!(faults.as_str().is_some_and(|faults| faults.contains("block-on-plate-mesh.k")), "{faults}");
    browser.evaluate("document.getElementById('faults').hidden = true");
    browser.evaluate(&drop_files(&[("a.toml", &deck), ("b.toml", &deck)]));
    let faults = browser.wait_for(told);
    assert!(faults.as_str().is_some_and(|faults| faults.contains("2 decks (a.toml, b.toml)")), "{faults}");

    // A good one runs as soon as there are workers.
    browser.evaluate("document.getElementById('cycles').value = '40'");
    browser.evaluate(&drop_files(&[("plates-small.toml", &deck)]));
    browser.wait_for("document.getElementById('facts').innerText.includes('queued')");
    // One click on Cancel asks, and ends nothing.
    browser.evaluate("document.getElementById('cancel').click()");
    assert_eq!(browser.evaluate("document.getElementById('cancel').textContent"), "End this job?");
    browser.evaluate("document.getElementById('cancel').dispatchEvent(new Event('blur'))");
    assert_eq!(browser.evaluate("document.getElementById('cancel').textContent"), "Cancel");
    let mut workers = Vec::new();
    for name in ["pc-1", "pc-2"] {
        let mut command = Command::new(BOLIDE);
        command.args(["worker", "--master", &address, "--name", name, "--threads", "1"]);
        workers.push(Process::start(name, &mut command));
    }
    browser.wait_for("document.querySelectorAll('#hosts tr').length === 2");
    let digest = browser.wait_for("document.querySelector('#facts .digest')?.textContent");

    // The model is drawn, and turns by the keyboard.
    browser.wait_for("document.getElementById('bodies').dataset.cycle === '40'");
    let around = browser.evaluate("document.getElementById('bodies').dataset.around");
    browser.evaluate("document.getElementById('bodies').focus()");
    for kind in ["keyDown", "keyUp"] {
        let key = serde_json::json!({ "type": kind, "key": "ArrowRight", "code": "ArrowRight" });
        browser.call("Input.dispatchKeyEvent", key);
    }
    let turned = browser.evaluate("document.getElementById('bodies').dataset.around");
    assert_ne!(turned, around, "an arrow key turns");
    let colours = "(() => { const c = document.getElementById('bodies'), d = document.createElement('canvas'); \
         d.width = c.width; d.height = c.height; const t = d.getContext('2d'); t.drawImage(c, 0, 0); \
         return new Set(new Uint32Array(t.getImageData(0, 0, d.width, d.height).data.buffer)).size })()";
    assert!(browser.evaluate(colours).as_u64().expect("a number") > 20, "bodies are drawn in many colours");

    // No wider than a small screen.
    browser.picture(400, 900, true);
    assert_eq!(browser.evaluate("document.documentElement.scrollWidth"), 400);

    // The keyword deck with its mesh is one problem, and has the digest of its files.
    browser.evaluate(&drop_files(&[("block-on-plate-mesh.k", &mesh), ("block-on-plate.k", &block)]));
    let both = browser.wait_for(
        "document.getElementById('title').textContent.startsWith('job 2') && \
         document.querySelector('#facts .digest')?.textContent",
    );
    let keyword = repository("deck/examples/block-on-plate.k").display().to_string();
    let run = said(Command::new(BOLIDE).args(["run", &keyword, "--cycles", "40", "--no-output", "--json"]));
    let summary: serde_json::Value = serde_json::from_str(&run.out).expect("a summary");
    assert_eq!(both, summary["digest"]);

    let deck = path.display().to_string();
    let run = said(Command::new(BOLIDE).args(["run", &deck, "--cycles", "40", "--no-output", "--json"]));
    let summary: serde_json::Value = serde_json::from_str(&run.out).expect("a summary");
    assert_eq!(digest, summary["digest"]);
}
