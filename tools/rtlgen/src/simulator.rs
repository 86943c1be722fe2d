//! A simulator of the whole accelerator: generated, Verilated, and compiled with
//! `bitstream-model/rtl/simulator/main.cpp` into a process that an emulated board talks to.

use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use pgs_interface::address_map::DMA_COUNT_MAX;

use crate::design::Design;
use crate::emit::{self, File};
use crate::verify::{Error, verilator};

/// The C++ program around the Verilated accelerator.
const MAIN: &str = include_str!("../../../bitstream-model/rtl/simulator/main.cpp");

/// Name of the built program.
pub const PROGRAM: &str = "pgs-rtl";

/// Writes the files of a design into a folder, which is made if it does not exist.
///
/// # Errors
///
/// The folder or a file cannot be written, or two files are one.
pub fn write(folder: &Path, files: &[File]) -> Result<(), Error> {
    fs::create_dir_all(folder).map_err(Error::io("make the folder"))?;
    let taken = ["/dev/stdout", "/dev/stderr"].map(PathBuf::from);
    let mut taken: Vec<_> = taken.into_iter().filter_map(identity).collect();
    for path in files.iter().map(|file| folder.join(&file.name)) {
        let Some(found) = identity(path) else { continue };
        if let Some((.., other)) =
            taken.iter().find(|other| (found.0, found.1) == (other.0, other.1))
        {
            return Err(Error::OneFile { path: found.2, other: other.clone() });
        }
        taken.push(found);
    }
    for File { name, text } in files {
        fs::write(folder.join(name), text).map_err(Error::io("write a file of the design"))?;
    }
    Ok(())
}

/// The device and the inode of a file that is there, and its path: equal for every link to the
/// file.
fn identity(path: PathBuf) -> Option<(u64, u64, PathBuf)> {
    let found = fs::metadata(&path).ok().filter(fs::Metadata::is_file)?;
    Some((found.dev(), found.ino(), path))
}

/// Whether a simulator can write waveforms, which makes it slower.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Waveform {
    /// It has none.
    None,
    /// It writes a VCD file on request.
    Vcd,
}

/// Builds the simulator of a design in a folder; the path of the program.
///
/// # Errors
///
/// A tool is missing, or the build fails.
pub fn build(design: &Design, folder: &Path, waveform: Waveform) -> Result<PathBuf, Error> {
    build_files(&emit::files(design), folder, waveform)
}

/// The streams each way that the top module of these files has.
fn streams(files: &[File]) -> usize {
    let is_top = |file: &&File| file.name.strip_suffix(".v") == Some(emit::TOP);
    let top = files.iter().find(is_top).map_or("", |file| file.text.as_str());
    (0..DMA_COUNT_MAX).take_while(|k| top.contains(&format!("s{k}_axis_tdata"))).count()
}

/// Builds the simulator from the files of a design, which may have been changed.
///
/// # Errors
///
/// As for [`build`].
pub fn build_files(files: &[File], folder: &Path, waveform: Waveform) -> Result<PathBuf, Error> {
    verilator::require("a simulator of the accelerator")?;
    write(folder, files)?;
    let elsewhere = if verilator::takes(folder)? { None } else { Some(verilator::place()?) };
    let place = elsewhere.as_ref().map_or(folder, |elsewhere| elsewhere.path());
    if elsewhere.is_some() {
        write(place, files)?;
    }
    fs::write(place.join("main.cpp"), MAIN).map_err(Error::io("write the simulator's program"))?;
    let modules = files.iter().filter(|file| file.name.ends_with(".v"));
    let mut names: Vec<String> = modules.map(|file| file.name.clone()).collect();
    names.push("main.cpp".into());
    // The simulation is hardly faster with -O2, and the build takes four times as long.
    let waveform = waveform == Waveform::Vcd;
    let flags = format!("-O1 -DSTREAMS={}", streams(files));
    let build = verilator::Build { top: emit::TOP, flags: &flags, files: &names, waveform };
    verilator::build(place, &build)?;
    let program = folder.join(PROGRAM);
    fs::copy(place.join("obj").join(format!("V{}", emit::TOP)), &program)
        .map_err(Error::io("copy the simulator"))?;
    Ok(program)
}
