//! MAIL: a message through this host's `sendmail`, which every mail system for Unix brings (Postfix, Exim, msmtp, nullmailer).

use std::{
    io::Write,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use base64::{Engine, prelude::BASE64_STANDARD};

use super::Over;

/// Where it is when it is not in the PATH.
const USUAL: [&str; 2] = ["/usr/sbin", "/usr/lib"];

/// Reads an address of mail or the name of a user of this host.
///
/// # Errors
/// If sendmail could take it for something else.
pub fn address(text: &str) -> Result<String, String> {
    let plain = |byte: u8| byte.is_ascii_graphic() && !b",;:<>()\"\\".contains(&byte);
    if text.is_empty() || text.starts_with('-') || !text.bytes().all(plain) {
        return Err("expected one address such as anna@example.com".to_owned());
    }
    Ok(text.to_owned())
}

/// The program that takes mail.
///
/// # Errors
/// If this host has none.
pub fn sendmail() -> Result<PathBuf, String> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::env::split_paths(&path).chain(USUAL.map(PathBuf::from));
    folders.map(|folder| folder.join("sendmail")).find(|file| file.is_file()).ok_or_else(|| {
        format!(
            "--mail: found no sendmail in the PATH, {}; install one (msmtp-mta forwards to a mail server), or use --webhook",
            USUAL.join(" or ")
        )
    })
}

/// Hands the message to sendmail, which delivers it or keeps it.
///
/// # Errors
/// If sendmail is missing or refuses.
pub fn send(address: &str, over: &Over) -> Result<(), String> {
    send_through(&sendmail()?, address, over).map_err(|why| format!("--mail {address}: {why}"))
}

fn send_through(sendmail: &Path, address: &str, over: &Over) -> Result<(), String> {
    let mut command = Command::new(sendmail);
    // `-i`: a line with a dot alone does not end it.
    command.args(["-i", address]).stdin(Stdio::piped()).stdout(Stdio::null());
    let mut child = command.spawn().map_err(|error| format!("{}: {error}", sendmail.display()))?;
    let written =
        child.stdin.take().map_or(Ok(()), |mut input| input.write_all(message(address, over).as_bytes()));
    let status = child.wait().map_err(|error| error.to_string())?;
    if !status.success() {
        return Err(format!("{}: {status}", sendmail.display()));
    }
    written.map_err(|error| format!("{}: {error}", sendmail.display()))
}

/// Headers and text (RFC 5322, 2045 and 2047). sendmail adds the sender and the date.
fn message(address: &str, over: &Over) -> String {
    let folder =
        over.folder.as_ref().map(|folder| format!("results: {}\n", folder.display())).unwrap_or_default();
    let reason = if over.reason.is_empty() { String::new() } else { format!("reason: {}\n", over.reason) };
    let text = BASE64_STANDARD.encode(format!("{}\n{reason}{folder}", over.line()));
    let mut lines = String::new();
    // Base64 is ASCII: any place divides it.
    for start in (0..text.len()).step_by(76) {
        lines.push_str(&text[start..text.len().min(start + 76)]);
        lines.push('\n');
    }
    format!(
        "To: {address}\nSubject: {}\nMIME-Version: 1.0\nContent-Type: text/plain; charset=utf-8\nContent-Transfer-Encoding: base64\n\n{lines}",
        subject(&over.line())
    )
}

/// A header's value. What is not plain ASCII becomes encoded words of 75 characters at most, one in each line.
fn subject(line: &str) -> String {
    if line.bytes().all(|byte| byte == b' ' || byte.is_ascii_graphic())
        && line.len() <= 70
        && !line.contains("=?")
    {
        return line.to_owned();
    }
    let (mut words, mut word) = (Vec::new(), String::new());
    for letter in line.chars() {
        if word.len() + letter.len_utf8() > 45 {
            words.push(std::mem::take(&mut word));
        }
        word.push(letter);
    }
    words.push(word);
    let encoded = words.iter().map(|word| format!("=?UTF-8?B?{}?=", BASE64_STANDARD.encode(word)));
    encoded.collect::<Vec<_>>().join("\n ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn over(title: &str) -> Over {
        Over {
            job: "7".to_owned(),
            title: title.to_owned(),
            state: "done",
            folder: Some("/tmp/x".into()),
            reason: String::new(),
        }
    }

    /// The text after the headers.
    fn text(message: &str) -> String {
        let (_, body) = message.split_once("\n\n").expect("headers and a text");
        let bytes = BASE64_STANDARD.decode(body.replace('\n', "")).expect("base64");
        String::from_utf8(bytes).expect("UTF-8")
    }

    #[cfg(unix)]
    #[test]
    fn sendmail_is_handed_the_message() {
        let folder = tempfile::tempdir().expect("a folder");
        let sendmail = folder.path().join("sendmail");
        let took = folder.path().join("took");
        let script = format!("#!/bin/sh\necho \"$@\" > {0}\ncat >> {0}\n", took.display());
        // By another process: a file that this one has open, if only in a child that another test starts, cannot be run.
        let install = |script: &str| {
            let words = "printf '%s' \"$SCRIPT\" > \"$0.new\" && chmod +x \"$0.new\" && mv \"$0.new\" \"$0\"";
            let made = Command::new("sh").args(["-c", words]).arg(&sendmail).env("SCRIPT", script).status();
            assert!(made.expect("a shell").success());
        };
        install(&script);
        let over = over("job 7 (plate.toml)");
        assert_eq!(send_through(&sendmail, "anna@lab", &over), Ok(()));
        let took = std::fs::read_to_string(&took).expect("it was called");
        let (arguments, message) = took.split_once('\n').expect("lines");
        assert_eq!(arguments, "-i anna@lab");
        assert!(message.starts_with(&format!("To: anna@lab\nSubject: {}\n", over.line())), "{message}");
        assert_eq!(text(message), format!("{}\nresults: /tmp/x\n", over.line()));
        install("#!/bin/sh\nexit 75\n");
        let refused = send_through(&sendmail, "anna@lab", &over).expect_err("it was refused");
        assert!(refused.ends_with("exit status: 75"), "{refused}");
    }

    #[test]
    fn no_title_adds_a_header() {
        let message =
            message("anna@lab", &over("x\nBcc: eve@lab, und ein Ärger mit sehr langen Namen von Dateien"));
        let (headers, _) = message.split_once("\n\n").expect("headers and a text");
        assert!(headers.is_ascii() && headers.lines().all(|line| line.len() <= 84), "{headers}");
        assert!(!headers.contains("Bcc"), "{headers}");
        assert!(text(&message).contains("Ärger"));
    }

    #[test]
    fn an_address_is_one_and_no_flag() {
        for bad in ["", "-bs", "a b", "a,b", "a@b\nBcc: c", "<a@b>", "ä@b"] {
            assert!(address(bad).is_err(), "{bad}");
        }
        assert!(address("anna@example.com").is_ok() && address("root").is_ok());
    }
}
