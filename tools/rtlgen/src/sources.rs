//! The Verilog of the repository, as part of the program.

use pgs_interface::number::Precision;
use pgs_interface::profile::{self, Profile};

/// A file of Verilog.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// Name of the file, which is the module's with `.v`.
    pub file: &'a str,
    /// The Verilog in it.
    pub text: &'a str,
}

macro_rules! sources {
    ($($folder:literal: $($name:literal),+;)*) => {
        &[$($(Source {
            file: concat!("pgs_", $name, ".v"),
            text: include_str!(concat!(
                env!("CARGO_MANIFEST_DIR"), "/../../bitstream-model/rtl/", $folder, "pgs_", $name, ".v"
            )),
        }),+),*]
    };
}

/// The arithmetic operators of binary32, each after the modules that it is made of.
const BINARY32: &[Source<'_>] = sources! {
    "operators/": "fadd", "fmul", "fdiv", "fsqrt", "horner", "fsincos";
};

/// The ones of binary16, and the conversion to it.
const BINARY16: &[Source<'_>] = sources! {
    "operators/": "hnormal", "hround", "hadd", "hmul", "hdiv", "hsqrt", "hsincos", "float_to_half";
};

/// Comparisons and selections, which have the width as a parameter.
const OF_BOTH: &[Source<'_>] = sources! {
    "operators/": "fbelow", "fmax", "fmin", "fmax_or", "fmin_or", "fless", "fselect", "fnonzero",
        "flogic_or", "flogic_and";
};

/// The operators of a precision.
#[must_use]
pub fn operators(precision: Precision) -> Vec<Source<'static>> {
    let arithmetic = match precision {
        Precision::F32 => BINARY32,
        Precision::Binary16 => BINARY16,
    };
    [arithmetic, OF_BOTH].concat()
}

/// Modules of every profile.
const COMMON: &[Source<'_>] = sources! {
    "memory/": "pipeline_register", "delay", "fifo", "block_fifo", "ram_tile", "ram_lane", "true_dual_port";
    "stream/": "word_sum", "receiver", "sender";
    "operators/": "half_to_float";
    "step/": "step_sequence";
    "pass/": "impulse_sum";
    "": "control_block";
};

/// All others of `float`, each after the modules that it is made of.
const FLOAT: &[Source<'_>] = sources! {
    "memory/": "timed_flag";
    "step/": "constants", "loader", "body_shapes", "world_bodies", "bodies", "integrator";
    "pass/": "finder", "issue", "queue_records", "queue_hazard", "queue_first", "queue", "issue_numbers", "impulses";
    "": "core", "top";
};

/// All others of `half`.
const HALF: &[Source<'_>] = sources! {
    "memory/": "two_banks";
    "half/": "half_packets", "half_constants", "half_loader", "half_shapes", "half_finder", "half_issue", "half_impulses",
        "half_integrator", "half_results", "half_core", "top";
};

/// The hand-written modules of a profile.
pub fn of(profile: &Profile) -> impl Iterator<Item = Source<'static>> {
    let own = if profile.id == profile::HALF.id { HALF } else { FLOAT };
    operators(profile.numbers.updates).into_iter().chain([COMMON, own].concat())
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::{fs, io};

    use super::*;

    fn all() -> impl Iterator<Item = &'static Source<'static>> {
        [BINARY32, BINARY16, OF_BOTH, COMMON, FLOAT, HALF].into_iter().flatten()
    }

    fn verilog_below(folder: &Path, files: &mut Vec<String>) -> io::Result<()> {
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            if path.is_dir() {
                verilog_below(&path, files)?;
            } else if path.extension().is_some_and(|extension| extension == "v") {
                files.extend(path.file_name().map(|name| name.to_string_lossy().into_owned()));
            }
        }
        Ok(())
    }

    #[test]
    fn the_lists_have_every_file_of_the_folder() -> io::Result<()> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../bitstream-model/rtl");
        let mut files = Vec::new();
        verilog_below(&folder, &mut files)?;
        let mut listed: Vec<_> = all().map(|source| source.file).collect();
        files.sort();
        listed.sort_unstable();
        assert_eq!(files, listed);
        Ok(())
    }

    #[test]
    fn every_file_holds_the_module_of_its_name() {
        for Source { file, text } in all() {
            let module = format!("\nmodule {} ", file.trim_end_matches(".v"));
            assert_eq!(text.matches("\nmodule ").count(), 1, "{file}");
            assert!(text.contains(&module), "{file}");
            assert!(text.contains("\n`default_nettype none\n"), "{file}");
            assert!(text.ends_with("\n`default_nettype wire\n"), "{file}");
        }
    }
}
