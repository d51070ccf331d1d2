//! A deck and the files that it refers to, as one text: what is sent to a master, and what [`crate::read`] takes.
//!
//! A deck of one file and no options is its own text. Any other starts with the line `#bolide-bundle 1`; then come
//! lines `units NAME`, `case NUMBER`, `parameter NAME VALUE`, `title WORDS`, `perturb AMPLITUDE SEED`, `refine FACTOR`, and for each file, the deck first, `file BYTES NAME` with its text below.
//! A file from outside the folder of the deck is announced by `outside` instead of `file`. Who reads a deck of somebody else may not want
//! that file shown, so no fault or warning quotes it.

use std::{collections::BTreeSet, fs, io::Read, path::Path};

use toml::de::DeTable;

use crate::{
    fault::{Fault, Faults},
    include::{beside, includes},
    limits::MAX_TITLE,
    log::Warning,
    parameters::{MAX_PARAMETERS, Parameters, is_parameter, substituted_if_possible},
    perturb::Perturbation,
    refine::MAX_FACTOR,
};

const FIRST: &str = "#bolide-bundle 1";
/// What is told in place of words of a file outside the deck's folder.
const CONCEALED: &str = "a line that is not shown, for its file stands outside the deck's folder";

/// Most files of a deck.
pub const MAX_FILES: usize = 1_000;
/// Most bytes of a deck with its files.
pub const MAX_BYTES: usize = 256 << 20;

/// What a deck does not say itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Consistent units of a keyword deck; guessed from its densities where absent.
    pub units: Option<String>,
    /// The case of a keyword deck with several.
    pub case: Option<u32>,
    /// Values of the parameters that the deck leaves open.
    pub parameters: Parameters,
    /// A title in place of the deck's, by which others tell its runs apart.
    pub title: Option<String>,
    /// How the nodes are moved once the mesh is made.
    pub perturbation: Option<Perturbation>,
    /// How many times as many cells blocks have along every direction; none for as many as the deck says.
    pub refine: Option<u32>,
}

/// The kinds of text that are a deck.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Toml,
    Keyword,
    Bundle,
}

impl Kind {
    /// The kind of a text: keyword decks start with `*` or `$`.
    pub(crate) fn of(text: &str) -> Self {
        let first = text.trim_start_matches('\u{feff}').trim_start();
        match first.as_bytes().first() {
            Some(b'*' | b'$') => Self::Keyword,
            _ if text.starts_with(FIRST) => Self::Bundle,
            _ => Self::Toml,
        }
    }
}

/// Named texts, the deck first.
pub(crate) struct Bundle<'a> {
    pub(crate) options: Options,
    pub(crate) files: Vec<(&'a str, &'a str)>,
    /// Names of files that stand outside the deck's folder.
    pub(crate) outside: Vec<&'a str>,
}

impl<'a> Bundle<'a> {
    /// Takes a text apart. A text that is no bundle is a deck without other files.
    pub(crate) fn of(text: &'a str, name: &'a str) -> Result<Self, Vec<Fault>> {
        let mut bundle = Self { options: Options::default(), files: Vec::new(), outside: Vec::new() };
        if Kind::of(text) != Kind::Bundle {
            bundle.files.push((name, text));
            return Ok(bundle);
        }
        let broken = |at: usize| {
            let faults = Faults::new(name, text);
            let advice = "let submit or run make the bundle";
            faults.add(
                at,
                faults.quote(at, at + 60),
                "a heading of a bundle and all that it announces",
                advice,
            );
            faults.into_list()
        };
        let mut at = FIRST.len();
        while at < text.len() {
            let end = text[at..].find('\n').map_or(text.len(), |n| at + n);
            let line = text[at..end].trim();
            let start = at;
            at = (end + 1).min(text.len());
            let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
            match word {
                "" => {}
                "units" => bundle.options.units = Some(rest.to_string()),
                "case" => bundle.options.case = Some(rest.parse().map_err(|_| broken(start))?),
                "parameter" => {
                    let (name, value) = parameter(rest).ok_or_else(|| broken(start))?;
                    if bundle.options.parameters.len() == MAX_PARAMETERS {
                        return Err(broken(start));
                    }
                    bundle.options.parameters.insert(name, value);
                }
                "title" if rest.chars().count() <= MAX_TITLE && !rest.chars().any(char::is_control) => {
                    bundle.options.title = Some(rest.to_string());
                }
                "perturb" => {
                    bundle.options.perturbation = Some(perturbation(rest).ok_or_else(|| broken(start))?);
                }
                "refine" => {
                    let factor = rest.parse().ok().filter(|factor| (2..=MAX_FACTOR).contains(factor));
                    bundle.options.refine = Some(factor.ok_or_else(|| broken(start))?);
                }
                "file" | "outside" => {
                    let (bytes, name) = rest.split_once(' ').ok_or_else(|| broken(start))?;
                    let bytes: usize = bytes.parse().map_err(|_| broken(start))?;
                    let end = at.checked_add(bytes).ok_or_else(|| broken(start))?;
                    let body = text.get(at..end).ok_or_else(|| broken(start))?;
                    if bundle.files.len() == MAX_FILES {
                        return Err(broken(start));
                    }
                    bundle.files.push((name, body));
                    if word == "outside" {
                        bundle.outside.push(name);
                    }
                    at = end;
                }
                _ => return Err(broken(start)),
            }
        }
        if bundle.files.is_empty() {
            return Err(broken(0));
        }
        Ok(bundle)
    }

    /// Faults without the words that they quote of files outside the deck's folder.
    pub(crate) fn conceal(&self, mut faults: Vec<Fault>) -> Vec<Fault> {
        for fault in faults.iter_mut().filter(|fault| self.outside.contains(&fault.file.as_str())) {
            fault.read = CONCEALED.to_string();
        }
        faults
    }

    /// The same of a warning.
    pub(crate) fn conceal_words(&self, warning: &mut Warning) {
        if self.outside.contains(&warning.file.as_str()) {
            warning.words = format!("{CONCEALED}, and it is not done as it says");
        }
    }

    /// The text of a file by its name.
    pub(crate) fn file(&self, name: &str) -> Option<usize> {
        self.files.iter().position(|(known, _)| *known == name)
    }
}

/// The text of a file that a deck refers to.
pub struct Opened {
    pub text: String,
    /// It stands outside the folder of the deck.
    pub is_outside: bool,
}

/// A deck with every file that it refers to, ready for [`crate::read`]. `open` gives the text of a file by the path
/// that the deck's own `path` leads to, or nothing; a file that is missing is a fault when the deck is read.
///
/// # Errors
/// If there are too many files, or too many bytes.
pub fn gather(
    path: &str,
    text: String,
    options: &Options,
    open: &mut dyn FnMut(&str) -> Option<String>,
) -> Result<String, String> {
    let mut open = |path: &str| open(path).map(|text| Opened { text, is_outside: false });
    gather_from(path, text, options, &mut open)
}

/// As [`gather`], where `open` tells which files stand outside the folder of the deck.
///
/// # Errors
/// As [`gather`].
pub fn gather_from(
    path: &str,
    text: String,
    options: &Options,
    open: &mut dyn FnMut(&str) -> Option<Opened>,
) -> Result<String, String> {
    let mut files = vec![(path.to_string(), text)];
    let mut outside: BTreeSet<String> = BTreeSet::new();
    let mut tried: BTreeSet<String> = BTreeSet::from([path.to_string()]);
    let mut folders: Vec<String> = Vec::new();
    let mut bytes = files[0].1.len();
    let mut next = 0;
    while next < files.len() {
        let (name, text) = &files[next];
        let wanted = match Kind::of(text) {
            Kind::Keyword => includes(name, text, &mut folders),
            Kind::Toml if next == 0 && !options.parameters.is_empty() => {
                mesh_files(name, &substituted_if_possible(text, &options.parameters))
            }
            Kind::Toml if next == 0 => mesh_files(name, text),
            _ => Vec::new(),
        };
        for candidates in wanted {
            for candidate in candidates {
                if files.iter().any(|(known, _)| *known == candidate) {
                    break;
                }
                if !tried.insert(candidate.clone()) {
                    continue;
                }
                let Some(Opened { text, is_outside }) = open(&candidate) else { continue };
                if is_outside {
                    outside.insert(candidate.clone());
                }
                bytes += text.len();
                if files.len() == MAX_FILES || bytes > MAX_BYTES {
                    return Err(format!(
                        "{path}: more than {MAX_FILES} files or {MAX_BYTES} bytes with its includes; join or shorten them"
                    ));
                }
                files.push((candidate, text));
                break;
            }
        }
        next += 1;
    }
    if files.len() == 1 && *options == Options::default() {
        return Ok(files.swap_remove(0).1);
    }
    let mut packed = format!("{FIRST}\n");
    if let Some(units) = &options.units {
        packed += &format!("units {}\n", units.replace(char::is_whitespace, ""));
    }
    if let Some(case) = options.case {
        packed += &format!("case {case}\n");
    }
    for (name, value) in &options.parameters {
        packed += &format!("parameter {name} {value:?}\n");
    }
    if let Some(title) = &options.title {
        packed += &format!("title {}\n", title.replace(char::is_control, " ").trim());
    }
    if let Some(Perturbation { nodes, seed }) = options.perturbation {
        packed += &format!("perturb {nodes:?} {seed}\n");
    }
    if let Some(factor) = options.refine {
        packed += &format!("refine {factor}\n");
    }
    for (name, text) in &files {
        let word = if outside.contains(name) { "outside" } else { "file" };
        packed += &format!("{word} {} {}\n{text}\n", text.len(), name.replace('\n', " "));
    }
    Ok(packed)
}

/// The bytes of a file that a deck refers to: of a regular one, as devices and pipes have no end.
///
/// # Errors
/// Why it cannot be read, and what to do.
pub fn bytes_of(path: &Path) -> Result<Vec<u8>, String> {
    if fs::metadata(path).is_ok_and(|about| !about.is_file() && !about.is_dir()) {
        return Err("this is no regular file; name one, as devices and pipes have no end".to_string());
    }
    bytes_of_deck(path)
}

/// The bytes of a deck, which may come through a pipe: no more than a deck may have.
///
/// # Errors
/// Why it cannot be read, and what to do.
pub fn bytes_of_deck(path: &Path) -> Result<Vec<u8>, String> {
    let about = fs::metadata(path).map_err(|e| e.to_string())?;
    if about.is_dir() {
        return Err("this is a folder; name a deck in it".to_string());
    }
    let too_large =
        |bytes: u64| format!("{bytes} bytes; a deck has at most {MAX_BYTES} with its includes, shorten it");
    if about.len() > MAX_BYTES as u64 {
        return Err(too_large(about.len()));
    }
    let mut bytes = Vec::new();
    // It may grow as it is read.
    let file = fs::File::open(path).map_err(|e| e.to_string())?;
    file.take(MAX_BYTES as u64 + 1).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
    if bytes.len() > MAX_BYTES { Err(too_large(bytes.len() as u64)) } else { Ok(bytes) }
}

/// The text of the bytes of a deck. Comments of keyword decks are written in all kinds of encodings, so what is no UTF-8 is replaced there;
/// in a TOML deck it is an error.
///
/// # Errors
/// The line, and what to do.
pub fn text_of(bytes: Vec<u8>) -> Result<String, String> {
    let error = match String::from_utf8(bytes) {
        Ok(text) => return Ok(text),
        Err(error) => error,
    };
    let (bytes, valid) = (error.as_bytes(), error.utf8_error().valid_up_to());
    let first = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start().first();
    if matches!(first, Some(b'*' | b'$')) {
        return Ok(String::from_utf8_lossy(bytes).into_owned());
    }
    let line = 1 + bytes.iter().take(valid).filter(|byte| **byte == b'\n').count();
    Err(format!("line {line} is no text in UTF-8; save the deck in UTF-8"))
}

/// `NAME VALUE` of a parameter.
fn parameter(words: &str) -> Option<(String, f64)> {
    let (name, value) = words.split_once(' ')?;
    let value = value.parse::<f64>().ok().filter(|value| value.is_finite())?;
    is_parameter(name).then(|| (name.to_string(), value))
}

/// `AMPLITUDE SEED` of a perturbation.
fn perturbation(words: &str) -> Option<Perturbation> {
    let (nodes, seed) = words.split_once(' ')?;
    let read = Perturbation { nodes: nodes.parse().ok()?, seed: seed.parse().ok()? };
    read.is_fit().then_some(read)
}

/// The mesh files that a TOML deck names; what cannot be read is a fault later.
fn mesh_files(path: &str, text: &str) -> Vec<Vec<String>> {
    let Ok(document) = DeTable::parse(text) else { return Vec::new() };
    let parts = document.get_ref().get("part").and_then(|parts| parts.get_ref().as_array());
    let file = |part: &toml::Spanned<toml::de::DeValue<'_>>| {
        let mesh = part.get_ref().as_table()?.get("mesh")?.get_ref().as_table()?;
        Some(beside(path, mesh.get("file")?.get_ref().as_str()?))
    };
    parts.into_iter().flatten().filter_map(file).map(|name| vec![name]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_a_device_and_what_is_no_text_are_no_decks() {
        let why = |path: &str| bytes_of(Path::new(path)).expect_err("it is no deck");
        assert!(why(env!("CARGO_MANIFEST_DIR")).contains("this is a folder"));
        #[cfg(unix)]
        {
            assert!(why("/dev/zero").contains("no regular file"));
            let endless = bytes_of_deck(Path::new("/dev/zero")).expect_err("it has no end");
            assert!(endless.contains("bytes; a deck has at most"), "{endless}");
        }
        assert!(bytes_of(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"))).is_ok());
        let told = text_of(b"title = \"x\"\n# gr\xfcn\n".to_vec());
        assert_eq!(told, Err("line 2 is no text in UTF-8; save the deck in UTF-8".to_string()));
        // It is the first character that tells a keyword deck, not a star somewhere.
        assert!(text_of(b"# 3 * 4 gr\xfcn\n".to_vec()).is_err());
        assert_eq!(text_of(b"$ gr\xfcn\n*KEYWORD\n".to_vec()).as_deref(), Ok("$ gr\u{fffd}n\n*KEYWORD\n"));
    }

    #[test]
    fn a_deck_of_one_file_is_its_own_bundle() {
        let packed = gather("a/deck.toml", "title = \"x\"".to_string(), &Options::default(), &mut |_| None);
        assert_eq!(packed.as_deref(), Ok("title = \"x\""));
    }

    #[test]
    fn includes_are_gathered_once_from_where_they_stand_and_come_back() {
        let texts = [
            ("a/main.k", "*KEYWORD\n*INCLUDE\nmesh/one.k\nmissing.k\n*END\n"),
            ("a/mesh/one.k", "*KEYWORD\n*INCLUDE\n$ twice\ntwo.k\n*include\n two.k \n"),
            ("a/mesh/two.k", "$ nothing\u{e9}\n"),
        ];
        let mut asked = Vec::new();
        let options = Options {
            units: Some("mm-s-t".to_string()),
            case: Some(7),
            parameters: Parameters::from([("t".to_string(), 0.1), ("v".to_string(), -3e300)]),
            title: Some("one of many".to_string()),
            perturbation: Some(Perturbation { nodes: 1e-9, seed: u64::MAX }),
            refine: Some(3),
        };
        let packed = gather(texts[0].0, texts[0].1.to_string(), &options, &mut |path| {
            asked.push(path.to_string());
            texts.iter().find(|(name, _)| *name == path).map(|(_, text)| (*text).to_string())
        })
        .expect("few files");
        assert_eq!(asked, ["a/mesh/one.k", "a/missing.k", "a/mesh/two.k"]);
        let bundle = Bundle::of(&packed, "other").expect("whole");
        assert_eq!(bundle.files, texts);
        assert_eq!(bundle.options, options);
        for cut in 0..packed.len() {
            if let Some(part) = packed.get(..cut) {
                // Every piece is read or refused.
                let _ = Bundle::of(part, "cut");
            }
        }
    }
}
