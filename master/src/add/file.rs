//! The host file of `bolide add`, every fault at its line. `deploy/hosts/README.md` is the reference of the format.

use std::path::Path;

use deck::{
    Fault,
    fault::Faults,
    table::{Range, Table, Value},
};
use protocol::handshake::NAME_LIMIT;
use toml::de::DeTable;

/// Longest host file (bytes).
const MAX_TEXT: u64 = 1 << 20;
const MAX_HOSTS: usize = 10_000;
/// Most words of a list.
const MAX_WORDS: usize = 100;
/// Longest word (bytes).
const MAX_WORD: usize = 1000;

/// What a host file says.
#[derive(Clone, Debug, PartialEq)]
pub struct HostFile {
    /// The master as the hosts reach it, where the file names one.
    pub master: Option<String>,
    /// Every host, in the order of the file.
    pub hosts: Vec<Host>,
}

/// A machine on which one worker is started.
#[derive(Clone, Debug, PartialEq)]
pub struct Host {
    /// Name of the worker, unlike that of any other.
    pub name: String,
    /// What ssh dials.
    pub address: String,
    /// How it is reached and what runs there.
    pub way: Way,
    /// Started only when it is asked for by name.
    pub deferred: bool,
}

/// What a host can take over from `[defaults]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Way {
    /// User on the host; ssh's own choice by default.
    pub user: Option<String>,
    /// Port of the host's sshd; ssh's own choice by default.
    pub port: Option<u16>,
    /// Words to ssh, such as `["-i", "key"]`.
    pub ssh: Vec<String>,
    /// The binary there: a command, or a path from the user's home.
    pub path: String,
    /// Relative speed, or `auto`.
    pub speed: String,
    /// Compute threads; by default one for each core that the worker may use.
    pub threads: Option<u32>,
    /// Folder with the host's certificates, there.
    pub certs: Option<String>,
    /// Further flags of `bolide worker`.
    pub flags: Vec<String>,
}

impl Default for Way {
    fn default() -> Self {
        Self {
            user: None,
            port: None,
            ssh: Vec::new(),
            path: "bolide".to_owned(),
            speed: "1".to_owned(),
            threads: None,
            certs: None,
            flags: Vec::new(),
        }
    }
}

impl HostFile {
    /// The hosts of these names, deferred ones too; without names all that are not deferred.
    ///
    /// # Errors
    /// A name that the file does not have, or nothing to start.
    pub fn choose(&self, names: &[String]) -> Result<Vec<&Host>, String> {
        for name in names {
            if !self.hosts.iter().any(|host| host.name == *name) {
                let known: Vec<&str> = self.hosts.iter().map(|host| host.name.as_str()).collect();
                return Err(format!("no host {name:?} in the host file; it has {}", known.join(", ")));
            }
        }
        let asked = |host: &&Host| if names.is_empty() { !host.deferred } else { names.contains(&host.name) };
        let chosen: Vec<&Host> = self.hosts.iter().filter(asked).collect();
        if chosen.is_empty() {
            return Err("every host of the file is deferred; name those to start".to_owned());
        }
        Ok(chosen)
    }
}

/// Reads a host file.
///
/// # Errors
/// That the file cannot be read, or every fault in it, one per line.
pub fn read_file(path: &Path) -> Result<HostFile, String> {
    let size = std::fs::metadata(path).map_err(|e| format!("{}: {e}", path.display()))?.len();
    if size > MAX_TEXT {
        return Err(format!("{}: {size} bytes, at most {MAX_TEXT}", path.display()));
    }
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    read(&text, &path.display().to_string()).map_err(|faults| {
        let lines: Vec<String> = faults.iter().map(Fault::to_string).collect();
        lines.join("\n")
    })
}

/// Reads the text of a host file.
///
/// # Errors
/// Every fault in it, by place. Faults of syntax hide all others.
pub fn read(text: &str, file_name: &str) -> Result<HostFile, Vec<Fault>> {
    let faults = Faults::new(file_name, text);
    let (document, errors) = DeTable::parse_recoverable(text);
    for error in &errors {
        let at = error.span().map_or(0, |span| span.start);
        let message = error.message().trim().replace('\n', ", ");
        faults.add(at, format!("a syntax error ({message})"), "TOML", "mend the line");
    }
    if faults.count() > 0 {
        return Err(faults.into_list());
    }
    let host_file = read_document(document.get_ref(), &faults);
    if faults.count() > 0 { Err(faults.into_list()) } else { Ok(host_file) }
}

fn read_document(document: &DeTable<'_>, faults: &Faults<'_>) -> HostFile {
    let file = Table::new(document, 0, "the host file".to_owned(), faults);
    let master = file.get("master").and_then(|value| word(&value));
    let (mut defaults, mut address) = (Way::default(), None);
    if let Some(table) = file.get("defaults").and_then(|value| value.table("[defaults]".to_owned())) {
        defaults = read_way(&table, &defaults);
        address = table.get("address").and_then(|value| target(&value));
        table.finish();
    }
    let mut hosts: Vec<Host> = Vec::new();
    for table in file.tables("host", MAX_HOSTS) {
        let host = read_host(&table, &defaults, address.as_deref());
        if let Some(host) = host {
            if hosts.iter().any(|other| other.name == host.name) {
                let found = format!("a second host {:?}", host.name);
                faults.add(table.at, found, "a name for each worker", "choose another name");
            }
            hosts.push(host);
        }
        table.finish();
    }
    if hosts.is_empty() && faults.count() == 0 {
        faults.add(0, "no [[host]]", "at least one", "add [[host]]");
    }
    file.finish();
    HostFile { master, hosts }
}

fn read_host(table: &Table<'_>, defaults: &Way, address: Option<&str>) -> Option<Host> {
    let expected = "the name of the worker";
    let name = table.require("name", expected).and_then(|value| {
        let text = value.text()?;
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
        let first = text.chars().next();
        if text.len() > NAME_LIMIT
            || !first.is_some_and(|c| c.is_ascii_alphanumeric())
            || !text.chars().all(plain)
        {
            let expected =
                format!("1 to {NAME_LIMIT} letters, digits, - _ or ., starting with a letter or digit");
            value.fault(&expected, "choose a name, and write the machine as address = ...");
            return None;
        }
        Some(text.to_owned())
    });
    let address = match table.get("address") {
        Some(value) => target(&value),
        None => address.map(str::to_owned).or_else(|| name.clone()),
    };
    let deferred = table.get("deferred").and_then(|value| value.boolean()).unwrap_or(false);
    let way = read_way(table, defaults);
    Some(Host { name: name?, address: address?, way, deferred })
}

fn read_way(table: &Table<'_>, defaults: &Way) -> Way {
    let Way { user, port, ssh, path, speed, threads, certs, flags } = defaults.clone();
    let integer = |key, most| table.get(key).and_then(|value| value.integer(1, most));
    Way {
        user: table.get("user").and_then(|value| target(&value)).or(user),
        port: integer("port", 65_535).map(|port| port as u16).or(port),
        ssh: table.get("ssh").and_then(|value| words(&value)).unwrap_or(ssh),
        path: table.get("path").and_then(|value| word(&value)).unwrap_or(path),
        speed: table.get("speed").and_then(|value| read_speed(&value)).unwrap_or(speed),
        threads: integer("threads", 4096).map(|threads| threads as u32).or(threads),
        certs: table.get("certs").and_then(|value| word(&value)).or(certs),
        flags: table.get("flags").and_then(|value| words(&value)).unwrap_or(flags),
    }
}

fn read_speed(value: &Value<'_>) -> Option<String> {
    if value.is_text() {
        return value.one_of(&["auto"]).map(|_| "auto".to_owned());
    }
    value.number(Range::Positive).map(|speed| speed.to_string())
}

/// A text of one line that is no flag by mistake.
fn target(value: &Value<'_>) -> Option<String> {
    let text = word(value)?;
    if text.starts_with('-') || text.contains(char::is_whitespace) || text.contains('@') {
        value.fault("a name or an address without spaces, @ or a leading dash", "write user = ... beside it");
        return None;
    }
    Some(text)
}

fn word(value: &Value<'_>) -> Option<String> {
    let text = value.text()?;
    if text.is_empty() || text.len() > MAX_WORD || text.contains(char::is_control) {
        value.fault(&format!("1 to {MAX_WORD} bytes on one line"), "shorten it or fill it in");
        return None;
    }
    Some(text.to_owned())
}

fn words(value: &Value<'_>) -> Option<Vec<String>> {
    let items = value.items()?;
    if items.len() > MAX_WORDS {
        value.fault(&format!("at most {MAX_WORDS} words"), "shorten the list");
        return None;
    }
    let read: Vec<Option<String>> = items.iter().map(word).collect();
    read.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAB: &str = r#"
master = "pc1:7117"

[defaults]
user = "anna"
certs = "bolide-certs"
flags = ["--patience", "60"]

[[host]]
name = "pc2"
speed = 2

[[host]]
name = "pc3"
address = "10.0.0.3"
user = "bert"
speed = "auto"
threads = 4
port = 2222
path = "/opt/bolide"
flags = []
deferred = true
"#;

    #[test]
    fn a_host_takes_what_it_does_not_say_from_the_defaults() {
        let host_file = read(LAB, "hosts.toml").expect("no fault");
        assert_eq!(host_file.master.as_deref(), Some("pc1:7117"));
        let [two, three] = &host_file.hosts[..] else { panic!("{host_file:?}") };
        let way = &two.way;
        assert_eq!((two.address.as_str(), two.deferred), ("pc2", false));
        assert_eq!(
            (way.user.as_deref(), way.speed.as_str(), way.path.as_str()),
            (Some("anna"), "2", "bolide")
        );
        assert_eq!(way.flags, ["--patience", "60"]);
        let way = &three.way;
        assert_eq!((three.address.as_str(), three.deferred), ("10.0.0.3", true));
        assert_eq!((way.user.as_deref(), way.port, way.threads), (Some("bert"), Some(2222), Some(4)));
        assert_eq!((way.speed.as_str(), way.certs.as_deref()), ("auto", Some("bolide-certs")));
        assert!(way.flags.is_empty(), "{way:?}");
    }

    #[test]
    fn the_example_has_no_fault() {
        let host_file =
            read(include_str!("../../../deploy/hosts/hosts.toml"), "hosts.toml").expect("no fault");
        assert_eq!((host_file.hosts.len(), host_file.choose(&[]).map(|hosts| hosts.len())), (3, Ok(2)));
    }

    #[test]
    fn deferred_hosts_are_started_by_name_only() {
        let host_file = read(LAB, "hosts.toml").expect("no fault");
        let names = |asked: &[&str]| {
            let asked: Vec<String> = asked.iter().map(|&name| name.to_owned()).collect();
            host_file
                .choose(&asked)
                .map(|hosts| hosts.iter().map(|host| host.name.clone()).collect::<Vec<_>>())
        };
        assert_eq!(names(&[]), Ok(vec!["pc2".to_owned()]));
        assert_eq!(names(&["pc3"]), Ok(vec!["pc3".to_owned()]));
        assert_eq!(names(&["pc4"]), Err("no host \"pc4\" in the host file; it has pc2, pc3".to_owned()));
        let mut all_deferred = host_file.clone();
        all_deferred.hosts.iter_mut().for_each(|host| host.deferred = true);
        assert!(all_deferred.choose(&[]).is_err());
    }

    #[test]
    fn faults_name_line_value_and_what_to_do() {
        for (text, words) in [
            ("", "no [[host]]"),
            ("[[host]]\nspeed = 1", "without \"name\""),
            ("[[host]]\nname = \"-oProxyCommand=x\"", "starting with a letter or digit"),
            ("[[host]]\nname = \"a\"\naddress = \"-oProxyCommand=x\"", "leading dash"),
            ("[[host]]\nname = \"a\"\nuser = \"b c\"", "without spaces"),
            ("[[host]]\nname = \"a\"\nspeed = 0", "speed = 0"),
            ("[[host]]\nname = \"a\"\nspeed = \"fast\"", "one of auto"),
            ("[[host]]\nname = \"a\"\npath = \"x\\ny\"", "on one line"),
            ("[[host]]\nname = \"a\"\nthreads = 5000", "1 to 4096"),
            ("[[host]]\nname = \"a\"\nspede = 1", "write \"speed\""),
            ("[[host]]\nname = \"a\"\n[[host]]\nname = \"a\"", "a second host \"a\""),
            ("[[host]\nname = 1", "a syntax error"),
        ] {
            let faults = read(text, "hosts.toml").expect_err(text);
            let said: Vec<String> = faults.iter().map(Fault::to_string).collect();
            assert!(said.iter().any(|line| line.contains(words)), "{text}: {said:?}");
            assert!(said.iter().all(|line| line.starts_with("hosts.toml:")), "{said:?}");
        }
    }
}
