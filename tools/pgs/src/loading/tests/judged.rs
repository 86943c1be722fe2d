//! The files are judged before the first look at the system.

use std::os::unix::net::UnixListener;

use super::files::{BODY, DESYNCED, HEAD, Node, bytes, chip, noise, overlay, write};
use super::*;

/// A system without an FPGA manager: a laptop.
fn laptop() -> FakeKernel {
    let kernel = FakeKernel::vendor();
    kernel.remove("sys");
    kernel
}

/// Asserts that these files are refused as the caller's: on a laptop, on a board, and by a check.
fn assert_wrong(request: &Request, message: &str, next: &str) {
    let kernel = FakeKernel::vendor();
    let errors =
        [check(request).map(drop), laptop().ask(request).map(drop), kernel.ask(request).map(drop)];
    for error in errors {
        let error = error.expect_err("refused");
        assert_eq!(error.at_fault(), AtFault::Caller, "{error}");
        assert!(error.to_string().contains(message), "{error}");
        assert!(error.next().contains(next), "{}", error.next());
    }
    assert_eq!(kernel.written(), []);
}

#[test]
fn a_bitstream_of_another_chip_or_one_that_breaks_off_is_refused_without_a_board_too() {
    let kernel = laptop();
    let z7020 = bytes(&[HEAD, &chip(0x0372_7093), BODY, DESYNCED]);
    let file = kernel.bytes("home/z7020.bit.bin", &z7020);
    assert_wrong(&request(&file), "XCZU9EG (IDCODE 0x04738093), found one for XC7Z020", "--part");
    let whole = bitstream();
    let file = kernel.bytes("home/cut.bit.bin", &whole[..200]);
    assert_wrong(&request(&file), "breaks off after 200 bytes", "--unjudged");
    let file = kernel.bytes("home/odd.bit.bin", &whole[..whole.len() - 3]);
    assert_wrong(&request(&file), "no multiple of 4", "--unjudged");
    // A good one is good on a laptop, up to its missing manager.
    let good = request(&kernel.elsewhere());
    assert_eq!(check(&good).expect("good").wanted_mhz, Some(100));
    let error = kernel.ask(&good).expect_err("a laptop");
    assert!(matches!(error, LoadError::NoManager { .. }), "{error}");
}

#[test]
fn a_bitstream_that_cannot_be_judged_is_refused_last_and_goes_to_the_kernel_as_it_is() {
    let encrypted = bytes(&[HEAD, &write(11, &[1; 4]), &noise(40)]);
    for (file, reason) in [
        (encrypted, "it is encrypted"),
        (bytes(&[HEAD, &noise(40)]), "no packet stands at byte"),
        (bytes(&[&noise(400)]), "no sync word"),
        (vec![0; 1000], "no sync word"),
    ] {
        let kernel = FakeKernel::vendor();
        let mut asked = request(&kernel.bytes("lib/firmware/odd.bit.bin", &file));
        kernel.expected.replace(file);
        for error in [check(&asked).map(drop), kernel.ask(&asked).map(drop)] {
            let error = error.expect_err("not judged");
            assert_eq!(error.at_fault(), AtFault::Caller, "{error}");
            assert!(error.to_string().contains(reason), "{error}");
            assert!(!error.to_string().contains("breaks off"), "{error}");
            assert!(error.next().contains("--unjudged"), "{}", error.next());
        }
        assert_eq!(kernel.written(), []);
        // A program that uses the logic is named first: an option lifts the doubt.
        kernel.add_process(4711, "peek", "/dev/mem");
        let error = kernel.ask(&asked).expect_err("in use");
        assert_refused(&kernel, &error, "/dev/mem is open in process 4711", "stop");
        kernel.remove("proc");
        asked.unjudged = true;
        check(&asked).expect("asked for");
        kernel.ask(&asked).expect("asked for");
    }
}

#[test]
fn zeros_behind_a_sync_word_are_left_to_the_kernel_and_do_not_pass_a_check() {
    let kernel = FakeKernel::vendor();
    let zeros = bytes(&[&HEAD[..7], &[0; 250]]);
    let asked = request(&kernel.bytes("lib/firmware/zeros.bit.bin", &zeros));
    kernel.expected.replace(zeros);
    let error = check(&asked).expect_err("no answer to a check");
    assert!(error.to_string().contains("nothing but zeros"), "{error}");
    kernel.ask(&asked).expect("the kernel took it");
}

#[test]
fn an_overlay_that_cannot_go_with_the_bitstream_is_refused_before_anything_is_loaded() {
    let kernel = laptop();
    let bitstream = kernel.elsewhere();
    let with = |tree: &[u8]| {
        let overlay = Some(kernel.bytes("home/x.dtbo", tree));
        Request { overlay, ..request(&bitstream) }
    };
    let base = files::tree(Node("", &[("compatible", b"board\0")], &[]));
    assert_wrong(&with(&base), "a base tree: it has no fragments", "dtc -@");
    let region = overlay(Some(100_000_000), Some("another.bit.bin"));
    assert_wrong(&with(&region), "load \"another.bit.bin\" (its firmware-name)", "fpgautil");
    let fast = with(&overlay(Some(275_000_000), None));
    assert_wrong(&fast, "sets the PL clock 0 to 275000000 Hz", "<100000000>");
    let foreign = with(&Node("", &[("status", b"okay\0")], &[]).overlay());
    assert_wrong(&foreign, "without a node for the accelerator's registers", "--unjudged");
    for refused in [fast, foreign] {
        check(&Request { unjudged: true, ..refused }).expect("asked for");
    }

    // As the kernel's dividers give it, and where one of the two says nothing.
    for hz in [Some(99_999_001), None] {
        check(&with(&overlay(hz, None))).expect("it fits");
    }
    let silent = kernel.bytes("home/silent.bit.bin", &files::bitstream(None));
    let overlay = Some(kernel.bytes("home/x.dtbo", &overlay(Some(275_000_000), None)));
    let judged = check(&Request { overlay, ..request(&silent) }).expect("not known");
    assert_eq!((judged.wanted_mhz, judged.overlay_clock_hz()), (None, Some(Some(275_000_000))));
}

#[test]
fn an_overlay_that_loads_the_same_bitstream_needs_it_where_the_kernel_looks() {
    let kernel = FakeKernel::vendor();
    let tree = kernel.bytes("home/region.dtbo", &overlay(None, Some("zynq-pgs.bit.bin")));
    let of = |file: &Path| Request { overlay: Some(tree.clone()), ..request(file) };
    for elsewhere in [kernel.elsewhere(), kernel.installed()] {
        check(&of(&elsewhere)).expect("of the same name");
        let error = kernel.ask(&of(&elsewhere)).expect_err("not found by the kernel");
        assert!(matches!(error, LoadError::OwnFirmware { .. }), "{error}");
        assert_eq!(kernel.written(), []);
    }
    let there = kernel.bytes("lib/firmware/zynq-pgs.bit.bin", &bitstream());
    kernel.ask(&of(&there)).expect("there it is");
}

#[test]
fn what_is_no_plain_file_or_has_no_end_is_neither_waited_for_nor_read() {
    let kernel = laptop();
    let good = kernel.elsewhere();
    let socket = kernel.path("home/socket");
    let _socket = UnixListener::bind(&socket).expect("made");
    for file in [socket, "/dev/zero".into(), kernel.path("home")] {
        assert_wrong(&request(&file), "no plain file", "README");
        let overlay = Some(file);
        assert_wrong(&Request { overlay, ..request(&good) }, "no plain file", "dtc -@");
    }
    let large = kernel.bytes("home/large", b"");
    let sparse = fs::File::options().write(true).open(&large).expect("there");
    sparse.set_len(1 << 40).expect("sparse");
    assert_wrong(&request(&large), "a file of more than", "README");
    let overlay = Some(large);
    assert_wrong(&Request { overlay, ..request(&good) }, "a file of more than", "dtc -@");
}
