//! Runs `pgs` as a process: its peak memory, and its time beside that of an older one.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use bench::{median, milliseconds, ratio};
use serde_json::{Value, json};

use crate::{Options, Outcome};

/// Builds this repository's `pgs`; returns its path.
fn build() -> Result<PathBuf, Box<dyn Error>> {
    let cargo = bench::variable("CARGO").unwrap_or_else(|| "cargo".into());
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/../../Cargo.toml");
    let output = Command::new(cargo)
        .args(["build", "--release", "--locked", "-p", "pgs", "--message-format=json"])
        .args(["--manifest-path", manifest])
        .stderr(Stdio::inherit())
        .output()?;
    if !output.status.success() {
        return Err("pgs does not build".into());
    }
    let text = String::from_utf8(output.stdout)?;
    let messages = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let mut binaries = messages.filter_map(|m| m["executable"].as_str().map(PathBuf::from));
    binaries.next_back().ok_or_else(|| "cargo does not say where pgs is".into())
}

/// Peak memory of a run of the thesis' scene, beside the least that it must store.
pub(crate) fn memory(options: &Options) -> Outcome {
    let steps = options.run_steps.to_string();
    let output = Command::new(build()?)
        .args(["--json", "run", "--board", "emulated", "--order", "hazard-free", "--steps", &steps])
        .output()?;
    if !output.status.success() {
        return Err(format!("pgs run: {}", String::from_utf8_lossy(&output.stderr)).into());
    }
    let run: Value = serde_json::from_slice(&output.stdout)?;
    let memory = &run["memory"];
    let number = |name: &str| memory[name].as_u64().ok_or(format!("pgs run says no {name}"));
    let (peak, beats, scene) =
        (number("peak_bytes")?, number("beats_bytes")?, number("scene_bytes")?);
    let times = peak as f64 / (beats + scene) as f64;
    if !options.common.json {
        let mb = |bytes: u64| bytes as f64 / 1e6;
        println!("Peak memory of `pgs run`, {steps} steps of the thesis' scene");
        println!(
            "  {:.1} MB, {times:.2} times the beats of one step ({:.1} MB) and the scene ({:.1} MB)\n",
            mb(peak),
            mb(beats),
            mb(scene)
        );
    }
    Ok(json!({
        "steps": options.run_steps,
        "peak_bytes": peak,
        "beats_bytes": beats,
        "scene_bytes": scene,
        "times": times,
    }))
}

/// Time of one run, and its last line: the digest.
fn run(binary: &Path, steps: &str) -> Result<(Duration, String), Box<dyn Error>> {
    let begin = Instant::now();
    let output =
        Command::new(binary).args(["run", "--board", "emulated", "--steps", steps]).output()?;
    let time = begin.elapsed();
    let name = binary.display();
    if !output.status.success() {
        return Err(format!("{name}: {}", String::from_utf8_lossy(&output.stderr)).into());
    }
    let text = String::from_utf8(output.stdout)?;
    let digest = text.lines().find(|line| line.starts_with("digest"));
    Ok((time, digest.ok_or(format!("{name} prints no digest"))?.to_owned()))
}

/// Runs the thesis' scene with an older `pgs` and with this one, in turn.
pub(crate) fn old(options: &Options) -> Outcome {
    let old = options.old.as_ref().ok_or("--section old takes --old BINARY")?;
    let new = build()?;
    let steps = options.run_steps.to_string();
    let (mut old_times, mut new_times) = (Vec::new(), Vec::new());
    for _ in 0..options.common.runs() {
        let (old_time, old_digest) = run(old, &steps)?;
        let (new_time, new_digest) = run(&new, &steps)?;
        if old_digest != new_digest {
            return Err(format!("{old_digest} of the older one, {new_digest} of this one").into());
        }
        old_times.push(old_time);
        new_times.push(new_time);
    }
    let (old, new) = (median(old_times), median(new_times));
    let ratio = ratio(new, old);
    if !options.common.json {
        println!("`pgs run`, {steps} steps of the thesis' scene");
        println!(
            "  {:.0} ms, {ratio:.3} of the {:.0} ms of the older one\n",
            milliseconds(new),
            milliseconds(old)
        );
    }
    Ok(json!({
        "steps": options.run_steps,
        "old_ms": milliseconds(old),
        "new_ms": milliseconds(new),
        "new_by_old": ratio,
    }))
}
