//! Parses the command line: the verb, its options, and the options of every verb.

use std::ffi::OsString;

use anstream::ColorChoice;
use clap::parser::ValueSource;
use clap::{CommandFactory, FromArgMatches, Parser};

use crate::verbs::Verb;
use crate::verbs::run::RunArgs;
use pgs_command::common::{CommonArgs, CommonOptions};

const EXAMPLES: &str = "\
Examples:
  pgs                                  step the thesis' scene of 38,880 cubes
  pgs --grid 10x10x10 --steps 60       a smaller one; the same as `pgs run --grid ...`
  pgs solve tests/golden/one_cube --compare
  pgs thesis                           the experiments of the thesis part
  pgs thesis compare float half        one of them: how far two builds of the board diverge
  pgs thesis --all --out report        the thesis' tables and figures again
  pgs list --json
  pgs check --board emulated           test the emulated board as a real one
  pgs faults                           every fault at every place, and the driver's reaction
  pgs serve --socket /tmp/board        an emulated board for other processes
  pgs --board socket:/tmp/board        one of them, in another terminal

Examples on a board:
  pgs load zynq-pgs.bit.bin --overlay zynq-pgs.dtbo
  pgs check

RUST_LOG=debug shows one line a step, RUST_LOG=trace every register access.

Exit codes: 0 done; 1 a comparison or a check failed; 2 wrong usage or unreadable input; 3 no
usable board, or no rights; 4 hardware fault or deadline; 130 interrupted.";

/// The end of the short help.
const MORE: &str = "\
Examples:
  pgs                                  drop 38,880 cubes
  pgs --scene shapes --view pile.html  a pile and its page
  pgs check --board emulated           test a board

Without a verb `pgs` runs `run`. `pgs VERB -h` has a verb's
options, `pgs VERB --help` all of them, with examples.";

/// Steps rigid bodies on the zynq-pgs accelerator, real or emulated.
///
/// Without a verb, `pgs` runs `run` and takes its options.
#[derive(Debug, Parser)]
#[command(name = "pgs", version, after_help = MORE, after_long_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    verb: Option<Verb>,
    #[command(flatten)]
    common: CommonOptions,
    #[command(flatten)]
    run: RunArgs,
}

/// Options that `pgs run -h` shows, in two screens; `pgs run --help` shows all.
const SHORT: [&str; 16] = [
    "steps",
    "scene",
    "grid",
    "drop",
    "report_every",
    "json",
    "color",
    "contact_iterations",
    "friction_iterations",
    "warm_start",
    "order",
    "board",
    "threads",
    "fault",
    "view",
    "picture",
];

/// The definition of the command line.
pub(crate) fn definition() -> clap::Command {
    let short = |argument: clap::Arg| {
        let hidden = !SHORT.contains(&argument.get_id().as_str());
        argument.hide_short_help(hidden)
    };
    // They stand in the help of the verb.
    let of_run = |argument: clap::Arg| match argument.is_global_set() {
        true => argument,
        false => argument.hide_short_help(true).hide_long_help(true),
    };
    Cli::command().mut_args(of_run).mut_subcommand("run", |run| run.mut_args(short))
}

/// The colours that the command line asks for: also for the words of the parser and of the log.
pub(crate) fn color(arguments: &[OsString]) -> ColorChoice {
    let mut words = arguments.iter().filter_map(|word| word.to_str());
    let value = words.find_map(|word| word.strip_prefix("--color"));
    let value = value.and_then(|value| value.strip_prefix('=').or_else(|| words.next()));
    match value {
        Some("always") => ColorChoice::Always,
        Some("never") => ColorChoice::Never,
        _ => ColorChoice::Auto,
    }
}

/// A parsed command line.
#[derive(Debug, Clone)]
pub(crate) struct Command {
    pub(crate) verb: Verb,
    pub(crate) common: CommonArgs,
}

/// Parses the command line, and reads options that it leaves out from `variable`. A request for
/// help is an error, too.
pub(crate) fn parse(
    arguments: &[OsString],
    variable: impl Fn(&str) -> Option<OsString>,
) -> Result<Command, clap::Error> {
    let mut command = definition().color(match color(arguments) {
        ColorChoice::Always | ColorChoice::AlwaysAnsi => clap::ColorChoice::Always,
        ColorChoice::Never => clap::ColorChoice::Never,
        ColorChoice::Auto => clap::ColorChoice::Auto,
    });
    let matches = command.try_get_matches_from_mut(arguments)?;
    if let Some(verb) = matches.subcommand_name() {
        // `run`'s options are accepted here as well; before another verb they would have no effect.
        let stray = matches.ids().find(|id| {
            let common = ["json", "color"].contains(&id.as_str());
            let is_argument = command.get_arguments().any(|argument| argument.get_id() == *id);
            let given = || matches.value_source(id.as_str()) == Some(ValueSource::CommandLine);
            !common && is_argument && given()
        });
        if let Some(id) = stray {
            let message = format!(
                "--{id} belongs behind the verb: pgs {verb} --{id} ...",
                id = id.as_str().replace('_', "-")
            );
            return Err(command.error(clap::error::ErrorKind::ArgumentConflict, message));
        }
    }
    let cli = Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut command))?;
    let verb = cli.verb.unwrap_or(Verb::Run(cli.run));
    let common = cli
        .common
        .complete(verb.given(), variable)
        .map_err(|message| command.error(clap::error::ErrorKind::ValueValidation, message))?;
    Ok(Command { verb, common })
}

#[cfg(test)]
mod tests {
    use bitstream_model::interface::address_map::UIO_NODE;
    use clap::error::ErrorKind;
    use zynq_pgs::BoardChoice;
    use zynq_pgs::platform::{ManagerChoice, MemoryChoice};

    use super::*;
    use pgs_command::environment::{BOARD, MEMORY};

    /// Whether that is the UIO node of this name.
    fn is_uio(board: &BoardChoice, name: &str) -> bool {
        matches!(board, BoardChoice::Uio { node } if node == name)
    }

    fn words(line: &str) -> Vec<OsString> {
        line.split_whitespace().map(OsString::from).collect()
    }

    fn parsed(line: &str) -> Result<Command, ErrorKind> {
        parse(&words(line), |_| None).map_err(|error| error.kind())
    }

    /// Parses with `PGS_BOARD` and `PGS_MEMORY` set; or the error message.
    fn parsed_in(board: &str, memory: &str, line: &str) -> Result<CommonArgs, String> {
        let variable = |name: &str| match name {
            BOARD => Some(board.into()),
            MEMORY => Some(memory.into()),
            _ => None,
        };
        let command = parse(&words(line), variable);
        command.map(|command| command.common).map_err(|error| error.to_string())
    }

    #[test]
    fn the_environment_says_what_the_command_line_does_not() {
        let common = parsed_in("uio", "uio:m", "pgs run").expect("both");
        assert!(is_uio(&common.board, UIO_NODE));
        assert_eq!(common.memory, MemoryChoice::Uio { node: "m".to_owned() });
        assert!(common.memory_of_environment);
        let common = parsed_in("uio", "uio:m", "pgs run --board devmem --memory uio:n");
        let common = common.expect("neither");
        assert!(matches!(common.board, BoardChoice::DevMem(_)));
        assert_eq!(common.memory, MemoryChoice::Uio { node: "n".to_owned() });
        assert!(!common.memory_of_environment);
    }

    #[test]
    fn a_blank_variable_is_none() {
        for blank in ["", " ", "	 "] {
            for line in ["pgs", "pgs run", "pgs list --json"] {
                let common = parsed_in(blank, blank, line).expect("as if unset");
                assert!(matches!(common.board, BoardChoice::Automatic), "{line}");
                assert_eq!(common.memory, MemoryChoice::Automatic, "{line}");
            }
        }
    }

    #[test]
    fn a_wrong_variable_is_named_and_breaks_nothing_that_does_without() {
        let said = parsed_in("abacus", "", "pgs run").expect_err("no board");
        assert!(
            said.contains("PGS_BOARD is \"abacus\": found \"abacus\" as a board: give auto"),
            "{said}"
        );
        assert!(said.contains("give --board"), "{said}");
        let said = parsed_in("uio", "drum", "pgs run").expect_err("no memory");
        assert!(
            said.contains("PGS_MEMORY is \"drum\"") && said.contains("give --memory"),
            "{said}"
        );
        for line in [
            "pgs --board uio --memory uio",
            "pgs run --board emulated",
            "pgs --board emulated",
            "pgs solve x --memory uio --board uio",
            "pgs thesis",
            "pgs thesis cycles",
            "pgs load x",
            "pgs thesis detection --input x",
        ] {
            parsed_in("abacus", "drum", line).unwrap_or_else(|said| panic!("{line}: {said}"));
        }
    }

    #[test]
    fn colours_are_asked_for_wherever_the_option_stands() {
        for (line, expected) in [
            ("pgs", ColorChoice::Auto),
            ("pgs --color never", ColorChoice::Never),
            ("pgs check --color=always", ColorChoice::Always),
            ("pgs --color auto --color=always", ColorChoice::Auto),
        ] {
            assert_eq!(color(&words(line)), expected, "{line}");
        }
        parsed("pgs check --color=always").expect("a colour");
        parsed("pgs --color red").expect_err("no colour");
    }

    #[test]
    fn the_definition_is_consistent() {
        definition().debug_assert();
    }

    #[test]
    fn run_is_the_default_verb_with_its_options() {
        for line in [
            "pgs --steps 5",
            "pgs run --steps 5",
            "pgs --json --steps 5",
            "pgs --json run --steps 5",
        ] {
            let command = parsed(line).expect(line);
            assert!(matches!(command.verb, Verb::Run(RunArgs { steps: Some(5), .. })), "{line}");
        }
        assert!(matches!(parsed("pgs").expect("no verb").verb, Verb::Run(_)));
    }

    #[test]
    fn the_form_of_the_output_stands_on_either_side_of_the_verb() {
        for line in [
            "pgs --json list --board emulated --memory uio:m --manager fpga2",
            "pgs list --json --board emulated --memory uio:m --manager fpga2",
        ] {
            let common = parsed(line).expect(line).common;
            assert!(common.json, "{line}");
            assert_eq!(common.memory, MemoryChoice::Uio { node: "m".to_owned() }, "{line}");
            assert!(matches!(common.board, BoardChoice::Built(_)), "{line}");
            assert_eq!(common.manager, ManagerChoice::Device("fpga2".to_owned()), "{line}");
        }
    }

    #[test]
    fn a_board_is_named_by_its_node_as_memory_is() {
        let board =
            |text: &str| parsed(&format!("pgs check --board {text}")).map(|c| c.common.board);
        for (text, node) in
            [("uio", "pgs"), ("uio:pgs@a0000000", "pgs@a0000000"), ("uio:a:b", "a:b")]
        {
            assert!(is_uio(&board(text).expect(text), node), "{text}");
        }
    }

    #[test]
    fn the_help_warns_of_logic_that_nobody_asks_about() {
        let mut pgs = definition();
        let help = pgs.find_subcommand_mut("run").expect("a verb").render_long_help().to_string();
        let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains("WARNING") && words.contains("hangs the processor"), "{words}");
    }

    #[test]
    fn a_served_board_is_named_by_its_socket() {
        let common = parsed("pgs run --board socket:/a/b").expect("a board").common;
        assert!(matches!(common.board, BoardChoice::Served { socket } if socket.ends_with("b")));
        let served = parsed("pgs serve --socket x --board emulated:half").expect("a board");
        assert!(matches!(served.verb, Verb::Serve(args) if args.socket.ends_with("x")));
    }

    /// Commands without a board of the user's have no option that names one.
    #[test]
    fn options_of_a_board_belong_to_verbs_that_open_one() {
        for verb in ["faults", "serve --socket x", "thesis half", "thesis compare float half"] {
            for option in ["--memory uio", "--manager fpga0"] {
                let found = parsed(&format!("pgs {verb} {option}")).map(|_| ());
                assert_eq!(found, Err(ErrorKind::UnknownArgument), "{verb} {option}");
            }
            parsed(&format!("pgs {verb} --board uio")).expect_err(verb);
            parsed(&format!("pgs {verb} --accelerator rtl:x")).expect(verb);
        }
        for verb in ["thesis cycles", "thesis ladder", "thesis detection --input x", "load x"] {
            for option in ["--board uio", "--memory uio", "--accelerator model"] {
                let found = parsed(&format!("pgs {verb} {option}")).map(|_| ());
                assert_eq!(found, Err(ErrorKind::UnknownArgument), "{verb} {option}");
            }
        }
        let real = parsed_in("uio", "uio:m", "pgs thesis formats").expect("a board");
        assert!(is_uio(&real.board, UIO_NODE));
        for line in ["pgs faults", "pgs thesis half", "pgs thesis cycles", "pgs serve --socket x"] {
            let own = parsed_in("uio", "uio:m", line).expect(line).board;
            assert!(matches!(own, BoardChoice::Automatic), "{line}");
        }
    }

    #[test]
    fn options_of_run_before_another_verb_are_refused() {
        assert_eq!(parsed("pgs --board uio list").expect_err("stray"), ErrorKind::ArgumentConflict);
        assert_eq!(parsed("pgs --steps 5 list").expect_err("stray"), ErrorKind::ArgumentConflict);
        assert_eq!(
            parsed("pgs --threads 1 solve x").expect_err("stray"),
            ErrorKind::ArgumentConflict
        );
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        for line in [
            "pgs --steps 0",
            "pgs --steps -1",
            "pgs --grid 3x3",
            "pgs --grid 0x1x1",
            "pgs --drop nan",
            "pgs --drop -1",
            "pgs --threads 0",
            "pgs --report-every 0",
            "pgs --memory udmabuf",
            "pgs --memory file:",
            "pgs --board socket:",
            "pgs --board uio:",
            "pgs --board auto:1",
            "pgs --manager fpga",
            "pgs --board served",
            "pgs serve",
            "pgs thesis cycles --collisions -1 --bodies 1",
            "pgs thesis cycles --collisions 1",
            "pgs solve",
            "pgs frobnicate",
        ] {
            parsed(line).expect_err(line);
        }
    }
}
