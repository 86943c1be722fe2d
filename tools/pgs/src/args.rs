//! This file is the command line: which verb, and what holds for all of them.

use std::ffi::OsString;
use std::path::PathBuf;

use bitstream_model::interface::address_map::UIO_NODE;
use clap::parser::ValueSource;
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use zynq_pgs::{ManagerChoice, MemoryChoice};

use crate::environment::{BOARD, MANAGER, MEMORY, is_blank};
use crate::memory::memory;
use crate::verbs::check::CheckArgs;
use crate::verbs::compare::CompareArgs;
use crate::verbs::faults::FaultsArgs;
use crate::verbs::formats::FormatsArgs;
use crate::verbs::list::ListArgs;
use crate::verbs::load::LoadArgs;
use crate::verbs::model::ModelArgs;
use crate::verbs::order::OrderArgs;
use crate::verbs::run::RunArgs;
use crate::verbs::serve::ServeArgs;
use crate::verbs::solve::SolveArgs;

const EXAMPLES: &str = "\
Examples:
  pgs                                  step the thesis' scene of 38,880 cubes
  pgs --grid 10x10x10 --steps 60       a smaller one; the same as `pgs run --grid ...`
  pgs solve vectors/one_cube --compare
  pgs compare float half               how far two builds of the board come apart
  pgs formats --input vectors/full_step186
  pgs model --collisions 127000 --bodies 38880
  pgs order --input vectors/full_step186
  pgs list --json
  pgs load zynq-pgs.bit.bin --overlay zynq-pgs.dtbo
  pgs check                            test the board; --board emulated where there is none
  pgs faults                           every fault at every place, and what the driver makes of it
  pgs serve --socket /tmp/board        and elsewhere: pgs --board socket:/tmp/board

RUST_LOG=debug shows one line a step, RUST_LOG=trace every register access.

Exit codes: 0 done; 1 a comparison or a check failed; 2 wrong usage or unreadable input; 3 no usable board, or
no rights; 4 hardware fault or deadline; 130 interrupted.";

/// Steps rigid bodies on the zynq-pgs accelerator, real or emulated.
///
/// Without a verb, `run` is meant: its options are accepted here too.
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

/// What to do.
#[derive(Debug, Clone, Subcommand)]
pub(crate) enum Verb {
    Run(RunArgs),
    Solve(SolveArgs),
    Compare(CompareArgs),
    Formats(FormatsArgs),
    Model(ModelArgs),
    Order(OrderArgs),
    List(ListArgs),
    Load(LoadArgs),
    Serve(ServeArgs),
    Check(CheckArgs),
    Faults(FaultsArgs),
}

/// What holds for every verb, as the command line says it.
#[derive(Debug, Clone, Args)]
struct CommonOptions {
    /// Print one JSON document instead of text.
    #[arg(long, global = true)]
    json: bool,
    /// Board to use.
    #[arg(
        help = "Board to use: auto (the UIO node \"pgs\" if there is one, else emulated), uio[:NODE] \
                (the UIO node of that name, or NODE-control, NODE-dma0 ... for each region), devmem \
                (registers through /dev/mem, at the addresses of the interface; needs root), \
                emulated or socket:PATH (one that `pgs serve` serves) [env: PGS_BOARD] \
                [default: auto]",
        long,
        global = true,
        value_name = "BOARD",
        value_parser = board_name
    )]
    board: Option<BoardName>,
    /// DMA memory of a real board.
    #[arg(
        help = "DMA memory of a real board: auto (the u-dma-buf \"pgs\", else the UIO node \
                \"pgs-memory\"), u-dma-buf[:NAME[:write-combining]], uio[:NODE] or \
                devmem[:ADDRESS+BYTES]; of a served board: file:PATH [env: PGS_MEMORY] \
                [default: auto]",
        long,
        global = true,
        value_name = "MEMORY",
        value_parser = memory
    )]
    memory: Option<MemoryChoice>,
    /// FPGA manager of a real board's logic.
    #[arg(
        help = "FPGA manager of a real board's logic, which says whether it is programmed: auto (the \
                ZynqMP's own, by its name), a device as fpga1, or none (do not ask: for logic that \
                the kernel did not load, as by JTAG. WARNING: an access to logic that is not \
                programmed hangs the processor) [env: PGS_MANAGER] [default: auto]",
        long,
        global = true,
        value_name = "MANAGER",
        value_parser = manager
    )]
    manager: Option<ManagerChoice>,
}

/// What holds for every verb.
#[derive(Debug, Clone)]
pub(crate) struct CommonArgs {
    pub(crate) json: bool,
    pub(crate) board: BoardName,
    pub(crate) memory: MemoryChoice,
    /// Whether the environment names the memory, and the command line does not.
    pub(crate) memory_of_environment: bool,
    pub(crate) manager: ManagerChoice,
}

/// A board, as it is named on the command line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum BoardName {
    Auto,
    /// The UIO node of that name, or a node for each region.
    Uio(String),
    /// Registers through /dev/mem.
    Devmem,
    Emulated,
    /// In another process, at this socket.
    Socket(PathBuf),
}

/// Reads the name of a board.
fn board_name(text: &str) -> Result<BoardName, String> {
    match text.split_once(':').map_or((text, None), |(kind, rest)| (kind, Some(rest))) {
        ("auto", None) => Ok(BoardName::Auto),
        ("uio", None) => Ok(BoardName::Uio(UIO_NODE.to_owned())),
        ("uio", Some(node)) if !node.is_empty() => Ok(BoardName::Uio(node.to_owned())),
        ("devmem", None) => Ok(BoardName::Devmem),
        ("emulated", None) => Ok(BoardName::Emulated),
        ("socket", Some(path)) if !path.is_empty() => Ok(BoardName::Socket(path.into())),
        _ => Err("expected auto, uio[:NODE], devmem, emulated or socket:PATH".to_owned()),
    }
}

/// Reads the choice of an FPGA manager.
fn manager(text: &str) -> Result<ManagerChoice, String> {
    let number = |text: &str| text.strip_prefix("fpga")?.parse::<u32>().ok();
    match text.trim() {
        "auto" => Ok(ManagerChoice::Automatic),
        "none" => Ok(ManagerChoice::Unasked),
        device if number(device).is_some() => Ok(ManagerChoice::Device(device.to_owned())),
        _ => {
            Err("expected auto, none, or a device of /sys/class/fpga_manager, as fpga0".to_owned())
        }
    }
}

/// What to do, and how.
#[derive(Debug, Clone)]
pub(crate) struct Command {
    pub(crate) verb: Verb,
    pub(crate) common: CommonArgs,
}

/// Reads the command line, and from `variable` what it leaves to the environment; the error is also how
/// help is asked for.
pub(crate) fn parse(
    arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    variable: impl Fn(&str) -> Option<OsString>,
) -> Result<Command, clap::Error> {
    let mut command = Cli::command();
    let matches = command.try_get_matches_from_mut(arguments)?;
    if let Some(verb) = matches.subcommand_name() {
        // `run`'s options stand here as well, and would silently mean nothing before another verb.
        let stray = matches.ids().find(|id| {
            let common = matches!(id.as_str(), "json" | "board" | "memory" | "manager");
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
    let CommonOptions { json, board, memory, manager } = cli.common;
    // Only what is used is read: a variable that is wrong breaks no command that does without it.
    let with_board = !matches!(verb, Verb::Model(_) | Verb::Load(_));
    let mut wrong = |message| command.error(clap::error::ErrorKind::ValueValidation, message);
    let board = match board {
        None if with_board => {
            instead_of("--board", BOARD, &variable, board_name).map_err(&mut wrong)?
        }
        given => given,
    };
    let board = board.unwrap_or(BoardName::Auto);
    // A served board is emulated, and yet on memory that is named.
    let on_memory = board != BoardName::Emulated || matches!(verb, Verb::Serve(_));
    let with_memory = with_board && on_memory && memory.is_none();
    let named = match with_memory {
        true => {
            instead_of("--memory", MEMORY, &variable, crate::memory::memory).map_err(&mut wrong)?
        }
        false => None,
    };
    let memory_of_environment = named.is_some();
    let memory = memory.or(named).unwrap_or(MemoryChoice::Automatic);
    let real = !matches!(verb, Verb::Model(_)) && board != BoardName::Emulated;
    let manager = match manager {
        None if real => {
            instead_of("--manager", MANAGER, &variable, self::manager).map_err(&mut wrong)?
        }
        given => given,
    };
    let manager = manager.unwrap_or_default();
    let common = CommonArgs { json, board, memory, memory_of_environment, manager };
    Ok(Command { verb, common })
}

/// What a variable of the environment says in place of an option.
fn instead_of<T>(
    option: &str,
    name: &str,
    variable: impl Fn(&str) -> Option<OsString>,
    read: impl Fn(&str) -> Result<T, String>,
) -> Result<Option<T>, String> {
    let Some(text) = variable(name).filter(|text| !is_blank(text)) else { return Ok(None) };
    let found = text.to_str().ok_or_else(|| "expected text".to_owned()).and_then(read);
    found.map(Some).map_err(|expected| {
        format!(
            "the environment variable {name} is {text:?}: {expected}; correct or unset it, or give \
             {option}"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::error::ErrorKind;

    fn parsed(line: &str) -> Result<Command, ErrorKind> {
        parse(line.split_whitespace(), |_| None).map_err(|error| error.kind())
    }

    /// The same where the environment has `PGS_BOARD` and `PGS_MEMORY`; or what is said.
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
            "pgs model",
            "pgs load x",
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
            assert!(matches!(command.verb, Verb::Run(RunArgs { steps: 5, .. })), "{line}");
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
    fn a_manager_is_a_device_none_or_found_by_its_name() {
        assert_eq!(manager("auto"), Ok(ManagerChoice::Automatic));
        assert_eq!(manager("none"), Ok(ManagerChoice::Unasked));
        assert_eq!(manager("fpga10"), Ok(ManagerChoice::Device("fpga10".to_owned())));
        for wrong in ["fpga", "fpgax", "fpga0/..", "0", "Xilinx"] {
            manager(wrong).expect_err(wrong);
        }
        let help = Cli::command().render_long_help().to_string();
        let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains("WARNING") && words.contains("hangs the processor"), "{words}");
    }

    #[test]
    fn a_served_board_is_named_by_its_socket() {
        let common = parsed("pgs --board socket:/a/b --memory file:c run").expect("a board").common;
        assert_eq!(common.board, BoardName::Socket("/a/b".into()));
        assert_eq!(common.memory, MemoryChoice::File { path: "c".into() });
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
            "pgs model --collisions -1 --bodies 1",
            "pgs model --collisions 1",
            "pgs solve",
            "pgs frobnicate",
        ] {
            parsed(line).expect_err(line);
        }
    }
}
