//! Every command that `README.md`, the pages and each `--help` print runs in a clone, or stands in
//! a block or below a heading that names its need.
//!
//! A debug build runs scenes in small and leaves out the longest commands; a release build, in the
//! stage `examples`, runs all of them as they are printed.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::io::{BufRead as _, BufReader};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Mutex;

use crate::common::{Ran, Tied, run, signal};
use crate::documents::{blocks, documents, root, text};

const IN_SMALL: bool = cfg!(debug_assertions);
/// The words behind the `sh` of a block whose commands need more than a clone.
const NEEDS: [&str; 5] = ["board", "root", "vivado", "verilator", "yocto"];
/// The place of the socket in the examples.
const SOCKET: &str = "/tmp/board";

/// A printed command.
struct Example {
    place: String,
    command: String,
    /// Its need, where it says one.
    need: Option<String>,
}

impl fmt::Display for Example {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} ({:?})", self.place, self.command, self.need)
    }
}

/// The help of `pgs` and of each verb, by the words before `--help`.
fn helps() -> BTreeMap<Vec<String>, String> {
    let mut helps = BTreeMap::new();
    let mut left = vec![Vec::new()];
    while let Some(verb) = left.pop() {
        let help = run(verb.iter().cloned().chain(["--help".to_owned()])).stdout;
        let heads = ["Commands:", "Experiments:"];
        let verbs = help.lines().skip_while(|line| !heads.contains(line)).skip(1);
        let names = verbs.take_while(|line| !line.is_empty()).filter_map(|line| {
            line.strip_prefix("  ").filter(|line| !line.starts_with(' '))?.split(' ').next()
        });
        for name in names.filter(|name| *name != "help") {
            left.push(verb.iter().cloned().chain([name.to_owned()]).collect());
        }
        helps.insert(verb, help);
    }
    helps
}

/// The examples of a help: the lines with a command below `Examples:`, or below `Examples on a
/// board:`.
fn of_help(verb: &[String], help: &str) -> Vec<Example> {
    let mut examples = Vec::new();
    let mut need = None;
    let mut begun = String::new();
    for line in help.lines() {
        assert!(line.chars().count() <= 100, "too long: {line}");
        if let Some(heading) = line.strip_prefix("Examples").and_then(|line| line.strip_suffix(':'))
        {
            need = Some(heading.trim().to_owned()).filter(|need| !need.is_empty());
        } else if let Some(part) = line.strip_suffix('\\') {
            begun = format!("{} ", part.trim());
        } else if !begun.is_empty() || line.starts_with("  pgs") {
            let line = std::mem::take(&mut begun) + line.trim();
            // Two blanks end the command, and a remark follows.
            let command = line.split("  ").next().unwrap_or_default().to_owned();
            let place = format!("pgs {} --help", verb.join(" "));
            examples.push(Example { place, command, need: need.clone() });
        }
    }
    examples
}

/// The commands of a page: in its blocks, and the code spans of its text that have arguments.
fn of_page(page: &str) -> Vec<Example> {
    let text = text(page);
    let example = |command: &str, need: Option<&str>| Example {
        place: page.to_owned(),
        command: command.split(" # ").next().unwrap_or_default().trim().to_owned(),
        need: need.map(str::to_owned),
    };
    let mut examples = Vec::new();
    for (kind, lines) in blocks(&text) {
        let (language, need) = kind.split_once(' ').map_or((kind, None), |(a, b)| (a, Some(b)));
        if language == "sh" {
            let lines = lines.join("\n").replace("\\\n", "");
            let commands = lines.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
            examples.extend(commands.map(|command| example(command, need)));
        }
    }
    let prose: String = text.split("\n```").step_by(2).collect();
    for span in prose.split('`').skip(1).step_by(2) {
        let span = span.split_whitespace().collect::<Vec<_>>().join(" ");
        let begins = |with: &&str| span.starts_with(*with);
        let runs = ["pgs ", "cargo ", "tools/scripts/", ".ci/run "].iter().any(begins);
        // `pgs check` names a verb, and `cargo run --release --` what stands for `pgs`.
        if runs && span.split(' ').count() > 2 && !span.ends_with(" --") {
            examples.push(example(&span, None));
        }
    }
    examples
}

/// The words of a command; a text in quotes is one word.
fn words(command: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = false;
    for letter in command.chars() {
        quoted ^= letter == '\'';
        match (letter == ' ' && !quoted, words.last_mut()) {
            (false, Some(word)) => word.push(letter),
            _ => words.push(String::new()),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Whether a reader has to put a word of his own in place of one: FILE, DIR, `socket:PATH`.
fn is_form(command: &str) -> bool {
    words(command).iter().any(|word| {
        let word = word.rsplit(['=', ':', '@']).next().unwrap_or_default();
        let name = word.split(['.', '|', '/', ',']).next().unwrap_or_default();
        !name.is_empty() && name.chars().all(|c| c.is_ascii_uppercase() || c == '_')
    })
}

/// A form's verb and options exist.
fn check_form(example: &Example, helps: &BTreeMap<Vec<String>, String>) {
    let words = words(&example.command);
    // `pgs generate` exists in the build of the packages.
    if words[0] != "pgs" || words[1] == "generate" {
        return;
    }
    let verb = words[1..].iter().take_while(|word| word.chars().all(|c| c.is_ascii_lowercase()));
    let mut verb: Vec<_> = verb.cloned().collect();
    while !helps.contains_key(&verb) {
        verb.pop();
    }
    assert!(!verb.is_empty() || words[1].starts_with('-'), "no such verb: {example}");
    for option in words.iter().filter(|word| word.starts_with("--")) {
        let option = option.split('=').next().unwrap_or_default();
        assert!(option == "--help" || helps[&verb].contains(option), "no {option}: {example}");
    }
}

/// The packages and benchmarks that a command of cargo names exist.
fn check_cargo(example: &Example) {
    let words = words(&example.command);
    let members = text("Cargo.toml");
    for pair in words.windows(2) {
        let found = match pair[0].as_str() {
            "-p" => {
                members.split('"').any(|member| {
                    let manifest = root().join(member).join("Cargo.toml");
                    fs::read_to_string(manifest)
                        .is_ok_and(|text| text.contains(&format!("\nname = \"{}\"", pair[1])))
                }) || members.contains(&format!("\nname = \"{}\"", pair[1]))
            }
            "--bench" => ["", "/main"].iter().any(|main| {
                root().join(format!("tools/bench/benches/{}{main}.rs", pair[1])).exists()
            }),
            _ => true,
        };
        assert!(found, "no {}: {example}", pair[1]);
    }
}

/// Gives a command an option, or this value to the one that it has.
fn with(words: &mut Vec<String>, option: &str, value: &str) {
    match words.iter().position(|word| word == option) {
        Some(at) => words[at + 1] = value.to_owned(),
        None => {
            let verbs = words.iter().skip(1).take_while(|word| {
                word.chars().all(|c| c.is_ascii_lowercase() || c == '-') && !word.starts_with('-')
            });
            let most = if words.get(1).is_some_and(|word| word == "thesis") { 2 } else { 1 };
            let at = 1 + verbs.count().min(most);
            words.splice(at..at, [option.to_owned(), value.to_owned()]);
        }
    }
}

/// The same command on a small scene; `None` for one that is long on any.
fn in_small(command: &str) -> Option<String> {
    let mut words = words(command);
    let verb = words.get(1).cloned().unwrap_or_default();
    let experiment = words.get(2).cloned().unwrap_or_default();
    let has = |words: &[String], option: &str| words.iter().any(|word| word == option);
    let small = words.iter().any(|word| {
        let sides: Vec<u32> = word.split('x').filter_map(|side| side.parse().ok()).collect();
        sides.len() == 3 && sides.iter().product::<u32>() <= 64
    });
    match (verb.as_str(), experiment.as_str()) {
        ("faults", _) if !has(&words, "--list") => return None,
        ("thesis", "--all") => return None,
        ("solve" | "list" | "check" | "faults" | "load" | "serve", _)
        | ("thesis", "" | "ladder" | "--help" | "detection" | "cycles" | "data" | "memory") => {}
        ("thesis", "warm" | "comparison" | "euler") => {}
        _ if has(&words, "--help") || has(&words, "--version") => {}
        ("thesis", "stopping") => {
            with(&mut words, "--passes", "16");
            if !has(&words, "--input") {
                with(&mut words, "--grid", "3x3x3");
            }
        }
        ("thesis", "time-step") => {
            with(&mut words, "--grid", "2x2x2");
            with(&mut words, "--seconds", "1");
        }
        _ if has(&words, "--input") || small => {}
        _ => with(&mut words, "--grid", "3x3x3"),
    }
    Some(words.join(" "))
}

/// The exit codes of a command that does what it is printed for.
fn codes(command: &str) -> &'static [i32] {
    match command {
        // In a small scene a beat may not be reached.
        _ if command.contains("--fault ") => &[0, 4],
        _ if command.contains("--quirk ") => &[1],
        _ => &[0],
    }
}

/// A shell for the command, in a folder like that of a clone.
fn shell(command: &str, folder: &Path) -> Command {
    let binaries = Path::new(env!("CARGO_BIN_EXE_pgs")).parent().expect("a folder");
    let path = std::env::var("PATH").unwrap_or_default();
    let limit = if IN_SMALL { "120" } else { "7200" };
    let mut shell = Command::new("timeout");
    let command = command.replace(SOCKET, "board");
    shell.args([limit, "sh", "-c", &format!("exec env {command}")]).current_dir(folder);
    shell.env("PATH", format!("{}:{path}", binaries.display())).env("PGS_BOARD", "auto");
    shell
}

/// A folder with the golden vectors, where a command may write.
fn like_a_clone() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a directory");
    symlink(root().join("tests"), folder.path().join("tests")).expect("the vectors");
    fs::create_dir(folder.path().join("docs")).expect("a folder");
    folder
}

fn run_one(example: &Example, command: &str, folder: &Path) {
    let ran: Ran = shell(command, folder).output().expect("it starts").into();
    let Ran { code, stdout, stderr } = &ran;
    let expected = codes(command);
    assert!(
        code.is_some_and(|code| expected.contains(&code)),
        "{example}\n{command}: expected {expected:?}, found {code:?}\n{stdout}{stderr}"
    );
}

/// Serves the board and runs the printed commands of its drivers.
fn serve(example: &Example, clients: &[&Example]) {
    let folder = like_a_clone();
    let mut server = shell(&example.command, folder.path());
    let mut server = Tied(server.stdout(Stdio::piped()).spawn().expect("it starts"));
    let mut lines = BufReader::new(server.0.stdout.as_mut().expect("a pipe")).lines();
    let serving = lines.any(|line| line.is_ok_and(|line| line.starts_with("serving ")));
    assert!(serving, "{example}");
    for client in clients {
        // The server's faults are the driver's, too.
        let fault = if example.command.contains("--fault ") { " # --fault " } else { "" };
        run_one(client, &(in_small(&client.command).expect("a run") + fault), folder.path());
    }
    signal("-TERM", server.0.id());
    let code = server.0.wait().expect("it ends").code();
    assert!([Some(0), Some(4)].contains(&code), "{example}: {code:?}");
}

#[test]
fn every_printed_command_runs_in_a_clone_or_names_its_need() {
    let helps = helps();
    let mut examples: Vec<_> = helps.iter().flat_map(|(verb, help)| of_help(verb, help)).collect();
    examples.extend(of_help(&[], &run(["-h"]).stdout));
    let in_help = examples.len();
    let mut pages = documents();
    pages.push("device-tree/README.md".to_owned());
    examples.extend(pages.iter().flat_map(|page| of_page(page)));
    assert!(in_help > 70 && examples.len() > in_help + 70, "{in_help} of {}", examples.len());

    let check = text(".ci/run");
    let (mut pgs, mut servers, mut clients, mut cargo) = (vec![], vec![], vec![], vec![]);
    for example in &mut examples {
        // `cargo run --release` at the root is the tool.
        if let Some(rest) = example.command.strip_prefix("cargo run --release -- ") {
            example.command = format!("pgs {rest}");
        }
    }
    for example in &examples {
        let Example { command, need, .. } = example;
        if let Some(need) = need {
            let known = NEEDS.contains(&need.as_str())
                || need
                    .strip_prefix("stage=")
                    .is_some_and(|stage| check.contains(&format!("\n\t[{stage}]=")))
                || ["on a board", "with the Verilog in simulation (docs/to-a-board.md)"]
                    .contains(&need.as_str());
            assert!(known, "no such need: {example}");
        } else if is_form(command) || command.starts_with("pgs load ") {
            // A clone has no bitstream to load.
            check_form(example, &helps);
        } else if command.contains("rtl:rtl-sim/") {
            // It names the simulator that it needs.
        } else if command.starts_with("pgs serve ") {
            servers.push(example);
        } else if command.contains(SOCKET) {
            clients.push(example);
        } else if command == "pgs" || command.starts_with("pgs ") {
            pgs.push(example);
        } else if check.contains(command.as_str()) {
            // A stage runs it.
        } else if command.contains("cargo ") {
            check_cargo(example);
            cargo.push(example);
        } else if command.starts_with("tools/scripts/") {
            let script = command.split(' ').next().unwrap_or_default();
            assert!(check.contains(script) && root().join(script).exists(), "no stage: {example}");
        } else {
            panic!("a command of no kind, and no need stands at its block: {example}");
        }
    }

    let found = [servers.len(), clients.len(), pgs.len(), cargo.len()];
    let least = [3, 1, 60, 8];
    assert!(found.iter().zip(least).all(|(found, least)| *found >= least), "{found:?}");
    // Several pages print one command, or one that is the same in small.
    let small = |example: &Example| match IN_SMALL {
        true => in_small(&example.command),
        false => Some(example.command.clone()),
    };
    let commands = pgs.into_iter().filter_map(|example| Some((small(example)?, example)));
    let left = Mutex::new(commands.collect::<BTreeMap<_, _>>().into_iter());
    std::thread::scope(|scope| {
        let work = || {
            while let Some((command, example)) = { left.lock().expect("no panic inside").next() } {
                run_one(example, &command, like_a_clone().path());
            }
        };
        for _ in 0..2 {
            scope.spawn(work);
        }
    });
    for server in servers {
        serve(server, &clients);
    }
    for example in cargo.into_iter().filter(|_| !IN_SMALL) {
        run_one(example, &example.command.replace(" --open", ""), &root());
    }
}
