//! AS SERVICE: `bolide service`: a master or a worker that Windows starts with the machine.
//!
//! The service manager keeps a command line, `bolide service run ... worker --master ...`, whose flags are checked when it is
//! registered. From where it is started nobody can tell, so paths in it are whole.

use std::{
    io::Read,
    path::{Path, PathBuf},
    process::ExitCode,
};

use clap::{ArgMatches, CommandFactory, FromArgMatches, Subcommand, ValueHint, parser::ValueSource};
use protocol::tls;
use system::Service;

use crate::{
    command::{Cli, Command},
    shell::{print, tell},
};

/// What runs as a service.
const DAEMONS: [&str; 2] = ["master", "worker"];
/// Who runs a service that names nobody: a user with few rights, whom every Windows has.
const ACCOUNT: &str = "LocalService";
/// Most letters of a name.
const NAME_LIMIT: usize = 80;
/// Most bytes of a password.
const PASSWORD_LIMIT: u64 = 1024;
/// What a process ends with whose flags are wrong.
const WRONG_FLAGS: u8 = 2;

/// What to do about services.
#[derive(Clone, Debug, Subcommand)]
pub enum ServiceArgs {
    /// Register a worker or a master, as administrator
    Install {
        /// Its name [default: bolide-master or bolide-worker]
        #[arg(long, value_parser = name)]
        name: Option<String>,
        /// The user it runs as [default: LocalService]
        #[arg(long)]
        account: Option<String>,
        /// File with its password, - for standard input
        #[arg(long, value_name = "FILE", requires = "account")]
        password_from: Option<PathBuf>,
        /// Its folder [default: %ProgramData%\bolide\NAME]
        #[arg(long)]
        folder: Option<PathBuf>,
        /// `master` or `worker`, and its flags
        #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true, value_name = "COMMAND")]
        command: Vec<String>,
    },
    /// Stop a service and remove it, as administrator; its folder stays
    Remove {
        /// As it was registered: bolide-worker
        name: String,
    },
    /// What the service manager starts
    #[command(hide = true)]
    Run {
        /// Its name
        #[arg(long)]
        name: String,
        /// Where it starts
        #[arg(long)]
        folder: PathBuf,
        /// The command
        #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true)]
        command: Vec<String>,
    },
}

/// A name that is good for a service, a folder and a command.
fn name(text: &str) -> Result<String, String> {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || "-_.".contains(letter);
    if (1..=NAME_LIMIT).contains(&text.len())
        && text.chars().all(plain)
        && !text.starts_with(['.', '-'])
        && !text.ends_with('.')
    {
        return Ok(text.to_owned());
    }
    Err(format!("expected at most {NAME_LIMIT} letters, digits, hyphens, underscores and dots"))
}

/// Registers, removes, or runs a service. `begin` is what does the command of one that runs, and `join` exchanges a worker's token.
///
/// # Errors
/// Why not, as a sentence.
pub fn run(
    args: ServiceArgs,
    join: impl FnOnce(&Command) -> Result<(), String>,
    begin: impl FnOnce(Command) -> Result<ExitCode, String> + Send + 'static,
) -> Result<ExitCode, String> {
    match args {
        ServiceArgs::Install { name, account, password_from, folder, command } => {
            let daemon = Daemon::parse(&command).unwrap_or_else(|error| error.exit());
            let name = name.unwrap_or_else(|| format!("bolide-{}", daemon.kind));
            let usual = system::service::folder(&name)?;
            let folder = folder.as_deref().map_or(Ok(usual), whole)?;
            join(&daemon.command)?;
            let service = Service {
                account: account.unwrap_or_else(|| ACCOUNT.to_owned()),
                password: password_from.as_deref().map(password).transpose()?,
                ..daemon.service(name, folder)?
            };
            let told = system::service::install(&service)?;
            let name = service.name;
            print(&format!("installed {name}: it starts with Windows, and again after failures"))?;
            told.iter().try_for_each(|line| print(line))?;
            if matches!(&daemon.command, Command::Worker(args) if args.yield_to_owner.is_some()) {
                print(
                    "a service sees no keyboard and no mouse: to yield to whoever types, start a worker at logon",
                )?;
            }
            print(&format!("start it now: net start {name}"))?;
        }
        ServiceArgs::Remove { name } => {
            system::service::remove(&name)?;
            print(&format!("removed {name}; its folder stays"))?;
        }
        ServiceArgs::Run { name, folder, command } => {
            let body = move || match Daemon::parse(&command) {
                Ok(daemon) => code_of(begin(daemon.command)),
                Err(error) => {
                    tell(&format!("bolide: this executable does not know the flags of its service: {error}"));
                    WRONG_FLAGS
                }
            };
            system::service::run(&name, &folder, Box::new(body))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// What the service manager hears that a command came to.
fn code_of(result: Result<ExitCode, String>) -> u8 {
    match result {
        Ok(_) => 0,
        Err(reason) => {
            tell(&format!("bolide: {reason}"));
            1
        }
    }
}

/// What is to run as a service.
struct Daemon {
    kind: &'static str,
    command: Command,
    /// As it was written.
    matches: ArgMatches,
}

impl Daemon {
    fn parse(words: &[String]) -> Result<Self, clap::Error> {
        let mut cli = Cli::command();
        let first = words.first().map_or("", String::as_str);
        let Some(kind) = DAEMONS.into_iter().find(|known| *known == first) else {
            let why = format!("`{first}` does not run as a service; `master` and `worker` do");
            return Err(cli.error(clap::error::ErrorKind::InvalidValue, why));
        };
        let matches =
            cli.try_get_matches_from_mut(std::iter::once("bolide").chain(words.iter().map(String::as_str)))?;
        let command = Cli::from_arg_matches(&matches)?.command;
        let matches = matches.subcommand_matches(kind).cloned().unwrap_or_default();
        Ok(Self { kind, command, matches })
    }

    /// It as a service of this name in this folder.
    fn service(&self, name: String, folder: PathBuf) -> Result<Service, String> {
        let (what_for, certs, needs) = match &self.command {
            Command::Worker(args) => {
                (format!("Computes for the Bolide master {}.", args.master), &args.certs, vec![])
            }
            Command::Master(args) => {
                let spool = (self.matches.value_source("spool") == Some(ValueSource::CommandLine))
                    .then_some(args.spool.as_path());
                let needs =
                    args.lab.as_deref().into_iter().chain(spool).map(whole).collect::<Result<_, _>>()?;
                (
                    format!("Runs the jobs of a Bolide cluster; listens on {}.", args.listen),
                    &args.certs,
                    needs,
                )
            }
            _ => return Err(format!("`{}` does not run as a service", self.kind)),
        };
        let secrets = match certs {
            Some(certs) => {
                let tls::Paths { ca, certificate, key } = tls::Paths::in_folder(&whole(certs)?);
                vec![ca, certificate, key]
            }
            None => vec![],
        };
        let title = match format!("bolide-{}", self.kind) == name {
            true => format!("Bolide {}", self.kind),
            false => format!("Bolide {} ({name})", self.kind),
        };
        let mut arguments = Service::RUN.map(String::from).to_vec();
        arguments.extend([format!("--name={name}"), format!("--folder={}", text(&folder)?)]);
        arguments.push(self.kind.to_owned());
        arguments.extend(self.flags()?);
        Ok(Service {
            name,
            title,
            description: what_for,
            account: ACCOUNT.to_owned(),
            password: None,
            arguments,
            folder,
            secrets,
            needs,
        })
    }

    /// Its flags with whole paths; without the token, which has been exchanged: everybody on the machine may read them.
    fn flags(&self) -> Result<Vec<String>, String> {
        let cli = Cli::command();
        let known = cli.find_subcommand(self.kind).into_iter().flat_map(clap::Command::get_arguments);
        let mut flags = Vec::new();
        for argument in known {
            let id = argument.get_id().as_str();
            let Some(long) = argument.get_long() else { continue };
            if id == "join" || self.matches.value_source(id) != Some(ValueSource::CommandLine) {
                continue;
            }
            if !argument.get_action().takes_values() {
                flags.push(format!("--{long}"));
                continue;
            }
            for value in self.matches.get_raw(id).into_iter().flatten() {
                let value = match argument.get_value_hint() {
                    ValueHint::AnyPath => text(&whole(Path::new(value))?)?.to_owned(),
                    _ => text(Path::new(value))?.to_owned(),
                };
                flags.push(format!("--{long}={value}"));
            }
        }
        Ok(flags)
    }
}

fn whole(path: &Path) -> Result<PathBuf, String> {
    std::path::absolute(path).map_err(|e| format!("{}: {e}", path.display()))
}

fn text(path: &Path) -> Result<&str, String> {
    path.to_str().ok_or_else(|| format!("{}: not Unicode; use another path for a service", path.display()))
}

/// The password in a file, or from standard input, without the end of its line.
fn password(path: &Path) -> Result<String, String> {
    let fault = |e: std::io::Error| format!("the password in {}: {e}", path.display());
    let mut text = String::new();
    let from: Box<dyn Read> = match path == Path::new("-") {
        true => Box::new(std::io::stdin()),
        false => Box::new(std::fs::File::open(path).map_err(fault)?),
    };
    from.take(PASSWORD_LIMIT).read_to_string(&mut text).map_err(fault)?;
    Ok(text.trim_end_matches(['\r', '\n']).to_owned())
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    fn daemon(line: &str) -> Result<Daemon, String> {
        let words: Vec<String> = line.split(' ').map(|word| word.replace('~', " ")).collect();
        Daemon::parse(&words).map_err(|error| error.to_string())
    }

    fn flags(line: &str) -> Vec<String> {
        daemon(line).and_then(|daemon| daemon.flags()).expect("flags that are known")
    }

    #[test]
    fn a_daemons_flags_are_kept_with_whole_paths_and_without_its_token() {
        let here = std::env::current_dir().expect("a folder");
        let certs = here.join("certs").display().to_string();
        let kept = flags(
            "worker --master pc1:7117 --certs certs --join bolide-secret --once --yield-to-owner --hours Mon-Fri~18:00-08:00,~Sat-Sun",
        );
        let mut expected = vec![
            "--master=pc1:7117".to_owned(),
            format!("--certs={certs}"),
            "--once".to_owned(),
            "--yield-to-owner=0".to_owned(),
            "--hours=Mon-Fri 18:00-08:00, Sat-Sun".to_owned(),
        ];
        assert_eq!(kept, expected);
        // What is kept says the same.
        expected.insert(0, "worker".to_owned());
        let again = Daemon::parse(&expected).expect("known");
        assert_eq!(again.flags().expect("known"), kept);
        let kept =
            flags("master --listen 10.0.0.1:7117 --certs /c --lab lab --keep-days 3 --notify echo~\"over\"");
        assert!(kept.contains(&format!("--lab={}", here.join("lab").display())), "{kept:?}");
        assert!(kept.contains(&"--notify=echo \"over\"".to_owned()), "{kept:?}");
        assert!(!kept.iter().any(|flag| flag.starts_with("--spool")), "{kept:?}");
    }

    #[test]
    fn every_argument_of_a_daemon_has_a_long_flag() {
        let cli = Cli::command();
        for kind in DAEMONS {
            let daemon = cli.find_subcommand(kind).expect("it is there");
            for argument in daemon.get_arguments() {
                assert!(argument.get_long().is_some(), "{kind}: {}", argument.get_id());
            }
        }
    }

    #[test]
    fn a_service_says_what_it_is_for_and_which_files_are_secret() {
        let worker = daemon("worker --master pc1 --certs /c").expect("known");
        let service = worker.service("bolide-worker".into(), "/data".into()).expect("Unicode");
        assert_eq!((&*service.title, &*service.account), ("Bolide worker", "LocalService"));
        assert!(service.description.contains("pc1"));
        assert!(service.arguments.starts_with(&["service", "run", "--name=bolide-worker"].map(String::from)));
        assert_eq!(service.secrets.len(), 3);
        assert!(service.secrets[2].ends_with("host-key.pem"));
        // The manager starts what this program knows.
        let line = std::iter::once("bolide").chain(service.arguments.iter().map(String::as_str));
        let Ok(Cli { command: Command::Service { what: ServiceArgs::Run { name, command, .. } } }) =
            Cli::try_parse_from(line)
        else {
            panic!("{:?}", service.arguments)
        };
        assert_eq!((&*name, &*command[0]), ("bolide-worker", "worker"));
        let master = daemon("master --spool /s").expect("known");
        let service = master.service("second".into(), "/data".into()).expect("Unicode");
        assert_eq!(service.title, "Bolide master (second)");
        assert_eq!(service.needs.len(), 1);
    }

    #[test]
    fn flags_before_the_command_are_the_services_and_those_behind_it_the_commands() {
        let line =
            ["bolide", "service", "install", "--name", "w2", "worker", "--name", "pc2", "--master", "m"];
        let Ok(Cli { command: Command::Service { what: ServiceArgs::Install { name, command, .. } } }) =
            Cli::try_parse_from(line)
        else {
            panic!("{line:?}")
        };
        assert_eq!(name.as_deref(), Some("w2"));
        assert_eq!(command, ["worker", "--name", "pc2", "--master", "m"]);
        for (line, why) in [
            ("worker --mastre pc1", "--mastre"),
            ("worker", "--master"),
            ("submit deck.toml", "`submit` does not run as a service"),
            ("--nam w2 worker", "`--nam` does not run as a service"),
        ] {
            let said = daemon(line).err().expect("wrong");
            assert!(said.contains(why), "{line}: {said}");
        }
    }

    #[test]
    fn the_help_fits_its_width() {
        let mut cli = Cli::command();
        let service = cli.find_subcommand_mut("service").expect("it is there");
        let mut helps = vec![service.render_help()];
        helps.extend(service.get_subcommands_mut().map(clap::Command::render_help));
        for line in helps.iter().map(ToString::to_string).collect::<String>().lines() {
            assert!(line.chars().count() <= 80, "{line}");
        }
    }

    #[test]
    fn names_are_good_for_folders_and_passwords_lose_their_line_end() {
        for good in ["bolide-worker", "a", "w_2.b"] {
            assert_eq!(name(good).as_deref(), Ok(good));
        }
        for bad in ["", "..", ".a", "a.", "-a", "a/b", "a\\b", "a b", "ä", &"a".repeat(81)] {
            assert!(name(bad).is_err(), "{bad}");
        }
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("password");
        std::fs::write(&path, "se cret \r\n").expect("room");
        assert_eq!(password(&path).as_deref(), Ok("se cret "));
        assert!(password(&folder.path().join("none")).unwrap_err().contains("none"));
    }
}
