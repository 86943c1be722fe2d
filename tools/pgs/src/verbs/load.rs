//! The verb `load`: loads a bitstream into the logic, and an overlay into the device tree.

use std::io::{self, Write};
use std::path::PathBuf;
use std::process;

use clap::Args;
use pgs_loading::{AtFault, Chip, Judged, Linux, LoadError, Progress, Request};
use serde_json::{Value, json};

use pgs_command::common::{CommonArgs, ManagerOptions};
use pgs_command::failure::{Cause, Failure, INTERRUPTED, Result, Verdict};
use pgs_command::interrupt;
use pgs_command::output::facts::whole_fact;
use pgs_command::output::{SCHEMA, milliseconds};

const EXAMPLES: &str = "\
Examples on a board:
  pgs load zynq-pgs.bit.bin --overlay zynq-pgs.dtbo
  pgs load zynq-pgs.bit.bin
  pgs load --check zynq-pgs.bit.bin --overlay zynq-pgs.dtbo    on any machine
  pgs load --json /lib/firmware/xilinx/zynq-pgs/zynq-pgs.bit.bin
  pgs load zynq-pgs.bit.bin --manager fpga1    if several FPGA managers may be the ZynqMP's

Needs root and the vendor's kernel. A file outside the kernel's firmware folders is copied there
during loading. Both files are judged by their content first: the chip, the end of the bitstream,
the overlay's fragments, firmware-name and PL clock. The command refuses to load while a program has
a device file of the logic, a u-dma-buf or /dev/mem open or locked. Without --replace-others it also
refuses while another overlay is applied or a driver is bound to the logic. Remove the overlay by
rmdir /sys/kernel/config/device-tree/overlays/pgs; see device-tree/README.md.";

/// Load a bitstream through the kernel's FPGA manager
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct LoadArgs {
    /// Bitstream in bootgen's format (.bit.bin).
    file: PathBuf,
    /// Compiled overlay, applied after the bitstream is loaded.
    #[arg(long, value_name = "DTBO")]
    overlay: Option<PathBuf>,
    /// Judge the files and load nothing. Needs no board.
    #[arg(long)]
    check: bool,
    /// The chip that the bitstream must be for: its name, or its IDCODE as 0x04738093.
    #[arg(long, value_name = "CHIP", default_value = "XCZU9EG")]
    part: Chip,
    /// Load files that cannot be judged, such as encrypted ones, or that are refused for their
    /// content.
    #[arg(long)]
    unjudged: bool,
    /// Load although other overlays or kernel drivers are bound to the logic. They stay bound, and
    /// their behaviour with the new logic is unknown.
    #[arg(long)]
    replace_others: bool,
    /// Directory that holds the system's files, for tests.
    #[arg(long, hide = true, default_value = "/")]
    system_root: PathBuf,
    #[command(flatten)]
    pub(crate) manager: ManagerOptions,
}

/// The failure of a bitstream that is not loaded.
fn failure(error: LoadError) -> Failure {
    let next = error.next();
    let cause = match error.at_fault() {
        AtFault::Caller => Cause::Input,
        AtFault::System => Cause::NoBoard,
        AtFault::Logic => Cause::Hardware,
    };
    Failure::new(cause, error).next(next)
}

/// Loads a bitstream, or judges the files.
pub(crate) fn run(args: &LoadArgs, common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict> {
    let system = Linux { root: args.system_root.clone() };
    let request = Request {
        bitstream: args.file.clone(),
        overlay: args.overlay.clone(),
        part: args.part,
        unjudged: args.unjudged,
        manager: common.manager.clone(),
        replace_others: args.replace_others,
    };
    if args.check {
        let judged = pgs_loading::check(&request).map_err(failure)?;
        if common.json {
            writeln!(out, "{:#}", document(args, &judged))?;
        } else {
            write_judged(args, &judged, out)?;
            whole_fact(out, "checked", "nothing was loaded")?;
        }
        return Ok(Verdict::Done);
    }

    let progress = Progress::default();
    let seen = progress.clone();
    interrupt::take_over(move || {
        seen.end(|error| {
            // With stderr closed, the exit code still tells it.
            let _ = writeln!(io::stderr(), "{}", failure(error).chain());
            process::exit(INTERRUPTED.into());
        });
    });
    let loaded = pgs_loading::load(&system, &request, &progress).map_err(failure)?;
    if common.json {
        let nodes: Vec<Value> = loaded
            .nodes
            .iter()
            .map(|node| json!({ "device": node.device, "name": node.name }))
            .collect();
        let mut document = document(args, &loaded.judged);
        document["bitstream"]["firmware"] = loaded.firmware.into();
        document["bitstream"]["copied"] = loaded.copied.into();
        document["manager"] = json!({
            "device": loaded.manager,
            "name": loaded.manager_name,
            "state_before": loaded.state_before,
            "state": loaded.state,
        });
        document["load_ms"] = json!(milliseconds(loaded.time));
        document["overlay"] = json!(loaded.overlay);
        document["uio_nodes"] = nodes.into();
        writeln!(out, "{document:#}")?;
        return Ok(Verdict::Done);
    }

    write_judged(args, &loaded.judged, out)?;
    let mut line = |label: &str, text: String| whole_fact(out, label, &text);
    line(
        "manager",
        format!(
            "{} ({}): {} -> {}, {:.1} ms",
            loaded.manager,
            loaded.manager_name,
            loaded.state_before,
            loaded.state,
            milliseconds(loaded.time),
        ),
    )?;
    if let Some(overlay) = loaded.overlay {
        line("overlay", format!("{overlay:?} applied"))?;
    }
    for node in &loaded.nodes {
        line("uio node", format!("{} {:?}", node.device, node.name))?;
    }
    if loaded.nodes.is_empty() {
        line("uio node", "none: apply an overlay, see device-tree/README.md".to_owned())?;
    }
    Ok(Verdict::Done)
}

/// The facts that the files tell, for programs.
fn document(args: &LoadArgs, judged: &Judged) -> Value {
    json!({
        "schema": SCHEMA,
        "verb": "load",
        "bitstream": {
            "file": args.file.display().to_string(),
            "bytes": judged.bytes(),
            "chip": judged.chip.map(|chip| chip.to_string()),
        },
        "pl_clock": {
            "bitstream_mhz": judged.wanted_mhz,
            "overlay_hz": judged.overlay_clock_hz().flatten(),
        },
    })
}

/// The same facts, for people.
fn write_judged(args: &LoadArgs, judged: &Judged, out: &mut dyn Write) -> io::Result<()> {
    let (file, bytes) = (args.file.display(), judged.bytes());
    whole_fact(out, "bitstream", &format!("{file}, {bytes} bytes"))?;
    let chip = judged.chip.map_or_else(|| "not known".to_owned(), |chip| chip.to_string());
    whole_fact(out, "chip", &chip)?;
    let wanted = match judged.wanted_mhz {
        Some(mhz) => format!("the bitstream asks for {mhz} MHz"),
        None => "the bitstream does not say which rate it asks for (no USR_ACCESS)".to_owned(),
    };
    let set = match judged.overlay_clock_hz() {
        Some(Some(hz)) => format!(", the overlay sets {} MHz", f64::from(hz) / 1e6),
        Some(None) => ", the overlay sets none".to_owned(),
        None => String::new(),
    };
    whole_fact(out, "pl clock", &format!("{wanted}{set}"))
}
