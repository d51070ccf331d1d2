//! Help: the subcommands in groups, and examples.

use std::fmt::Write as _;

use clap::{CommandFactory as _, FromArgMatches as _};

use super::Cli;

/// What the process ends with, as `--help` says it.
pub(super) const EXIT_CODES: &str =
    "Exit codes: 0 done; 1 a fault, which is printed (deck, disk, physics, peer);
2 wrong flags; 130 stopped by Ctrl-C, or the followed job was cancelled (1 with
--until done). The log goes to standard error, BOLIDE_LOG=debug for more.";

/// What the subcommands are for, in the order of the help; those that are in no group are told last.
const GROUPS: [(&str, &[&str]); 5] = [
    ("Simulate", &["run", "study", "verify"]),
    ("Make a deck", &["init", "check", "convert", "materials", "schema"]),
    ("Look at results", &["report", "picture", "export"]),
    (
        "Use a cluster",
        &[
            "master", "worker", "submit", "watch", "jobs", "hosts", "top", "results", "cancel", "hold",
            "resume", "rm",
        ],
    ),
    ("Set up and measure", &["add", "service", "certs", "bench", "simulate", "completions", "man"]),
];

/// The first commands of somebody new.
const EXAMPLES: &str = "Examples:
  bolide init taylor               # writes taylor.toml, to start from
  bolide check taylor.toml         # what is wrong with it, what a run takes
  bolide run taylor.toml           # runs it on this PC
  bolide report results/taylor --open";

pub(super) const RUN_EXAMPLES: &str = "Examples:
  bolide run deck.toml                       # all cores; results in results/deck
  bolide run deck.toml --cycles 200 --force  # a short try over older results
  bolide run deck.toml --refine 2            # again with cells half as large: does the answer stay?
  bolide run deck.toml --resume results/deck # goes on after Ctrl-C";
pub(super) const SUBMIT_EXAMPLES: &str = "Examples:
  bolide submit deck.toml                    # prints the commands that follow
  bolide submit deck.toml --wait             # until it is over, with its summary
  bolide submit deck.toml --min-workers 3 --master lab1:7117";
pub(super) const PICTURE_EXAMPLES: &str = "Examples:
  bolide picture deck.toml                                 # the bodies before they run
  bolide picture results/deck --field pressure --cut y     # the last state, opened
  bolide picture results/deck --mirror --movie deck.gif    # all states, mirrored at the planes of symmetry";

impl Cli {
    /// The command line of this process; ends it where help is asked for or a flag is wrong.
    pub fn of_process() -> Self {
        let matches = Self::grouped().get_matches();
        Self::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
    }

    /// The command, with its subcommands in groups where it lists them.
    fn grouped() -> clap::Command {
        let command = taking_negative_numbers(Self::command());
        let mut list = String::new();
        for (heading, names) in GROUPS {
            let _ = writeln!(list, "{heading}:");
            for name in names {
                let about = command.find_subcommand(name).and_then(clap::Command::get_about);
                let about = about.map_or_else(String::new, ToString::to_string);
                let _ = writeln!(list, "  {name:<12}{about}");
            }
            list.push('\n');
        }
        let template = format!(
            "{{about}}\n\n{{usage-heading}} {{usage}}\n\n{list}{EXAMPLES}\n\n`bolide COMMAND --help` has the flags of a command.{{after-help}}\n"
        );
        command.help_template(template)
    }
}

/// The command with values that may be negative, so that one that must not is told as a wrong value of its flag and not as an unknown flag.
fn taking_negative_numbers(command: clap::Command) -> clap::Command {
    let take = |arg: clap::Arg| match arg.get_action().takes_values() {
        true => arg.allow_negative_numbers(true),
        false => arg,
    };
    command.mut_args(take).mut_subcommands(taking_negative_numbers)
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;
    use deck::starters::STARTERS;

    use super::*;

    #[test]
    fn the_commands_of_the_examples_can_be_given_and_their_decks_can_be_made() {
        let texts = [EXAMPLES, RUN_EXAMPLES, SUBMIT_EXAMPLES, PICTURE_EXAMPLES];
        let examples = texts.iter().flat_map(|text| text.lines().skip(1));
        let mut made = 0;
        for example in examples {
            let words = example.split('#').next().unwrap_or_default().split_whitespace();
            let cli = Cli::try_parse_from(words).unwrap_or_else(|e| panic!("{example}: {e}"));
            if let crate::command::Command::Init { name: Some(name), .. } = cli.command {
                assert!(STARTERS.iter().any(|starter| starter.name == name), "{example}");
                assert!(EXAMPLES.contains(&format!("bolide run {name}.toml")), "{example}");
                made += 1;
            }
        }
        assert_eq!(made, 1);
    }

    #[test]
    fn a_negative_number_is_a_wrong_value_of_its_flag() {
        for words in [&["run", "deck.toml", "--cycles", "-5"][..], &["submit", "deck.toml", "--cycles", "-5"]]
        {
            let words = std::iter::once("bolide").chain(words.iter().copied());
            let why =
                Cli::grouped().try_get_matches_from(words).expect_err("no number of cycles").to_string();
            assert!(why.contains("invalid value '-5' for '--cycles"), "{why}");
        }
    }

    #[test]
    fn submit_says_that_nobody_is_told_without_wait() {
        let mut command = Cli::command();
        let submit = command.find_subcommand_mut("submit").expect("it is there").render_help().to_string();
        let (_, told) = submit.split_once("Whom to tell when it is over, with --wait:").expect("a heading");
        let told = told.split("\n\n").next().unwrap_or_default();
        for flag in ["--notify", "--webhook", "--mail"] {
            assert!(told.contains(flag), "{flag} in\n{submit}");
        }
        assert!(!told.contains("--priority") && !told.contains("--trace"), "{submit}");
    }

    #[test]
    fn every_subcommand_is_in_one_group_of_the_help_and_the_help_fits_its_width() {
        let mut told: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| names.iter().copied()).collect();
        told.sort_unstable();
        let command = Cli::command();
        let mut known: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
        known.sort_unstable();
        assert_eq!(told, known);
        let help = Cli::grouped().render_help().to_string();
        assert!(help.starts_with("Simulates impacts: "), "{help}");
        assert!(help.contains("\nLook at results:\n  report "), "{help}");
        for line in help.lines() {
            assert!(line.chars().count() <= 80, "{line}");
        }
    }

    #[test]
    fn flags_that_few_runs_need_stand_apart() {
        let mut command = Cli::command();
        let run = command.find_subcommand_mut("run").expect("it is there").render_help().to_string();
        let (usual, advanced) = run.split_once("Advanced options:").expect("a heading");
        for flag in ["--workers", "--threads", "--out", "--resume", "--cycles"] {
            assert!(usual.contains(flag), "{flag} in\n{usual}");
        }
        for flag in ["--lanes", "--route", "--keep-every", "--trace", "--pin"] {
            assert!(advanced.contains(flag) && !usual.contains(flag), "{flag}");
        }
    }
}
