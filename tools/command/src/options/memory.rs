//! Parses the DMA memory of a real board.

use std::ops::Range;

use bitstream_model::interface::address_map::{
    MEMORY_BASE, MEMORY_BYTES, U_DMA_BUF, UIO_MEMORY_NODE,
};
use zynq_pgs::platform::{Caching, MemoryChoice};

const EXPECTED: &str = "expected auto, u-dma-buf[:NAME[:write-combining]], uio[:NODE] \
                        or devmem[:ADDRESS+BYTES]";

/// Parses a choice of memory.
///
/// # Errors
///
/// Fails on a text that names no memory.
pub fn memory_choice(text: &str) -> Result<MemoryChoice, String> {
    let expected = || EXPECTED.to_owned();
    let (kind, rest) = match text.split_once(':') {
        Some((kind, rest)) if !rest.is_empty() => (kind, Some(rest)),
        Some(_) => return Err(expected()),
        None => (text, None),
    };
    match (kind, rest) {
        ("auto", None) => Ok(MemoryChoice::Automatic),
        ("u-dma-buf", rest) => {
            let rest = rest.unwrap_or(U_DMA_BUF);
            let (name, caching) = match rest.split_once(':') {
                None => (rest, Caching::Cached),
                Some((name, "write-combining")) => (name, Caching::WriteCombining),
                Some((name, "cached")) => (name, Caching::Cached),
                Some(_) => return Err(expected()),
            };
            // The name becomes part of a path.
            if name.is_empty() || name.contains('/') || name.starts_with('.') {
                return Err(format!("{name:?} is no name of a buffer"));
            }
            Ok(MemoryChoice::UDmaBuf { name: name.to_owned(), caching })
        }
        ("uio", node) => Ok(MemoryChoice::Uio { node: node.unwrap_or(UIO_MEMORY_NODE).to_owned() }),
        ("file", _) => Err("a served board brings its memory: leave out the choice".to_owned()),
        ("devmem", None) => {
            Ok(MemoryChoice::DevMem { window: MEMORY_BASE..MEMORY_BASE + MEMORY_BYTES })
        }
        ("devmem", Some(rest)) => Ok(MemoryChoice::DevMem { window: window(rest)? }),
        _ => Err(expected()),
    }
}

/// `ADDRESS+BYTES`, each decimal or with `0x`.
fn window(text: &str) -> Result<Range<u64>, String> {
    let number = |text: &str| match text.strip_prefix("0x") {
        Some(digits) => u64::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    };
    let range = text.split_once('+').and_then(|(address, bytes)| {
        let (start, bytes) = (number(address)?, number(bytes)?);
        (bytes > 0).then_some(start..start.checked_add(bytes)?)
    });
    range.ok_or_else(|| format!("expected ADDRESS+BYTES, as 0x50000000+0x4000000, found {text:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_has_a_default_and_takes_a_name() {
        let u_dma_buf =
            |name: &str, caching| Ok(MemoryChoice::UDmaBuf { name: name.to_owned(), caching });
        let uio = |node: &str| Ok(MemoryChoice::Uio { node: node.to_owned() });
        assert_eq!(memory_choice("auto"), Ok(MemoryChoice::Automatic));
        assert_eq!(memory_choice("u-dma-buf"), u_dma_buf("pgs", Caching::Cached));
        assert_eq!(memory_choice("u-dma-buf:b0"), u_dma_buf("b0", Caching::Cached));
        assert_eq!(
            memory_choice("u-dma-buf:b0:write-combining"),
            u_dma_buf("b0", Caching::WriteCombining)
        );
        assert_eq!(memory_choice("uio"), uio("pgs-memory"));
        assert_eq!(memory_choice("uio:m"), uio("m"));
        let dev_mem = |window| Ok(MemoryChoice::DevMem { window });
        assert_eq!(memory_choice("devmem"), dev_mem(0x5000_0000..0x5400_0000));
        assert_eq!(memory_choice("devmem:0x1000+4096"), dev_mem(0x1000..0x2000));
    }

    #[test]
    fn anything_else_is_refused() {
        for wrong in [
            "",
            "auto:1",
            "uio:",
            "udmabuf",
            "u-dma-buf:../pgs",
            "u-dma-buf:..",
            "u-dma-buf:b0:fast",
            "u-dma-buf::cached",
            "devmem:0x1000",
            "devmem:0x1000+0",
            "devmem:0xffffffffffffffff+2",
            "devmem:-1+2",
            "file:/dev/shm/board",
        ] {
            memory_choice(wrong).expect_err(wrong);
        }
    }
}
