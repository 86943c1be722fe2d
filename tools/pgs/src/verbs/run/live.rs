//! The page that plays a run while the board steps: its address, and the notes of its frames.

use std::io::{self, Write as _};
use std::net::{Ipv4Addr, SocketAddr};

use clap::Args;
use scene::Scene;
use zynq_pgs::{StepParameters, StepReport};
use zynq_pgs_view::Recording;
use zynq_pgs_view::live::Live;

use super::facts::{board_time, facts};
use super::{Course, RunArgs};
use pgs_command::board::OpenBoard;
use pgs_command::failure::{Cause, Failure, Result};
use pgs_command::options::solver::time_of;
use pgs_command::output::milliseconds;

/// Where the page is served.
#[derive(Debug, Clone, Args)]
pub(super) struct LiveArgs {
    /// Serve a page that plays the run while the board steps, on this machine, or at an ADDRESS of
    /// its network
    ///
    /// The command prints the address of the page, which has a random token.
    #[arg(long, value_name = "[ADDRESS:]PORT", value_parser = loopback_or)]
    live: Option<SocketAddr>,
}

/// An address with a port; a port alone is one of this machine.
fn loopback_or(text: &str) -> Result<SocketAddr, String> {
    let port = text.parse().map(|port: u16| (Ipv4Addr::LOCALHOST, port).into());
    let address: Result<SocketAddr, _> = port.or_else(|_| text.parse());
    let address = address
        .map_err(|_| "expected a port, or an address with one as 192.0.2.7:8000".to_owned())?;
    // A browser names one address in its request, and the page answers to no other.
    if address.ip().to_canonical().is_unspecified() {
        return Err("expected one address, not all of this machine: take the one of the network \
                    from `ip address`, or give the port alone for readers on this machine"
            .to_owned());
    }
    Ok(address)
}

/// The page of a run.
#[derive(Debug)]
pub(super) struct Page {
    live: Live,
    time_step: f32,
}

impl Page {
    /// Begins to serve the page, and prints its address; `None` without the option.
    pub(super) fn start(
        args: &RunArgs,
        opened: &OpenBoard,
        parameters: &StepParameters,
        scene: &Scene,
    ) -> Result<Option<Self>> {
        let Some(address) = args.files.live.live else { return Ok(None) };
        let (title, facts) = (args.scene.text(), facts(args, opened, parameters));
        let mut start = Recording::new(scene.bodies(), scene.geometries());
        let live = start.add(0, 0.0, scene.bodies());
        let live = live.and_then(|()| Live::start(address, &start, &title, &facts));
        let live = live.map_err(|error| Failure::new(Cause::Output, error))?;
        writeln!(io::stderr(), "live at {}", live.url())?;
        Ok(Some(Self { live, time_step: parameters.time_step }))
    }

    /// Shows the scene after `done` steps.
    pub(super) fn step(
        &mut self,
        done: u32,
        report: &StepReport,
        opened: &OpenBoard,
        scene: &Scene,
    ) {
        let modelled = milliseconds(report.modelled_time());
        let note = || format!("step {done}, {}", board_time(opened, modelled));
        self.live.show((done, time_of(done, self.time_step)), note, scene.bodies());
    }

    /// Shows the end of the run, and closes.
    pub(super) fn end(self, course: &Course, opened: &OpenBoard, scene: &Scene) {
        let (done, mean) = (course.done, board_time(opened, course.totals.mean()));
        let note = format!("{done} steps, {mean} on average");
        self.live.end((done, time_of(done, self.time_step)), &note, scene.bodies());
    }
}
