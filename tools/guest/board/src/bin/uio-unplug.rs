//! Unbinds the kernel's driver from the board's UIO node under an open accelerator, as the removal
//! of an overlay does: between two steps, while a step is on the board, or before the end.
#![allow(clippy::print_stdout, reason = "a command line tool")]

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use bitstream_model::interface::address_map::UIO_NODE;
use zynq_pgs::platform::{System, UIO_CLASS, uio_nodes};
use zynq_pgs::{
    Accelerator, BoardChoice, Body, Collision, OpenOptions, Pose, Shape, StepParameters, Velocity,
};

/// Unbinds, and says so: no access to a register may follow this line.
fn unbind() -> Result<(), Box<dyn Error>> {
    let nodes = uio_nodes(&System::default().uio)?;
    let node = nodes.iter().find(|node| node.name == UIO_NODE).ok_or("no such node")?;
    let device = fs::read_link(Path::new(UIO_CLASS).join(&node.device).join("device"))?;
    let device = device.file_name().ok_or("no device")?.to_string_lossy().into_owned();
    fs::write("/sys/bus/platform/drivers/uio_pdrv_genirq/unbind", &device)?;
    println!("unbound");
    Ok(())
}

/// Says how a call ended on a board that is gone.
fn lost<T>(what: &str, result: Result<T, zynq_pgs::Error>) -> Result<(), Box<dyn Error>> {
    match result {
        Err(error) if error.must_reopen() => {
            let source = error.source().map(ToString::to_string).unwrap_or_default();
            println!("{what}: {error}: {source}");
            Ok(())
        }
        Err(error) => Err(format!("{what}: {error}").into()),
        Ok(_) => Err(format!("{what}: it succeeded").into()),
    }
}

fn run(when: &str) -> Result<(), Box<dyn Error>> {
    let board = BoardChoice::Uio { node: UIO_NODE.to_owned() };
    let mut accelerator = Accelerator::open(OpenOptions { board, ..OpenOptions::default() })?;
    let shapes = [Shape::isotropic(1.0, 1.5)];
    accelerator.set_shapes(&shapes)?;
    let pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };
    let mut bodies = vec![Body { pose, velocity: Velocity::default(), shape: 0 }; 5];
    let none: &[Collision] = &[];
    let mut parameters = StepParameters::default();
    parameters.deadline = Some(Duration::from_secs(120));
    accelerator.step(&mut bodies, none, &parameters)?;
    match when {
        "idle" => {
            unbind()?;
            lost("step", accelerator.step(&mut bodies, none, &parameters))?;
            lost("shapes", accelerator.set_shapes(&shapes))?;
        }
        "flight" => {
            let flight = accelerator.submit(&bodies, none, &parameters)?;
            unbind()?;
            lost("step", flight.wait(&mut bodies))?;
        }
        _ => {
            let flight = accelerator.submit(&bodies, none, &parameters)?.detach();
            unbind()?;
            drop(flight);
        }
    }
    drop(accelerator);
    println!("closed");
    Ok(())
}

fn main() -> ExitCode {
    let Some(when) = std::env::args().nth(1) else {
        println!("usage: uio-unplug idle|flight|close");
        return ExitCode::from(2);
    };
    match run(&when) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            println!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
