//! Options that verbs share: output, and for verbs that open a board: the board, DMA memory, FPGA
//! manager, accelerator.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, ColorChoice};
use zynq_pgs::BoardChoice;
use zynq_pgs::emulation::Build;
use zynq_pgs::error::BoardTextError;
use zynq_pgs::platform::{ManagerChoice, MemoryChoice};

use crate::environment::{BOARD, MANAGER, MEMORY, RTL, is_blank};
use crate::options::memory::memory_choice;

/// The option of every verb, as parsed.
#[derive(Debug, Clone, Copy, Args)]
pub struct CommonOptions {
    /// Print one JSON document instead of text.
    #[arg(long, global = true)]
    pub json: bool,
    /// Colours: auto, always, never
    ///
    /// With auto a terminal has them, unless `NO_COLOR` is set.
    #[arg(
        long,
        global = true,
        value_name = "WHEN",
        default_value = "auto",
        hide_default_value = true,
        hide_possible_values = true
    )]
    pub color: ColorChoice,
}

/// The heading of the options of a board.
const HEADING: &str = "Board";

/// The options of a verb that opens a board of any kind.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = HEADING)]
pub struct BoardOptions {
    /// Board to use.
    #[arg(
        help = "Board: auto, uio[:NODE], devmem, emulated[:BUILD], socket:PATH",
        long_help = board_help(),
        long,
        value_name = "BOARD"
    )]
    board: Option<BoardChoice>,
    /// DMA memory of a real board.
    #[arg(
        help = "DMA memory of a real board: auto (the u-dma-buf \"pgs\", else the UIO node \
                \"pgs-memory\"), u-dma-buf[:NAME[:write-combining]], uio[:NODE] or \
                devmem[:ADDRESS+BYTES] [env: PGS_MEMORY] [default: auto]",
        long,
        value_name = "MEMORY",
        value_parser = memory_choice
    )]
    memory: Option<MemoryChoice>,
    #[command(flatten)]
    manager: ManagerOptions,
}

fn board_help() -> String {
    format!(
        "Board: auto (the UIO node \"pgs\" if there is one, else emulated), uio[:NODE] (the UIO \
         node of that name, or NODE-control, NODE-dma0 ... for each region), devmem (registers \
         through /dev/mem, at the addresses of the interface; needs root), emulated[:BUILD] or \
         socket:PATH (one that `pgs serve` serves) [env: PGS_BOARD] [default: auto]\n\nBUILD is a \
         profile ({}), and behind it, after commas, changes of its defaults: {}; as \
         emulated:float,world",
        Build::names("profile").join(", "),
        Build::words()
    )
}

/// The option of a verb that asks the FPGA manager.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = HEADING)]
pub struct ManagerOptions {
    /// FPGA manager of a real board's logic.
    #[arg(
        help = "FPGA manager that knows whether a real board's logic is programmed: auto (the \
                ZynqMP's own, by its name), a device such as fpga1, or none (no check, for logic \
                that the kernel did not load, for example by JTAG. WARNING: an access to logic \
                that is not programmed hangs the processor) [env: PGS_MANAGER] [default: auto]",
        long,
        value_name = "MANAGER",
        value_parser = manager_choice
    )]
    manager: Option<ManagerChoice>,
}

/// The option of a verb that may build an emulated board.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = HEADING)]
pub struct AcceleratorOptions {
    /// Accelerator of an emulated board.
    #[arg(
        help = "Accelerator of an emulated board: model, rtl:PATH, a simulator of the generated \
                Verilog (`rtlgen simulator` builds one), or both:PATH, the simulator with the \
                model beside it on the same beats, up to the first difference [env: PGS_RTL, the \
                PATH of rtl] [default: model]",
        long,
        value_name = "ACCELERATOR",
        value_parser = accelerator_choice
    )]
    accelerator: Option<AcceleratorChoice>,
}

/// The options of a board that a verb has. The environment is read for these only: a wrong variable
/// breaks no command that does not use it.
#[derive(Debug, Clone, Default)]
pub struct Given {
    /// Present in a verb that opens a board of any kind.
    pub board: Option<BoardOptions>,
    /// Present in a verb that asks the FPGA manager, and opens no board.
    pub manager: Option<ManagerOptions>,
    /// Present in a verb that may build an emulated board.
    pub accelerator: Option<AcceleratorOptions>,
    /// Threads of this machine, if the verb has the option.
    pub threads: Option<usize>,
}

impl Given {
    /// Whether the verb builds all of its boards itself.
    const fn builds_boards(&self) -> bool {
        self.board.is_none() && self.accelerator.is_some()
    }
}

/// The accelerator of an emulated board: the built-in model, or a simulator.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct AcceleratorChoice {
    /// The path of a simulator of the generated Verilog, and whether the model runs beside it in
    /// lock step.
    pub simulator: Option<(PathBuf, bool)>,
}

/// The options of every verb, with the environment and the defaults filled in.
#[derive(Debug, Clone)]
pub struct CommonArgs {
    /// Whether to print one JSON document instead of text.
    pub json: bool,
    /// The board.
    pub board: BoardChoice,
    /// Threads of this machine, in place of the default.
    pub threads: Option<usize>,
    /// DMA memory of a real board.
    pub memory: MemoryChoice,
    /// Whether the memory was named by the environment and not by the command line.
    pub memory_of_environment: bool,
    /// FPGA manager of a real board's logic.
    pub manager: ManagerChoice,
    /// Accelerator of an emulated board.
    pub accelerator: AcceleratorChoice,
}

/// Reads the choice of an accelerator.
fn accelerator_choice(text: &str) -> Result<AcceleratorChoice, String> {
    match text.split_once(':') {
        None if text == "model" => Ok(AcceleratorChoice::default()),
        Some((kind @ ("rtl" | "both"), path)) if !path.is_empty() => {
            Ok(AcceleratorChoice { simulator: Some((path.into(), kind == "both")) })
        }
        _ => Err("expected model, rtl:PATH or both:PATH".to_owned()),
    }
}

/// Reads the choice of an FPGA manager.
fn manager_choice(text: &str) -> Result<ManagerChoice, String> {
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

impl CommonArgs {
    /// The options of a command on the emulated board, with text.
    #[must_use]
    pub fn emulated() -> Self {
        Self {
            json: false,
            board: BoardChoice::Built(Build::default()),
            threads: None,
            memory: MemoryChoice::Automatic,
            memory_of_environment: false,
            manager: ManagerChoice::Automatic,
            accelerator: AcceleratorChoice::default(),
        }
    }

    /// The build of an emulated board, with the threads of this machine.
    #[must_use]
    pub fn build(&self) -> Build {
        let build = match self.board {
            BoardChoice::Built(build) => build,
            _ => Build::default(),
        };
        Build { threads: self.threads.or(build.threads), ..build }
    }
}

impl CommonOptions {
    /// Fills in options that the command line leaves out from the environment, through `variable`.
    ///
    /// # Errors
    ///
    /// Fails where a variable has a wrong value, or an option has no effect.
    pub fn complete(
        self,
        given: Given,
        variable: impl Fn(&str) -> Option<OsString>,
    ) -> Result<CommonArgs, String> {
        if given.builds_boards()
            && let Some(board) = variable(BOARD).filter(|board| !is_blank(board))
            && !["auto", "emulated"].iter().any(|own| board == *own)
        {
            log::warn!("{BOARD} is {board:?}: this command builds emulated boards of its own");
        }
        let Given { board: boards, manager, accelerator, threads } = given;
        let opens = boards.is_some();
        let (mut board, mut memory, mut of_board) = (None, None, None);
        if let Some(options) = boards {
            (board, memory, of_board) = (options.board, options.memory, Some(options.manager));
            if board.is_none() {
                board = instead_of("--board", BOARD, &variable, |text| {
                    text.parse().map_err(|error: BoardTextError| error.to_string())
                })?;
            }
        }
        let board = board.unwrap_or_default();
        let real = !matches!(board, BoardChoice::Built(_) | BoardChoice::Served { .. });
        let named = match opens && real && memory.is_none() {
            true => instead_of("--memory", MEMORY, &variable, memory_choice)?,
            false => None,
        };
        let memory_of_environment = named.is_some();
        let memory = memory.or(named).unwrap_or(MemoryChoice::Automatic);
        let manager = match of_board.or(manager) {
            Some(ManagerOptions { manager: None }) if real => {
                instead_of("--manager", MANAGER, &variable, manager_choice)?
            }
            options => options.and_then(|options| options.manager),
        };
        let emulated = matches!(board, BoardChoice::Automatic | BoardChoice::Built(_));
        let accelerator = match accelerator {
            Some(AcceleratorOptions { accelerator: Some(_) }) if !emulated => {
                return Err(
                    "--accelerator is for an emulated board of this process; leave it out, \
                            or add --board emulated"
                        .to_owned(),
                );
            }
            Some(AcceleratorOptions { accelerator: None }) if emulated => {
                instead_of("--accelerator", RTL, &variable, |path| {
                    Ok(AcceleratorChoice { simulator: Some((path.into(), false)) })
                })?
            }
            options => options.and_then(|options| options.accelerator),
        };
        let (json, manager) = (self.json, manager.unwrap_or_default());
        let accelerator = accelerator.unwrap_or_default();
        Ok(CommonArgs { json, board, threads, memory, memory_of_environment, manager, accelerator })
    }
}

/// Reads an option from a variable of the environment.
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

    #[test]
    fn a_manager_is_a_device_none_or_found_by_its_name() {
        assert_eq!(manager_choice("auto"), Ok(ManagerChoice::Automatic));
        assert_eq!(manager_choice("none"), Ok(ManagerChoice::Unasked));
        assert_eq!(manager_choice("fpga10"), Ok(ManagerChoice::Device("fpga10".to_owned())));
        for wrong in ["fpga", "fpgax", "fpga0/..", "0", "Xilinx"] {
            manager_choice(wrong).expect_err(wrong);
        }
    }
}
