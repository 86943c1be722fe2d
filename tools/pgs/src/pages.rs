//! Writes the manual pages and the completions of packages: `pgs generate --out DIR`.
//!
//! The verb exists with the feature `pages` alone, and is no part of [`crate::cli`]: pages and
//! completions describe the `pgs` that a package holds, which has no such verb.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Command, Parser};
use clap_complete::Shell;
use clap_mangen::Man;

use crate::cli;
use pgs_command::failure::{Failure, report_usage};

/// The first argument that asks for the pages.
const VERB: &str = "generate";
/// The section of commands in the manual.
const SECTION: &str = "1";

/// Write the manual pages and the completions of pgs for a package.
#[derive(Debug, Parser)]
#[command(name = "pgs generate", after_help = "Example:\n  pgs generate --out target/pages")]
struct GenerateArgs {
    /// Folder for the pages (in `man`) and the completions (in `bash`, `zsh` and `fish`).
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Writes the pages if the command line asks for them; otherwise returns nothing.
pub(crate) fn generate_if_asked() -> Option<ExitCode> {
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next()? != VERB {
        return None;
    }
    let parsed = GenerateArgs::try_parse_from(std::iter::once(VERB.into()).chain(arguments));
    Some(match parsed {
        Err(message) => report_usage(&message),
        Ok(GenerateArgs { out }) => match generate(&out) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => Failure::input(error)
                .next(format!(
                    "name a folder with --out that may be written to; {} may not",
                    out.display()
                ))
                .report(&mut anstream::stderr().lock()),
        },
    })
}

/// The command line that pages and completions describe. A page of `help` would say nothing.
fn described() -> Command {
    let mut command = cli::definition().disable_help_subcommand(true);
    command.build();
    command
}

/// Writes every page and every completion below `out`.
fn generate(out: &Path) -> io::Result<()> {
    let mut command = described();
    let folder = out.join("man");
    fs::create_dir_all(&folder)?;
    for (name, page) in pages(&command)? {
        fs::write(folder.join(name), page)?;
    }
    for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
        let folder = out.join(shell.to_string());
        fs::create_dir_all(&folder)?;
        clap_complete::generate_to(shell, &mut command, "pgs", folder)?;
    }
    Ok(())
}

/// The pages of a command and of its verbs, each with its file's name.
fn pages(command: &Command) -> io::Result<Vec<(String, Vec<u8>)>> {
    let verbs = || command.get_subcommands().filter(|verb| !verb.is_hide_set());
    let names: Vec<_> = verbs().map(page_name).collect();
    let mut pages = vec![page(command, &names)?];
    for verb in verbs() {
        pages.push(page(verb, &[page_name(command)])?);
    }
    Ok(pages)
}

/// The name of a command's page: `pgs-run`.
fn page_name(command: &Command) -> String {
    command.get_display_name().unwrap_or(command.get_name()).to_owned()
}

/// The page of one command, which refers to other pages.
fn page(command: &Command, others: &[String]) -> io::Result<(String, Vec<u8>)> {
    let source = format!("zynq-pgs {}", env!("CARGO_PKG_VERSION"));
    let man = Man::new(command.clone()).section(SECTION).source(source).manual("zynq-pgs");
    let mut page = Vec::new();
    man.render_title(&mut page)?;
    man.render_name_section(&mut page)?;
    man.render_synopsis_section(&mut page)?;
    man.render_description_section(&mut page)?;
    man.render_options_section(&mut page)?;
    if command.has_subcommands() {
        man.render_subcommands_section(&mut page)?;
    }
    if let Some(text) = command.get_after_long_help().or_else(|| command.get_after_help()) {
        page.extend(roff(&text.to_string()).into_bytes());
    }
    let others: Vec<_> =
        others.iter().map(|name| format!("\\fB{}\\fR({SECTION})", escaped(name))).collect();
    writeln!(page, ".SH \"SEE ALSO\"\n{}", others.join(", "))?;
    Ok((man.get_filename(), page))
}

/// The text below a command's help as roff: a section of its examples, then one of notes. Indented
/// lines keep their breaks, other lines are filled.
fn roff(text: &str) -> String {
    let mut roff = String::new();
    let mut kept = false;
    let mut in_examples = false;
    for line in text.lines() {
        let indented = line.starts_with(' ');
        if kept && !indented && !line.is_empty() {
            roff.push_str(".fi\n");
            kept = false;
        }
        if let Some(heading) = examples(line) {
            if !std::mem::replace(&mut in_examples, true) {
                roff.push_str(".SH EXAMPLES\n");
            }
            if !heading.is_empty() {
                roff.push_str(&format!(".SS {}\n", escaped(heading)));
            }
        } else if line.is_empty() {
            roff.push_str(if kept { "\n" } else { ".PP\n" });
        } else {
            if !indented && std::mem::take(&mut in_examples) {
                roff.push_str(".SH NOTES\n");
            }
            if indented && !kept {
                roff.push_str(".nf\n");
                kept = true;
            }
            roff.push_str(&escaped(line));
            roff.push('\n');
        }
    }
    if kept {
        roff.push_str(".fi\n");
    }
    roff
}

/// The place that a heading of examples names: none where they run anywhere.
fn examples(line: &str) -> Option<&str> {
    line.strip_prefix("Examples")?.strip_suffix(':').map(str::trim)
}

/// A line that roff takes for text, with hyphens that can be copied to a shell.
fn escaped(line: &str) -> String {
    let guard = if line.starts_with(['.', '\'']) { "\\&" } else { "" };
    let text = line.replace('\\', "\\e").replace('-', "\\-").replace('\'', "\\(aq");
    format!("{guard}{text}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_verb_has_a_page_with_an_example() {
        let command = described();
        let pages = pages(&command).expect("pages");
        let verbs: Vec<_> = command.get_subcommands().map(page_name).collect();
        for verb in ["pgs-run", "pgs-serve"] {
            assert!(verbs.iter().any(|name| name == verb), "{verbs:?}");
        }
        assert_eq!(pages.len(), verbs.len() + 1);
        for (name, page) in pages {
            let page = String::from_utf8(page).expect("text");
            let (_, examples) = page.split_once(".SH EXAMPLES\n").expect(&name);
            assert!(
                examples.lines().take(3).any(|line| line.starts_with("  pgs")),
                "{name}: {page}"
            );
            let verb = format!("pgs\\-{VERB}");
            assert!(!page.contains(&verb), "{name} names a verb that no package has");
        }
    }

    #[test]
    fn indented_lines_keep_their_breaks() {
        assert_eq!(
            roff("Examples:\n  pgs -a\n  pgs b\n\n.text\nmore"),
            ".SH EXAMPLES\n.nf\n  pgs \\-a\n  pgs b\n\n.fi\n.SH NOTES\n\\&.text\nmore\n"
        );
        assert_eq!(
            roff("Examples:\n  pgs a\n\nExamples on a board:\n  pgs b\n"),
            ".SH EXAMPLES\n.nf\n  pgs a\n\n.fi\n.SS on a board\n.nf\n  pgs b\n.fi\n"
        );
    }

    #[test]
    fn pages_and_completions_are_written() {
        let folder = tempfile::tempdir().expect("a folder");
        generate(folder.path()).expect("written");
        for (file, option) in [
            ("man/pgs.1", "\\-\\-board"),
            ("man/pgs-serve.1", "\\-\\-socket"),
            ("bash/pgs.bash", "--socket"),
            ("zsh/_pgs", "--socket"),
            ("fish/pgs.fish", "-l socket"),
        ] {
            let text = fs::read_to_string(folder.path().join(file)).expect(file);
            assert!(text.contains(option), "{file}: {option}");
        }
    }
}
