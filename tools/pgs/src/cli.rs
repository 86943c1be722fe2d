//! Parses the command line: the verb, its options, and the options of every verb.

use std::ffi::OsString;

use clap::parser::ValueSource;
use clap::{CommandFactory, FromArgMatches, Parser};

use crate::verbs::Verb;
use crate::verbs::run::RunArgs;
use pgs_command::common::{CommonArgs, CommonOptions, Reads};

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

/// Steps rigid bodies on the zynq-pgs accelerator, real or emulated.
///
/// Without a verb, `pgs` runs `run` and takes its options.
#[derive(Debug, Parser)]
#[command(name = "pgs", version, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    verb: Option<Verb>,
    #[command(flatten)]
    common: CommonOptions,
    #[command(flatten)]
    run: RunArgs,
}

/// The definition of the command line, for pages and completions.
#[cfg(feature = "pages")]
pub(crate) fn definition() -> clap::Command {
    Cli::command()
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
    arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    variable: impl Fn(&str) -> Option<OsString>,
) -> Result<Command, clap::Error> {
    let mut command = Cli::command();
    let matches = command.try_get_matches_from_mut(arguments)?;
    if let Some(verb) = matches.subcommand_name() {
        // `run`'s options are accepted here as well; before another verb they would have no effect.
        let stray = matches.ids().find(|id| {
            let common =
                matches!(id.as_str(), "json" | "board" | "memory" | "manager" | "accelerator");
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
        .complete(reads(&verb), variable)
        .map_err(|message| command.error(clap::error::ErrorKind::ValueValidation, message))?;
    Ok(Command { verb, common })
}

/// The common options that a verb reads.
fn reads(verb: &Verb) -> Reads {
    Reads {
        board: match verb {
            Verb::Load(_) => false,
            Verb::Thesis(args) => args.opens_board(),
            _ => true,
        },
        manager: !matches!(verb, Verb::Thesis(args) if !args.opens_board()),
        accelerator: match verb {
            Verb::List(_) | Verb::Load(_) => false,
            Verb::Thesis(args) => args.opens_board(),
            _ => true,
        },
    }
}

#[cfg(test)]
mod tests {
    use bitstream_model::interface::address_map::UIO_NODE;
    use clap::error::ErrorKind;
    use zynq_pgs::{ManagerChoice, MemoryChoice};

    use super::*;
    use pgs_command::common::BoardName;
    use pgs_command::environment::{BOARD, MEMORY};

    fn parsed(line: &str) -> Result<Command, ErrorKind> {
        parse(line.split_whitespace(), |_| None).map_err(|error| error.kind())
    }

    /// Parses with `PGS_BOARD` and `PGS_MEMORY` set; or the error message.
    fn parsed_in(board: &str, memory: &str, line: &str) -> Result<CommonArgs, String> {
        let variable = |name: &str| match name {
            BOARD => Some(board.into()),
            MEMORY => Some(memory.into()),
            _ => None,
        };
        let command = parse(line.split_whitespace(), variable);
        command.map(|command| command.common).map_err(|error| error.to_string())
    }

    #[test]
    fn the_environment_says_what_the_command_line_does_not() {
        let common = parsed_in("uio", "uio:m", "pgs run").expect("both");
        assert_eq!(common.board, BoardName::Uio(UIO_NODE.to_owned()));
        assert_eq!(common.memory, MemoryChoice::Uio { node: "m".to_owned() });
        assert!(common.memory_of_environment);
        let common = parsed_in("uio", "uio:m", "pgs run --board devmem --memory uio:n");
        let common = common.expect("neither");
        assert_eq!(common.board, BoardName::Devmem);
        assert_eq!(common.memory, MemoryChoice::Uio { node: "n".to_owned() });
        assert!(!common.memory_of_environment);
    }

    #[test]
    fn a_blank_variable_is_none() {
        for blank in ["", " ", "	 "] {
            for line in ["pgs", "pgs run", "pgs list --json"] {
                let common = parsed_in(blank, blank, line).expect("as if unset");
                assert_eq!(common.board, BoardName::Auto, "{line}");
                assert_eq!(common.memory, MemoryChoice::Automatic, "{line}");
            }
        }
    }

    #[test]
    fn a_wrong_variable_is_named_and_breaks_nothing_that_does_without() {
        let said = parsed_in("abacus", "", "pgs run").expect_err("no board");
        assert!(said.contains("PGS_BOARD is \"abacus\": expected auto"), "{said}");
        assert!(said.contains("give --board"), "{said}");
        let said = parsed_in("uio", "drum", "pgs run").expect_err("no memory");
        assert!(
            said.contains("PGS_MEMORY is \"drum\"") && said.contains("give --memory"),
            "{said}"
        );
        for line in [
            "pgs --board uio --memory uio run",
            "pgs run --board emulated",
            "pgs --board emulated",
            "pgs solve x --memory uio --board uio",
            "pgs thesis",
            "pgs thesis step",
            "pgs load x",
            "pgs thesis detection --input x",
        ] {
            parsed_in("abacus", "drum", line).unwrap_or_else(|said| panic!("{line}: {said}"));
        }
    }

    #[test]
    fn the_definition_is_consistent() {
        Cli::command().debug_assert();
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
    fn common_options_stand_on_either_side_of_the_verb() {
        for line in [
            "pgs --json --board emulated --memory uio:m --manager fpga2 list",
            "pgs list --json --board emulated --memory uio:m --manager fpga2",
        ] {
            let common = parsed(line).expect(line).common;
            assert!(common.json, "{line}");
            assert_eq!(common.memory, MemoryChoice::Uio { node: "m".to_owned() }, "{line}");
            assert_eq!(common.board, BoardName::Emulated, "{line}");
            assert_eq!(common.manager, ManagerChoice::Device("fpga2".to_owned()), "{line}");
        }
    }

    #[test]
    fn a_board_is_named_by_its_node_as_memory_is() {
        let board =
            |text: &str| parsed(&format!("pgs --board {text} check")).map(|c| c.common.board);
        let uio = |node: &str| Ok(BoardName::Uio(node.to_owned()));
        assert_eq!(board("uio"), uio("pgs"));
        assert_eq!(board("uio:pgs@a0000000"), uio("pgs@a0000000"));
        assert_eq!(board("uio:a:b"), uio("a:b"));
    }

    #[test]
    fn the_help_warns_of_logic_that_nobody_asks_about() {
        let help = Cli::command().render_long_help().to_string();
        let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains("WARNING") && words.contains("hangs the processor"), "{words}");
    }

    #[test]
    fn a_served_board_is_named_by_its_socket() {
        let common = parsed("pgs --board socket:/a/b run").expect("a board").common;
        assert_eq!(common.board, BoardName::Socket("/a/b".into()));
        let served = parsed("pgs serve --socket x --profile half").expect("a board");
        assert!(matches!(served.verb, Verb::Serve(args) if args.socket.ends_with("x")));
    }

    #[test]
    fn options_of_run_before_another_verb_are_refused() {
        assert_eq!(parsed("pgs --steps 5 list").expect_err("stray"), ErrorKind::ArgumentConflict);
        assert_eq!(
            parsed("pgs --hazards unchecked solve x").expect_err("stray"),
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
            "pgs --window 0",
            "pgs --window 99999999999",
            "pgs --bandwidth 0",
            "pgs --bandwidth inf",
            "pgs --bandwidth -3",
            "pgs --report-every 0",
            "pgs --memory udmabuf",
            "pgs --memory file:",
            "pgs --board socket:",
            "pgs --board uio:",
            "pgs --board auto:1",
            "pgs --manager fpga",
            "pgs --board served",
            "pgs serve",
            "pgs thesis step --collisions -1 --bodies 1",
            "pgs thesis step --collisions 1",
            "pgs solve",
            "pgs frobnicate",
        ] {
            parsed(line).expect_err(line);
        }
    }
}
