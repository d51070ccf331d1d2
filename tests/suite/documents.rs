//! The documents keep what they promise: links lead somewhere, the README's deck runs, and both overviews stay short.

use std::{
    fs,
    path::{Path, PathBuf},
};

use tests::cluster::repository;

/// Every Markdown file of the repository.
fn documents() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![repository("")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder of the repository is readable").flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            let name = name.to_string_lossy();
            // Git's own, artefacts and results are no documents.
            if name.starts_with('.') || name == "target" || name == "results" {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else if name.ends_with(".md") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// The text outside code blocks, where `[` begins no link.
fn prose(text: &str) -> String {
    let blocks = text.split("\n```").enumerate().filter(|(index, _)| index % 2 == 0);
    let outside: Vec<&str> = blocks.map(|(_, block)| block).collect();
    outside
        .join("\n")
        .split('`')
        .enumerate()
        .filter(|(index, _)| index % 2 == 0)
        .map(|(_, piece)| piece)
        .collect()
}

/// Where `[text](target)` and `![text](target)` lead.
fn links(text: &str) -> Vec<String> {
    let prose = prose(text);
    prose
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')'))
        .map(|(target, _)| target.to_owned())
        .collect()
}

/// The anchor that a heading gets: lower case, without punctuation, dashes for spaces.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect()
}

fn has_anchor(text: &str, wanted: &str) -> bool {
    text.lines()
        .filter(|line| line.starts_with('#'))
        .any(|line| anchor(line.trim_start_matches('#')) == wanted)
}

#[test]
fn every_link_of_a_document_leads_somewhere() {
    let documents = documents();
    assert!(documents.len() > 15, "{} documents", documents.len());
    let mut broken = Vec::new();
    let mut checked = 0;
    for document in &documents {
        let text = fs::read_to_string(document).expect("a document is readable");
        for link in links(&text) {
            if link.contains("://") {
                continue;
            }
            let (file, wanted) = link.split_once('#').unwrap_or((&link, ""));
            let target = if file.is_empty() {
                document.clone()
            } else {
                document.parent().unwrap_or(Path::new("")).join(file)
            };
            let leads = if wanted.is_empty() {
                target.exists()
            } else {
                fs::read_to_string(&target).is_ok_and(|text| has_anchor(&text, wanted))
            };
            checked += 1;
            if !leads {
                broken.push(format!("{}: {link}", document.display()));
            }
        }
    }
    assert!(checked > 100, "{checked} links");
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// The commands `bolide ...` of the code in a document: without prompts, comments, and what stands behind a pipe.
fn commands(text: &str) -> Vec<String> {
    let mut commands = Vec::new();
    let mut fenced = false;
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
            continue;
        }
        if !fenced && !line.starts_with("    ") {
            continue;
        }
        let line = line.trim_start();
        let line =
            line.split_once("$ ").filter(|(prompt, _)| !prompt.contains(' ')).map_or(line, |(_, rest)| rest);
        // What may be left out stands in brackets.
        let end = [" #", " |", " >", " &", ";", " ["].iter().filter_map(|mark| line.find(mark)).min();
        let line = &line[..end.unwrap_or(line.len())];
        if let Some(rest) = line.strip_prefix("cargo run --release -- ") {
            commands.push(format!("bolide {rest}"));
        } else if line.starts_with("bolide ") && line != "bolide mesh 1" && !line.contains(", ") {
            commands.push(line.trim_end_matches('\\').to_owned());
        }
    }
    commands
}

/// The words of a command; what stands in quotes is one.
fn words(command: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quote = None;
    for letter in command.chars() {
        match (letter, quote) {
            (' ', None) => words.push(String::new()),
            ('\'' | '"', None) => quote = Some(letter),
            (letter, Some(open)) if letter == open => quote = None,
            _ => words.last_mut().expect("one from the start").push(letter),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

#[test]
fn every_command_of_a_document_is_one_that_the_program_has() {
    use clap::{CommandFactory, error::ErrorKind};
    use master::command::Cli;
    let (mut seen, mut wrong) = (0, Vec::new());
    for document in documents() {
        let text = fs::read_to_string(&document).expect("a document is readable");
        for command in commands(&text) {
            // A transcript may show what it prints below a command; values in capitals stand for others.
            let Err(error) = Cli::command().try_get_matches_from(words(&command)) else {
                seen += 1;
                continue;
            };
            match error.kind() {
                ErrorKind::UnknownArgument | ErrorKind::InvalidSubcommand | ErrorKind::ArgumentConflict => {
                    wrong.push(format!("{}: {command}: {}", document.display(), error.kind()));
                }
                _ => seen += 1,
            }
        }
    }
    assert!(seen > 60, "{seen} commands");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_deck_of_the_readme_has_no_fault() {
    let readme = fs::read_to_string(repository("README.md")).expect("the README is in the repository");
    let (_, rest) = readme.split_once("```toml\n").expect("the README has a deck");
    let (deck, _) = rest.split_once("```").expect("the deck ends");
    let model = deck::read(deck, "README.md").unwrap_or_else(|faults| panic!("{faults:?}"));
    assert_eq!(model.mesh.parts[0].n_elements(), 3888);
}

#[test]
fn the_overviews_stay_short() {
    for (name, most) in [("README.md", 900), ("ARCHITECTURE.md", 2500)] {
        let text = fs::read_to_string(repository(name)).expect("an overview is in the repository");
        let words = text.split_whitespace().count();
        assert!(
            words <= most,
            "{name} has {words} words, at most {most}: move details to a document beside the code"
        );
    }
}

#[test]
fn the_citation_is_of_this_version() {
    let citation = fs::read_to_string(repository("CITATION.cff")).expect("the citation is in the repository");
    assert!(citation.contains(&format!("\nversion: {}\n", env!("CARGO_PKG_VERSION"))), "{citation}");
}

/// The last two cells of the row of a Markdown table that begins with this one.
fn last_cells(text: &str, first: &str) -> [String; 2] {
    let head = format!("| {first} |");
    let row = text.lines().find(|line| line.starts_with(&head)).unwrap_or_else(|| panic!("no row {first}"));
    let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
    [cells[cells.len() - 2].to_owned(), cells[cells.len() - 1].to_owned()]
}

/// Our defaults beside those of other codes are what a deck without these keys is read as.
#[test]
fn the_defaults_that_the_book_tells_are_those_of_the_code() {
    let page = fs::read_to_string(repository("deploy/book/coming-from.md")).expect("a page of the book");
    let (_, text) = page.split_once("## Defaults").expect("a table of defaults");
    let part = |name: &str, at: f64| {
        format!(
            "[[part]]\nname = \"{name}\"\nmaterial = \"STEEL_4340\"\nerosion = {{}}\n\
             box = {{ origin = [0, 0, {at}], size = [1, 1, 1], cell = 0.5 }}\n"
        )
    };
    let deck = format!(
        "title = \"defaults\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = 1\n[contact]\n{}{}",
        part("a", 0.0),
        part("b", 2.0)
    );
    let model = deck::read(&deck, "defaults.toml").unwrap_or_else(|faults| panic!("{faults:?}"));
    let (control, contact) = (&model.setup.control, model.setup.contact.as_ref().expect("contact"));
    let hourglass = model.mesh.parts[0].hourglass;
    let starts = |row: &str, words: String| {
        let [toml, _] = last_cells(text, row);
        assert!(toml.starts_with(&words), "{row}: the page says {toml:?}, the code {words:?}");
    };
    starts("factor of the time step", format!("`safety_factor` {:?}", control.safety_factor));
    starts("linear viscosity", format!("`linear_viscosity` {:?}", control.linear_viscosity));
    starts("quadratic viscosity", format!("`quadratic_viscosity` {:?}", control.quadratic_viscosity));
    starts("growth of the time step", format!("`growth` {:?}", control.growth));
    starts("stops on an energy error", format!("`energy_error` {:?}", control.energy_error));
    starts("penalty stiffness", format!("`stiffness` {:?}", contact.stiffness));
    starts("friction", format!("`friction` {}", contact.friction[1]));
    // Cells of 0.5 have the smallest faces.
    starts("gap of contact", format!("`gap_fraction` {:?}", contact.gap / 0.5));
    assert_eq!(format!("{:?}", hourglass.kind), "AssumedStrain");
    starts("hourglass control", format!("`assumed-strain` {}", hourglass.coefficient));
    assert!(!contact.interacts[0], "parts do not meet themselves");
    starts("contact of a body with itself", "`self_interaction` none".to_owned());
    assert!(!contact.ignores_initial);
    starts("parts that start inside others", "`initial_penetration` `refuse`".to_owned());
    assert!(model.setup.erosion.retain_inertia);
    starts("freed nodes", "`retain_inertia` true".to_owned());
}
