//! The targets: functions of bytes that panic when they find something.

mod calls;
mod chains;
mod confinement;
mod devices;
mod faults;
/// Bitstreams and overlays as the tests of loading make them.
#[path = "../../../pgs/src/loading/tests/files.rs"]
mod files;
mod folders;
mod loads;
mod packets;
mod registers;
mod scenes;
mod served;
mod space;

use crate::tally::Tally;

/// A target.
#[derive(Debug)]
pub struct Target {
    /// Its name.
    pub name: &'static str,
    /// The code under test, and the property to check.
    pub about: &'static str,
    /// One execution.
    pub run: fn(&[u8]) -> Tally,
    /// Bytes of an input, at most.
    pub longest: usize,
}

/// Every target.
pub const ALL: &[Target] = &[
    Target {
        name: "registers",
        about: "random register accesses, buffers and waits on the emulated board: owners keep \
                their buffers, read-only buffers stay unchanged, and time goes on",
        run: registers::run,
        longest: 256,
    },
    Target {
        name: "chains",
        about: "random descriptors and direct transfers on memory that checks every access: no \
                access outside the grants, and none without a request",
        run: chains::run,
        longest: 512,
    },
    Target {
        name: "packets",
        about: "damaged steps of every profile: the accelerator ends, reports an error, or waits; \
                after a reset the undamaged step has the bits of a fresh board",
        run: packets::run,
        longest: 192,
    },
    Target {
        name: "folders",
        about: "damaged folders of arrays: the loader takes them or names the error, and a loaded \
                step equals the files",
        run: folders::run,
        longest: 256,
    },
    Target {
        name: "confinement",
        about: "random steps of the driver on every profile: no access outside the buffers of the \
                step, a refused step changes no body, a step taken twice has the same bits",
        run: confinement::run,
        longest: 768,
    },
    Target {
        name: "faults",
        about: "faults of the board during the driver's steps: each ends in time with the bits of \
                a step without faults, or with an error that changed nothing, and the next one \
                works",
        run: faults::run,
        longest: 320,
    },
    Target {
        name: "requests",
        about: "random requests to a served board: each gets the answer that the messages promise, \
                a driver that breaks them loses the board, and the next one gets it",
        run: served::requests,
        longest: 512,
    },
    Target {
        name: "answers",
        about: "the driver on a served board whose answers are falsified: opening and steps end, \
                with an error that changed nothing or with a result",
        run: served::answers,
        longest: 64,
    },
    Target {
        name: "devices",
        about: "damaged descriptions of devices, in sysfs and in the device tree: they are read or \
                refused in words, and no region reaches behind its map",
        run: devices::run,
        longest: 256,
    },
    Target {
        name: "loads",
        about: "damaged bitstreams and overlays: they are refused in words as the caller's; files \
                that are taken are for this chip and set the clock that the bitstream asks for",
        run: loads::run,
        longest: 256,
    },
    Target {
        name: "calls",
        about: "calls of the C interface with random sizes, strides and values: a refused call \
                changes no byte, and no call a byte between the elements",
        run: calls::run,
        longest: 512,
    },
];

/// The target with this name.
#[must_use]
pub fn by_name(name: &str) -> Option<&'static Target> {
    ALL.iter().find(|target| target.name == name)
}
