//! Rapier's scenes on Rapier's own solver and on the board, in one table.

mod board;
mod reduce;
mod scenes;
mod sets;
mod table;
mod twister;
mod world;

use std::process::ExitCode;

use scenes::{SCENES, Scene};
use table::Table;
use zynq_pgs::{Accelerator, BoardChoice, OpenOptions};

const USAGE: &str = "\
usage: rapier-client [SCENE...] [--board TEXT] [--list] [--help]

Runs scenes of Rapier on Rapier's own solver and on the board, and prints both.
Without a scene: all.

  --board TEXT   the board, as in docs/library.md (emulated:float,world)
  --list         the scenes

exit status: 0; 1 a limit does not hold, or a step failed; 2 wrong usage; 77 the board does not \
open,
nothing was run
";

/// The request of the command line.
enum Request {
    /// The text of a board, the board, and scenes.
    Run(String, Box<BoardChoice>, Vec<&'static Scene>),
    List,
    Help,
}

fn parsed(arguments: impl IntoIterator<Item = String>) -> Result<Request, String> {
    let (mut board, mut scenes) = ("emulated:float,world".to_owned(), Vec::new());
    let mut arguments = arguments.into_iter();
    while let Some(argument) = arguments.next() {
        match &*argument {
            "--help" => return Ok(Request::Help),
            "--list" => return Ok(Request::List),
            "--board" => board = arguments.next().ok_or("--board needs a value")?,
            name => {
                let scene = SCENES.iter().find(|scene| scene.name == name);
                scenes.push(scene.ok_or_else(|| format!("no scene or option {name}"))?);
            }
        }
    }
    let choice: BoardChoice = board.parse().map_err(|error| format!("--board {board}: {error}"))?;
    if scenes.is_empty() {
        scenes = SCENES.iter().collect();
    }
    Ok(Request::Run(board, Box::new(choice), scenes))
}

/// Runs scenes; whether all limits hold.
fn run(board: BoardChoice, scenes: &[&Scene]) -> Result<bool, zynq_pgs::Error> {
    let mut table = Table::new(board);
    for scene in scenes {
        table.begin(format!("{}: {}", scene.name, scene.title));
        (scene.run)(&mut table)?;
    }
    print!("{table}");
    Ok(table.holds())
}

fn main() -> ExitCode {
    let (board, choice, scenes) = match parsed(std::env::args().skip(1)) {
        Ok(Request::Run(board, choice, scenes)) => (board, choice, scenes),
        Ok(Request::List) => {
            SCENES.iter().for_each(|scene| println!("{:8} {}", scene.name, scene.title));
            return ExitCode::SUCCESS;
        }
        Ok(Request::Help) => {
            print!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        Err(text) => {
            eprintln!("rapier-client: {text}; --help says what is possible");
            return ExitCode::from(2);
        }
    };
    match Accelerator::open(OpenOptions { board: (*choice).clone(), ..OpenOptions::default() }) {
        Ok(_) => println!("Rapier {}; board {board}", rapier3d::VERSION),
        Err(error) => {
            eprintln!("rapier-client: skipped, no board: {}", chain(&error));
            return ExitCode::from(77);
        }
    }
    match run(*choice, &scenes) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("rapier-client: {}", chain(&error));
            ExitCode::FAILURE
        }
    }
}

/// An error and its causes.
fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    text
}
