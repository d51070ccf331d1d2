//! Command lines as Windows keeps them: one text, of which every program makes words by itself, as `CommandLineToArgvW` does.

/// One text of a program's path and its arguments, from which that program gets them back. The path stands between quotation marks: without
/// them Windows would look for `C:\Program.exe` first.
///
/// # Errors
/// If a word cannot be told in this way.
pub fn join(path: &str, arguments: &[String]) -> Result<String, String> {
    for word in std::iter::once(path).chain(arguments.iter().map(String::as_str)) {
        if word.contains('\0') {
            return Err(format!("{word:?}: a command line has no zero letters"));
        }
    }
    if path.contains('"') {
        return Err(format!("{path}: a path has no quotation marks"));
    }
    let mut line = format!("\"{path}\"");
    for word in arguments {
        line.push(' ');
        push_quoted(&mut line, word);
    }
    // The service manager puts in values of variables, and knows no way to keep it from that.
    match line.matches('%').count() {
        0 | 1 => Ok(line),
        _ => Err(format!(
            "{line}: what stands between two % is the name of a variable to the service manager; use paths without %"
        )),
    }
}

fn push_quoted(line: &mut String, word: &str) {
    if !word.is_empty() && !word.contains([' ', '\t', '\n', '\x0b', '"']) {
        line.push_str(word);
        return;
    }
    line.push('"');
    let mut backslashes = 0;
    for letter in word.chars() {
        // Backslashes are themselves, but for those before a quotation mark, which are written twice.
        if letter == '"' {
            line.extend(std::iter::repeat_n('\\', backslashes + 1));
        }
        backslashes = if letter == '\\' { backslashes + 1 } else { 0 };
        line.push(letter);
    }
    line.extend(std::iter::repeat_n('\\', backslashes));
    line.push('"');
}

/// The words of a command line, the program's path first; none of an empty one.
pub fn split(line: &str) -> Vec<String> {
    let mut letters = line.trim_start_matches([' ', '\t']).chars().peekable();
    if letters.peek().is_none() {
        return Vec::new();
    }
    let mut words = vec![path(&mut letters)];
    loop {
        while letters.next_if(|letter| matches!(letter, ' ' | '\t')).is_some() {}
        if letters.peek().is_none() {
            return words;
        }
        words.push(word(&mut letters));
    }
}

type Letters<'a> = std::iter::Peekable<std::str::Chars<'a>>;

/// In the path a quotation mark only begins and ends what may have blanks.
fn path(letters: &mut Letters) -> String {
    let (mut path, mut quoted) = (String::new(), false);
    while let Some(letter) = letters.next_if(|letter| quoted || !matches!(letter, ' ' | '\t')) {
        match letter {
            '"' => quoted = !quoted,
            letter => path.push(letter),
        }
    }
    path
}

fn word(letters: &mut Letters) -> String {
    let (mut word, mut quoted) = (String::new(), false);
    while let Some(letter) = letters.next_if(|letter| quoted || !matches!(letter, ' ' | '\t')) {
        match letter {
            '\\' => {
                let mut n = 1;
                while letters.next_if_eq(&'\\').is_some() {
                    n += 1;
                }
                let before_mark = letters.peek() == Some(&'"');
                word.extend(std::iter::repeat_n('\\', if before_mark { n / 2 } else { n }));
                if before_mark && n % 2 == 1 {
                    letters.next();
                    word.push('"');
                }
            }
            // Two marks within quotation are one that is meant.
            '"' if quoted && letters.next_if_eq(&'"').is_some() => word.push('"'),
            '"' => quoted = !quoted,
            letter => word.push(letter),
        }
    }
    word
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owned(words: &[&str]) -> Vec<String> {
        words.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn words_are_written_as_windows_documents_it() {
        for (word, written) in [
            ("--once", "--once"),
            ("", r#""""#),
            (r"C:\bolide\certs\", r"C:\bolide\certs\"),
            (r"--certs=C:\Program Files\bolide\", r#""--certs=C:\Program Files\bolide\\""#),
            ("--hours=Mon-Fri 18:00-08:00, Sat-Sun", r#""--hours=Mon-Fri 18:00-08:00, Sat-Sun""#),
            (r#"--notify=msg * "it is \"over\"""#, r#""--notify=msg * \"it is \\\"over\\\"\"""#),
            (r#"\\\""#, r#""\\\\\\\"""#),
            ("naïve Größe", "\"naïve Größe\""),
        ] {
            let line = join(r"C:\b x\bolide.exe", &owned(&[word])).expect("a word");
            assert_eq!(line, format!(r#""C:\b x\bolide.exe" {written}"#));
            assert_eq!(split(&line), [r"C:\b x\bolide.exe", word], "{line}");
        }
    }

    #[test]
    fn a_line_is_read_as_windows_documents_it() {
        for (line, words) in [
            ("", vec![]),
            ("  ", vec![]),
            (
                r"C:\Windows\system32\svchost.exe -k netsvcs -p",
                vec![r"C:\Windows\system32\svchost.exe", "-k", "netsvcs", "-p"],
            ),
            ("x\t \"a b c\"  d e", vec!["x", "a b c", "d", "e"]),
            (r#"x "ab\"c" "\\" d"#, vec!["x", r#"ab"c"#, r"\", "d"]),
            (r#"x a\\\b d"e f"g h"#, vec!["x", r"a\\\b", "de fg", "h"]),
            (r#"x a\\\"b c d"#, vec!["x", r#"a\"b"#, "c", "d"]),
            (r#"x a\\\\"b c" d e"#, vec!["x", r"a\\b c", "d", "e"]),
            (r#"x "a""b" """#, vec!["x", r#"a"b"#, ""]),
            (r#""C:\a b"\c.exe" d" e"#, vec![r"C:\a b\c.exe d", "e"]),
            (r#"x "never closed \"#, vec!["x", r"never closed \"]),
        ] {
            assert_eq!(split(line), words, "{line}");
        }
    }

    #[test]
    fn whatever_words_there_are_they_come_back() {
        let letters = ['"', '\\', ' ', '\t', 'a', 'ü', '\n', '-', '='];
        // Every word of up to five of these letters, three to a line.
        let mut words = vec![String::new()];
        let mut newest = words.clone();
        for _ in 0..5 {
            newest = newest.iter().flat_map(|word| letters.map(|letter| format!("{word}{letter}"))).collect();
            words.extend(newest.iter().cloned());
        }
        for three in words.windows(3).step_by(2) {
            let line = join("bolide.exe", three).expect("no letter that cannot be told");
            assert_eq!(split(&line)[1..], *three, "{line:?}");
        }
    }

    #[test]
    fn words_that_the_service_manager_would_change_are_refused() {
        assert!(join("b.exe", &owned(&["a\0b"])).unwrap_err().contains("zero"));
        assert!(join("b\".exe", &[]).unwrap_err().contains("quotation"));
        assert!(join("b.exe", &owned(&["100%"])).is_ok());
        let why = join("b.exe", &owned(&["--certs=C:\\%USER%"])).unwrap_err();
        assert!(why.contains("--certs=C:\\%USER%") && why.contains("variable"), "{why}");
    }
}
