//! Where the system gives no more threads, as in a container with a limit on processes, every
//! command does with fewer.

use std::process::Command;

use crate::common::{Ran, golden, pgs, run, skipped};

/// `command`, for a user who may have one process and no more. Root has no such limit, and becomes
/// the user 65534 first.
fn limited(command: &Command) -> Command {
    let mut limited = Command::new("setpriv");
    let id = Command::new("id").arg("-u").output();
    if id.is_ok_and(|id| id.stdout == b"0\n") {
        limited.args(["--reuid", "65534", "--regid", "65534", "--clear-groups"]);
    }
    limited.args(["prlimit", "--nproc=1:1"]);
    limited.arg(command.get_program()).args(command.get_args());
    limited.envs(command.get_envs().filter_map(|(name, value)| Some((name, value?))));
    limited
}

/// Whether that limit can be set here, and holds, and the command can be started under it.
fn can_limit() -> bool {
    let mut fork = Command::new("sh");
    fork.args(["-c", "true & wait; echo forked"]);
    let refuses = limited(&fork).output().is_ok_and(|output| !output.stdout.starts_with(b"forked"));
    let mut version = pgs();
    version.arg("--version");
    refuses && limited(&version).output().is_ok_and(|output| output.status.success())
}

#[test]
fn every_command_does_with_fewer_threads() {
    if !can_limit() {
        return skipped("a limit on threads (no setpriv and prlimit, or no limit on processes)");
    }
    let cube = golden("one_cube").display().to_string();
    for arguments in [
        &["thesis", "compare", "float", "half", "--grid", "4x4x4", "--steps", "2"][..],
        &["thesis", "compare", "float", "half", "--input", &cube],
        &["run", "--grid", "4x4x4", "--steps", "2"],
        &["solve", &cube, "--digest"],
        &["thesis", "formats", "--grid", "3x3x3", "--step", "2"],
        &["thesis", "order", "--input", &cube],
        &["check"],
        &["faults", "--board", "emulated:naive", "--json"],
    ] {
        let mut command = pgs();
        command.args(arguments);
        let alone: Ran = limited(&command).output().expect("it starts").into();
        let usual = run(arguments);
        assert_eq!(alone.code, usual.code, "{arguments:?}: {}", alone.stderr);
        assert!(!alone.stderr.contains("panicked"), "{arguments:?}: {}", alone.stderr);
        if arguments.starts_with(&["thesis", "compare"]) {
            assert_eq!(alone.stdout, usual.stdout, "{arguments:?}");
        }
    }
}

/// The system's own stack is as large as `ulimit -s` says, which may be less than parsing needs.
#[test]
fn a_command_needs_no_stack_of_the_systems() {
    let cube = golden("one_cube").display().to_string();
    let commands: [&[&str]; 4] = [
        &["solve", &cube, "--digest"],
        &["run", "--grid", "3x3x3", "--steps", "2", "--json"],
        &["check", "--board", "emulated"],
        &["--help"],
    ];
    for arguments in commands {
        let command = pgs();
        let mut shell = Command::new("sh");
        shell.args(["-c", "ulimit -s 64; exec \"$0\" \"$@\""]);
        shell.arg(command.get_program()).args(command.get_args()).args(arguments);
        shell.envs(command.get_envs().filter_map(|(name, value)| Some((name, value?))));
        let ran: Ran = shell.output().expect("a shell").into();
        assert_eq!(ran.code, Some(0), "{arguments:?}: {}", ran.stderr);
    }
}
