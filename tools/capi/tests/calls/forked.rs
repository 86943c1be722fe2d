//! An accelerator belongs to the process that opened it.

use std::ptr::{from_ref, null, null_mut};

use pgs_support::in_forked_child;
use zynq_pgs_c::*;

use crate::support::*;

/// The calls of a child with its parent's accelerator, and their statuses.
fn statuses(open: &Open, crates: &mut [Crate]) -> [Status; 15] {
    let all = [collision()];
    let (bodies, given, parameters) = (arrays(crates), collisions(&all), defaults());
    let (b, c, p) = (from_ref(&bodies), from_ref(&given), from_ref(&parameters));
    let (handle, none) = (open.0, Strided { data: null_mut(), stride: 24 });
    [
        made!(zpgs_step(handle, b, c, p, null_mut())),
        made!(zpgs_submit(handle, b, c, p)),
        made!(zpgs_wait(handle, b, null_mut())),
        made!(zpgs_prepare(handle, b, c, p)),
        made!(zpgs_wait_and_start(handle, b, null_mut(), null_mut())),
        made!(zpgs_start(handle)),
        made!(zpgs_begin(handle)),
        made!(zpgs_push(handle, all.as_ptr(), null(), 1)),
        made!(zpgs_end(handle, b, p)),
        made!(zpgs_read_impulses(handle, none, 0)),
        made!(zpgs_commit(handle, c)),
        made!(zpgs_forget(handle, 0)),
        made!(zpgs_set_shapes(handle, SHAPES.as_ptr(), SHAPES.len())),
        made!(zpgs_cancel(handle)),
        made!(zpgs_step(handle, null(), null(), null(), null_mut())),
    ]
}

#[test]
fn a_forked_child_is_refused_and_closes_and_the_parents_step_goes_on() {
    let (open, mut crates) = (Open::new("emulated:float"), world());
    let bodies = arrays(&mut crates);
    assert_eq!(open.submit(&bodies, &collisions(&[collision()])), Status::Ok);
    let parent = std::process::id().to_string();
    let in_child = || {
        let mut crates = world();
        if statuses(&open, &mut crates) != [Status::Forked; 15] || crates != world() {
            return 1;
        }
        let text = open.text();
        if !text.contains(&parent) || !text.contains("after the fork") {
            return 2;
        }
        match made!(zpgs_close(open.0)) {
            Status::Ok => 7,
            _ => 3,
        }
    };
    assert_eq!(in_forked_child(in_child), Some(7));
    assert_eq!(open.text(), "", "no call of the parent's has failed");
    assert_eq!(open.wait(&bodies), Status::Ok);
    assert_eq!(crates, stepped());
}
