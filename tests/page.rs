//! The page in a real browser: drop a deck, see what it describes, run it, turn and cut the model, fetch results, run again, compare; and
//! the same page of `bolide report`, without a master.

use std::process::Command;

use tests::{
    browser::{self, Browser},
    cluster::{Process, repository, said},
};

const BOLIDE: &str = env!("CARGO_BIN_EXE_bolide");

/// Waits for the deck that was dropped to be shown, and runs it.
fn run_it(browser: &mut Browser, name: &str) {
    browser.wait_for(&format!(
        "!document.getElementById('deck').hidden && document.getElementById('h-deck').textContent.startsWith('{name}')"
    ));
    browser.evaluate("document.getElementById('run').click()");
}

/// Gives a control of the page a value, as a user does.
fn set(browser: &mut Browser, id: &str, value: &str) {
    browser.evaluate(&format!(
        "(() => {{ const c = document.getElementById('{id}'); if (c.type === 'checkbox') c.checked = {value} === 'true'; \
         else c.value = {value}; c.dispatchEvent(new Event('input')); c.dispatchEvent(new Event('change')); }})()",
        value = serde_json::json!(value)
    ));
}

/// A number that a canvas tells about what it shows.
fn shown(browser: &mut Browser, id: &str, what: &str) -> f64 {
    browser
        .evaluate(&format!("Number(document.getElementById('{id}').dataset.{what})"))
        .as_f64()
        .expect("a number")
}

/// Presses a key where the focus is, as a user does: what a browser makes of it follows.
fn strike(browser: &mut Browser, key: &str) {
    // By these a browser knows a key that does something of its own.
    let (number, text) = match key {
        "Tab" => (9, ""),
        "Enter" => (13, "\r"),
        _ => (0, ""),
    };
    for (kind, text) in [("keyDown", text), ("keyUp", "")] {
        let event = serde_json::json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": number, "text": text });
        browser.call("Input.dispatchKeyEvent", event);
    }
}

/// Gives a canvas the focus and presses a key.
fn press(browser: &mut Browser, id: &str, key: &str) {
    browser.evaluate(&format!("document.getElementById('{id}').focus()"));
    strike(browser, key);
}

/// Goes from control to control until one has the focus of which `is` holds, an expression about `e`.
fn tab_to(browser: &mut Browser, is: &str) {
    for _ in 0..100 {
        strike(browser, "Tab");
        if browser.evaluate(&format!("(e => Boolean({is}))(document.activeElement)")) == true {
            return;
        }
    }
    panic!("no control comes to: {is}");
}

/// The share of a canvas that bodies cover: what has another colour than its corner.
fn covered(id: &str) -> String {
    format!(
        "(() => {{ const c = document.getElementById('{id}'), d = document.createElement('canvas'); \
         d.width = c.width; d.height = c.height; const t = d.getContext('2d'); t.drawImage(c, 0, 0); \
         const p = new Uint32Array(t.getImageData(0, 0, d.width, d.height).data.buffer); \
         return p.reduce((n, one) => n + (one !== p[0]), 0) / p.length }})()"
    )
}

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
    // Before it is submitted it says what it describes, and is drawn.
    browser.wait_for("document.getElementById('deck-bodies').dataset.faces > 1000");
    let forecast = browser.evaluate("document.getElementById('deck').innerText");
    let forecast = forecast.as_str().expect("text");
    for words in ["no fault", "3,456 elements", "projectile", "STEEL", "first step"] {
        assert!(forecast.contains(words), "{words} in {forecast}");
    }
    assert_eq!(browser.evaluate("document.querySelectorAll('#jobs li').length"), 0);
    // One that is refused after it takes its card away: nothing is left that runs the other under a wrong name.
    browser.evaluate(&drop_files(&[("bad.toml", &bad)]));
    browser.wait_for("!document.getElementById('faults').hidden");
    assert_eq!(browser.evaluate("document.getElementById('deck').hidden"), true);
    browser.evaluate(&drop_files(&[("plates-small.toml", &deck)]));
    run_it(&mut browser, "plates-small.toml");
    browser.wait_for("document.getElementById('facts').innerText.includes('queued')");
    // One click on Cancel asks, and ends nothing.
    browser.evaluate("document.getElementById('cancel').click()");
    assert_eq!(browser.evaluate("document.getElementById('cancel').textContent"), "End this job?");
    browser.evaluate("document.getElementById('cancel').dispatchEvent(new Event('blur'))");
    assert_eq!(browser.evaluate("document.getElementById('cancel').textContent"), "Cancel");
    // Held, it waits for its user; resumed, for workers again.
    browser.evaluate("document.getElementById('hold').click()");
    browser.wait_for("document.getElementById('facts').innerText.includes('held, waits for')");
    assert_eq!(browser.evaluate("document.getElementById('hold').hidden"), true);
    assert_eq!(browser.evaluate("document.getElementById('cancel').hidden"), false);
    browser.evaluate("document.getElementById('resume').click()");
    browser.wait_for("document.getElementById('facts').innerText.includes('queued')");
    assert_eq!(browser.evaluate("document.getElementById('resume').hidden"), true);
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
    let around = shown(&mut browser, "bodies", "around");
    press(&mut browser, "bodies", "ArrowRight");
    assert_ne!(shown(&mut browser, "bodies", "around"), around, "an arrow key turns");
    let colours = "(() => { const c = document.getElementById('bodies'), d = document.createElement('canvas'); \
         d.width = c.width; d.height = c.height; const t = d.getContext('2d'); t.drawImage(c, 0, 0); \
         return new Set(new Uint32Array(t.getImageData(0, 0, d.width, d.height).data.buffer)).size })()";
    assert!(browser.evaluate(colours).as_u64().expect("a number") > 20, "bodies are drawn in many colours");

    // The address is that of the job: opened anew it shows the same one.
    let address_of_job = browser.evaluate("location.href");
    let address_of_job = address_of_job.as_str().expect("an address").to_owned();
    assert!(address_of_job.ends_with("/jobs/1"), "{address_of_job}");
    browser.call("Page.navigate", serde_json::json!({ "url": address_of_job }));
    browser.wait_for("document.getElementById('title')?.textContent.startsWith('job 1:')");
    browser.wait_for("document.getElementById('bodies').dataset.cycle === '40'");

    // A cut takes faces away and opens others, a part can go, and the bar has field and unit.
    let faces = "Number(document.getElementById('bodies').dataset.faces)";
    let whole = browser.evaluate(faces).as_u64().expect("a number");
    // Two boxes: 24 x 12 x 8 and 24 x 12 x 4 cells.
    assert_eq!(whole, 2 * (24 * 12 + 24 * 8 + 12 * 8) + 2 * (24 * 12 + 24 * 4 + 12 * 4));
    set(&mut browser, "field", "pressure");
    assert_eq!(browser.wait_for("document.getElementById('what').textContent"), "pressure (Mbar)");
    set(&mut browser, "cut", "x");
    let half = 2 * (12 * 12 + 12 * 8 + 12 * 8) + 2 * (12 * 12 + 12 * 4 + 12 * 4);
    browser.wait_for(&format!("{faces} === {half}"));
    browser.evaluate("document.querySelector('#parts input').click()");
    let plate = 2 * (12 * 12 + 12 * 4 + 12 * 4);
    browser.wait_for(&format!("{faces} === {plate}"));
    browser.evaluate("document.querySelector('#parts input').click()");
    set(&mut browser, "cut", "");
    browser.wait_for(&format!("{faces} === {whole}"));
    set(&mut browser, "map", "heat");
    set(&mut browser, "edges", "false");

    // Verdict, curves of gauges and parts, and files.
    browser.wait_for("document.getElementById('measures').innerText.includes('energy error')");
    set(&mut browser, "quantity", "kinetic");
    browser.wait_for("document.getElementById('history-legend').innerText.includes('projectile')");
    browser.wait_for("document.querySelectorAll('#files a').length > 5");
    let fetched = browser.evaluate(
        "(async () => { const link = [...document.querySelectorAll('#files a')].find(a => a.textContent === 'state-000001.vtu' || \
         a.textContent === 'history.csv'); const bytes = await (await fetch(link.href)).arrayBuffer(); \
         return [link.textContent, [...new Uint8Array(bytes)]]; })()",
    );
    let results = folder.path().join("fetched");
    let mut command = Command::new(BOLIDE);
    command.args(["results", "1", "--master", &address, "--out"]).arg(&results);
    assert!(command.status().expect("bolide runs").success());
    let bytes: Vec<u8> =
        fetched[1].as_array().expect("bytes").iter().map(|b| b.as_u64().expect("a byte") as u8).collect();
    let file = results.join(fetched[0].as_str().expect("a name"));
    assert_eq!(bytes, std::fs::read(&file).expect("the command has fetched it"), "{}", file.display());
    // The archive holds the same files.
    let archive = browser.evaluate(
        "(async () => { const bytes = await (await fetch(document.getElementById('all-files').href)).arrayBuffer(); \
         return [...new Uint8Array(bytes)]; })()",
    );
    let archive: Vec<u8> =
        archive.as_array().expect("bytes").iter().map(|b| b.as_u64().expect("a byte") as u8).collect();
    std::fs::write(folder.path().join("job.tar"), archive).expect("room");
    let unpacked = Command::new("tar").arg("-xf").arg("job.tar").current_dir(folder.path()).status();
    assert!(unpacked.expect("tar runs").success());
    for entry in std::fs::read_dir(&results).expect("results") {
        let path = entry.expect("an entry").path();
        let other = folder.path().join("job-1").join(path.file_name().expect("a name"));
        assert_eq!(std::fs::read(&path).ok(), std::fs::read(&other).ok(), "{}", path.display());
    }

    // A block of the checkpoint is computed a third time, by the browser, where the binary has the module for that.
    let offered = browser.evaluate("!document.getElementById('again-box').hidden");
    assert_eq!(offered, cfg!(has_recompute), "deploy/wasm/build.sh builds the module");
    if cfg!(has_recompute) {
        browser.evaluate("document.getElementById('again-run').click()");
        let verdict = browser.wait_for(
            "!document.getElementById('again-run').disabled && document.getElementById('again-verdict').textContent",
        );
        assert_eq!(verdict, "the same bits");
        let hashes =
            browser.evaluate("[...document.querySelectorAll('#again-hashes code')].map(e => e.textContent)");
        assert_eq!(hashes[0].as_str().map(str::len), Some(32));
        assert_eq!(hashes[0], hashes[1]);
    }

    // No wider than a small screen, on which the job comes first.
    browser.picture(400, 900, true);
    assert_eq!(browser.evaluate("document.documentElement.scrollWidth"), 400);
    browser.picture(1280, 900, false);

    // Everything that can be used has a name that is read aloud.
    let nameless = browser.evaluate(
        "[...document.querySelectorAll('button, input, select, textarea, a, canvas[role]')].filter(e => !e.ariaLabel && \
         !e.getAttribute('aria-label') && !e.labels?.length && !e.textContent.trim() && !e.closest('label')).map(e => e.id)",
    );
    assert_eq!(nameless, serde_json::json!([]));

    // Again, with another velocity, and both beside each other.
    browser.evaluate("document.getElementById('again').click()");
    browser.wait_for("!document.getElementById('deck').hidden && document.getElementById('deck-text').value");
    browser.evaluate(
        "document.getElementById('deck-text').value = document.getElementById('deck-text').value.replace('-0.05', '-0.06')",
    );
    browser
        .evaluate("document.getElementById('cycles').value = '40'; document.getElementById('run').click()");
    let other = browser.wait_for(
        "document.getElementById('title').textContent.startsWith('job 2') && \
         document.querySelector('#facts .digest')?.textContent",
    );
    assert_ne!(other, digest, "another velocity");
    set(&mut browser, "beside", "1");
    browser.wait_for(
        "!document.getElementById('other').hidden && document.getElementById('other').dataset.cycle === '40'",
    );
    browser.wait_for("document.getElementById('measured').innerText.includes('differs')");
    browser.wait_for("document.getElementById('history-legend').innerText.includes('job 1')");
    // Runs of one size have one scale.
    assert_eq!(shown(&mut browser, "bodies", "radius"), shown(&mut browser, "other", "radius"));

    // The keyword deck with its mesh is one problem, and has the digest of its files.
    browser.evaluate(&drop_files(&[("block-on-plate-mesh.k", &mesh), ("block-on-plate.k", &block)]));
    run_it(&mut browser, "block-on-plate.k");
    let both = browser.wait_for(
        "document.getElementById('title').textContent.startsWith('job 3') && \
         document.querySelector('#facts .digest')?.textContent",
    );
    let keyword = repository("deck/examples/block-on-plate.k").display().to_string();
    let run = said(Command::new(BOLIDE).args(["run", &keyword, "--cycles", "40", "--no-output", "--json"]));
    let summary: serde_json::Value = serde_json::from_str(&run.out).expect("a summary");
    assert_eq!(both, summary["digest"]);

    // With twelve jobs, by the keyboard alone: choose one, hold it, resume it, cancel it.
    let deck = path.display().to_string();
    for _ in 4..=12 {
        let mut command = Command::new(BOLIDE);
        command.args(["submit", &deck, "--master", &address, "--min-workers", "3", "--no-output"]);
        assert!(command.status().expect("bolide runs").success());
    }
    browser.call("Page.navigate", serde_json::json!({ "url": address_of_job.replace("/jobs/1", "/jobs/2") }));
    browser.wait_for("document.querySelectorAll('#jobs li').length === 12");
    browser.wait_for("document.getElementById('title').textContent.startsWith('job 2:')");
    tab_to(&mut browser, "e.closest('#jobs') && e.textContent.startsWith('job 9')");
    strike(&mut browser, "Enter");
    browser.wait_for("document.getElementById('title').textContent.startsWith('job 9:')");
    tab_to(&mut browser, "e.id === 'hold'");
    strike(&mut browser, "Enter");
    browser.wait_for("document.getElementById('facts').innerText.includes('held, waits for')");
    browser.wait_for("document.getElementById('counts').textContent.endsWith('8 queued, 1 held')");
    tab_to(&mut browser, "e.id === 'resume'");
    strike(&mut browser, "Enter");
    browser.wait_for("document.getElementById('facts').innerText.includes('queued')");
    tab_to(&mut browser, "e.id === 'cancel'");
    strike(&mut browser, "Enter");
    strike(&mut browser, "Enter");
    browser.wait_for("document.getElementById('facts').innerText.includes('cancelled')");
    let twice = "(ids => ids.filter((id, i) => ids.indexOf(id) !== i))([...document.querySelectorAll('[id]')].map(e => e.id))";
    assert_eq!(browser.evaluate(twice), serde_json::json!([]), "each control has a name of its own");

    // One that runs is held, and shows its curves again when it goes on.
    let long = std::fs::read_to_string(&path).expect("a deck of this repository");
    browser.evaluate("document.getElementById('cycles').value = ''");
    browser.evaluate(&drop_files(&[("long.toml", &long)]));
    run_it(&mut browser, "long.toml");
    let runs = "document.getElementById('title').textContent.startsWith('job 13:') && \
         document.getElementById('facts').innerText.includes('running') && !document.getElementById('panels').hidden";
    browser.wait_for(runs);
    browser.evaluate("document.getElementById('hold').click()");
    browser.wait_for("document.getElementById('facts').innerText.includes('held, waits for')");
    // The page looks once a second.
    std::thread::sleep(std::time::Duration::from_millis(2500));
    browser.evaluate("document.getElementById('resume').click()");
    browser.wait_for(runs);
    browser.evaluate("document.getElementById('cancel').click(); document.getElementById('cancel').click()");
    browser.wait_for("document.getElementById('facts').innerText.includes('cancelled')");

    let run = said(Command::new(BOLIDE).args(["run", &deck, "--cycles", "40", "--no-output", "--json"]));
    let summary: serde_json::Value = serde_json::from_str(&run.out).expect("a summary");
    assert_eq!(digest, summary["digest"]);
}

#[test]
fn a_report_shows_results_without_a_master_mirrored_and_beside_each_other() {
    let Some(program) = browser::find() else {
        assert!(std::env::var_os("CI").is_none(), "CI has a browser: .ci/run installs it");
        println!("skipped: no chromium on this machine");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let bar = repository("deck/examples/taylor-copper.toml").display().to_string();
    let deck = std::fs::read_to_string(&bar).expect("an example");
    // A quarter of a bar, by intent.
    let quarter = folder.path().join("quarter.toml");
    let text = "title = \"quarter\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = 0.002\n[symmetry]\nplanes = [\"x\", \"y\"]\n\
        [[part]]\nname = \"bar\"\nmaterial = \"COPPER_TAYLOR_BENCHMARK\"\nvelocity = [0, 0, -227]\n\
        box = { origin = [-3, -3, 0], size = [6, 6, 12], cells = [6, 6, 12] }\n[[wall]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n";
    std::fs::write(&quarter, text).expect("room");
    assert!(deck.contains("COPPER_TAYLOR_BENCHMARK"));
    let mut folders = Vec::new();
    // The same quarter in other units.
    let si = folder.path().join("si.toml");
    let text = text
        .replace("mm-ms-kg", "SI")
        .replace("0.002", "2e-6")
        .replace("[-3, -3, 0], size = [6, 6, 12]", "[-3e-3, -3e-3, 0], size = [6e-3, 6e-3, 12e-3]");
    std::fs::write(&si, text).expect("room");
    let (quarter, si) = (quarter.display().to_string(), si.display().to_string());
    for (name, deck) in [("si", &si), ("bar", &bar), ("quarter", &quarter)] {
        let out = folder.path().join(name);
        let run = said(Command::new(BOLIDE).args(["run", deck, "--cycles", "60", "--out"]).arg(&out));
        assert!(run.out.contains("quality    "), "{}", run.out);
        folders.push(out);
    }
    let mut command = Command::new(BOLIDE);
    let report = Process::start("report", command.arg("report").args(&folders));
    let page = report.wait_for("page: http://").trim_start_matches("page: ").to_owned();
    let mut browser = Browser::start(&program, &folder.path().join("profile"));
    browser.call("Page.navigate", serde_json::json!({ "url": page }));
    browser.wait_for("document.getElementById('title')?.textContent.startsWith('job 3: quarter')");
    // Three mirror images stand around the quarter.
    browser.wait_for("document.getElementById('bodies').dataset.images === '4'");
    set(&mut browser, "mirror", "false");
    assert_eq!(browser.evaluate("document.getElementById('bodies').dataset.images"), "1");
    assert_eq!(browser.evaluate("document.getElementById('submit-box').hidden"), true);
    browser.wait_for("document.getElementById('measures').innerText.includes('energy error')");
    // The bar was longer before: the picture takes that in too, and keeps it.
    browser.evaluate("document.getElementById('reset').click()");
    let (end, short) = (shown(&mut browser, "bodies", "cycle"), shown(&mut browser, "bodies", "radius"));
    set(&mut browser, "state", "0");
    browser.wait_for("document.getElementById('bodies').dataset.cycle === '0'");
    let long = shown(&mut browser, "bodies", "radius");
    assert!(long > short, "{long} {short}");
    set(&mut browser, "state", "100");
    browser.wait_for(&format!("document.getElementById('bodies').dataset.cycle === '{end}'"));
    assert_eq!(shown(&mut browser, "bodies", "radius").to_bits(), long.to_bits());
    set(&mut browser, "beside", "2");
    browser.wait_for("document.getElementById('measured').innerText.includes('differs')");
    browser.wait_for("Number(document.getElementById('other').dataset.faces) > 100");
    // The bar is longer than twice the quarter: each fills its picture, which the page says, and both turn together.
    let radii = ["bodies", "other"].map(|id| shown(&mut browser, id, "radius"));
    assert!(2.0 * radii[0] < radii[1], "{radii:?}");
    assert_eq!(browser.evaluate("document.getElementById('scales').hidden"), false);
    // The quarter would cover 0.03 of its picture in the frame of the bar, which is slender itself.
    for (id, least) in [("bodies", 0.05), ("other", 0.04)] {
        let covered = browser.evaluate(&covered(id)).as_f64().expect("a number");
        assert!(covered > least, "{id} covers {covered} of its picture");
    }
    let before = shown(&mut browser, "other", "around");
    press(&mut browser, "bodies", "ArrowRight");
    assert_ne!(shown(&mut browser, "other", "around"), before);
    assert_eq!(shown(&mut browser, "other", "around"), shown(&mut browser, "bodies", "around"));
    // Numbers in other units stand with them, and are not compared.
    set(&mut browser, "beside", "1");
    browser.wait_for(
        "document.getElementById('measures').innerText.includes('job 1 has other units than job 3')",
    );
    let measured = browser.evaluate("document.getElementById('measured').innerText");
    let measured = measured.as_str().expect("text");
    let end = measured.lines().find(|line| line.starts_with("end")).expect("a row");
    assert!(end.contains(" ms") && end.contains("e-6 s") && !end.contains('%'), "{end}");
    browser.wait_for("document.getElementById('history-legend').innerText.includes('job 1 has other units')");
    let refused = browser.evaluate(
        "fetch('../api/jobs?name=x.toml', { method: 'POST', body: '[control]' }).then(answer => answer.status)",
    );
    assert_eq!(refused, 422, "a deck with faults");
    // The report of the folder opens in the page, with its style and without scripts.
    let styled = browser.evaluate(
        "fetch('../api/jobs/2/files/report.html').then(answer => answer.headers.get('content-security-policy'))",
    );
    assert!(styled.as_str().is_some_and(|policy| policy.starts_with("default-src 'none'; ")), "{styled}");
}
