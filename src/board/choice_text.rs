//! Reads the choice of a board from one text.

use std::str::FromStr;

use pgs_interface::address_map::UIO_NODE;

use super::open::BoardChoice;
use crate::error::BoardTextError;
use crate::platform::DevMemWindows;

impl FromStr for BoardChoice {
    type Err = BoardTextError;

    /// Reads `auto`, `uio` (the node `pgs`) or `uio:NODE`, `devmem` (the addresses of the
    /// interface), `emulated` or `emulated:BUILD` (see [`emulation`](crate::emulation)), or
    /// `socket:PATH` (a board that `pgs serve` serves).
    ///
    /// # Errors
    /// [`BoardTextError`] says which part of the text is wrong.
    fn from_str(text: &str) -> Result<Self, BoardTextError> {
        match text.split_once(':').map_or((text, None), |(kind, rest)| (kind, Some(rest))) {
            ("auto", None) => Ok(Self::Automatic),
            ("uio", None) => Ok(Self::Uio { node: UIO_NODE.to_owned() }),
            ("uio", Some(node)) if !node.is_empty() => Ok(Self::Uio { node: node.to_owned() }),
            ("devmem", None) => Ok(Self::DevMem(DevMemWindows::default())),
            ("emulated", build) => emulated(build),
            ("socket", Some(path)) if !path.is_empty() => served(path),
            _ => Err(BoardTextError::Unknown { found: text.to_owned() }),
        }
    }
}

#[cfg(feature = "emulation")]
fn emulated(build: Option<&str>) -> Result<BoardChoice, BoardTextError> {
    Ok(BoardChoice::Built(build.map(str::parse).transpose()?.unwrap_or_default()))
}

#[cfg(not(feature = "emulation"))]
fn emulated(_: Option<&str>) -> Result<BoardChoice, BoardTextError> {
    Err(BoardTextError::NoEmulation)
}

#[cfg(feature = "emulation")]
fn served(path: &str) -> Result<BoardChoice, BoardTextError> {
    Ok(BoardChoice::Served { socket: path.into() })
}

#[cfg(not(feature = "emulation"))]
fn served(_: &str) -> Result<BoardChoice, BoardTextError> {
    Err(BoardTextError::NoEmulation)
}

#[cfg(all(test, feature = "emulation"))]
mod tests {
    use super::*;
    use crate::emulation::BuildError;

    fn choice(text: &str) -> Result<BoardChoice, BoardTextError> {
        text.parse()
    }

    #[test]
    fn each_kind_of_board_has_a_text() {
        assert!(matches!(choice("auto"), Ok(BoardChoice::Automatic)));
        for (text, name) in [("uio", "pgs"), ("uio:other", "other"), ("uio:a:b", "a:b")] {
            assert!(
                matches!(choice(text), Ok(BoardChoice::Uio { node }) if node == name),
                "{text}"
            );
        }
        assert!(matches!(choice("devmem"), Ok(BoardChoice::DevMem(_))));
        let built = |text: &str, build: &str| {
            let build = build.parse().unwrap_or_default();
            assert!(matches!(choice(text), Ok(BoardChoice::Built(found)) if found == build));
        };
        built("emulated", "");
        built("emulated:half,f32", "half,f32");
        let socket = choice("socket:/tmp/a:b").expect("a socket");
        assert!(matches!(socket, BoardChoice::Served { socket } if socket.ends_with("a:b")));
    }

    #[test]
    fn a_text_that_names_no_board_is_refused_with_the_texts_that_do() {
        for text in
            ["", "Auto", "auto:1", "uio:", "devmem:0", "socket", "socket:", "float", "emulated "]
        {
            let error = choice(text).expect_err(text);
            assert_eq!(
                error.to_string(),
                format!(
                    "found {text:?} as a board: give auto, uio[:NODE], devmem, emulated[:BUILD] or \
                     socket:PATH"
                )
            );
        }
        for text in ["emulated:", "emulated:fast"] {
            let error = choice(text).expect_err(text);
            assert!(matches!(error, BoardTextError::Build(BuildError::Profile { .. })), "{error}");
        }
    }
}
