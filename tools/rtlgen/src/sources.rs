//! The Verilog of `bitstream-model/rtl`, in one list.

/// A Verilog file.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// Name of the file, which is the module's with `.v`.
    pub file: &'a str,
    /// The Verilog in it.
    pub text: &'a str,
}

macro_rules! sources {
    ($folder:literal: $($module:literal)*) => {
        &[$(Source {
            file: concat!($module, ".v"),
            text: include_str!(concat!(
                env!("CARGO_MANIFEST_DIR"), "/../../bitstream-model/rtl/", $folder, "/", $module, ".v"
            )),
        }),*]
    };
}

/// The operators, and the modules inside them.
pub const OPERATORS: &[Source<'_>] = sources!("operators":
    "fadd" "fmul" "fdiv" "fsqrt" "fsincos" "horner"
    "fmax" "fmin" "fless" "fbelow" "fselect" "fnonzero" "flogic_or"
);

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::{fs, io};

    use super::*;

    #[test]
    fn the_list_has_every_file_of_the_folder() -> io::Result<()> {
        let folder =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../bitstream-model/rtl/operators");
        let mut files = Vec::new();
        for entry in fs::read_dir(folder)? {
            files.push(entry?.file_name().to_string_lossy().into_owned());
        }
        let mut listed: Vec<_> = OPERATORS.iter().map(|source| source.file).collect();
        files.sort();
        listed.sort_unstable();
        assert_eq!(files, listed);
        Ok(())
    }

    #[test]
    fn every_file_holds_the_module_of_its_name() {
        for Source { file, text } in OPERATORS {
            let module = format!("\nmodule {} ", file.trim_end_matches(".v"));
            assert_eq!(text.matches("\nmodule ").count(), 1, "{file}");
            assert!(text.contains(&module), "{file}");
            assert!(text.contains("\n`default_nettype none\n"), "{file}");
            assert!(text.ends_with("\n`default_nettype wire\n"), "{file}");
        }
    }
}
