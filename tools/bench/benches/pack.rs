//! prototype
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command")]
use std::hint::black_box;
use std::path::PathBuf;

use bench::{Run, medians};
use bitstream_model::interface::profile::{FLOAT, HALF, MIXED, Profile};
use bitstream_model::interface::record::Beat;
use zynq_pgs::bench::CollisionPacker;
use zynq_pgs::order::{InputBuffers, IssueWindow, Order, Ordered, Orderer};
use zynq_pgs::StepParameters;

fn main() {
    let root = std::env::var_os("PGS_VECTORS").map(PathBuf::from).unwrap();
    let folder = step_folder::folder::Folder::load(&root.join("full_step186")).unwrap();
    let (bodies, collisions, shapes) = (&folder.bodies, &folder.collisions, &folder.shapes);
    let mut buffers = InputBuffers::new();
    let mut orderer = Orderer::new();
    buffers.gather(bodies, collisions, shapes);
    let emulated = bitstream_model::EmulatedBoard::new(bitstream_model::BoardConfig::default()).unwrap();
    let accelerator = zynq_pgs::Accelerator::open(zynq_pgs::OpenOptions { board: zynq_pgs::BoardChoice::Emulated(emulated.cpu_port()), ..Default::default() }).unwrap();
    let window = IssueWindow::of(accelerator.capabilities(), &StepParameters::default()).unwrap();
    let schedule = orderer.order(&buffers.input(), Order::HazardFree, window).unwrap().clone();
    let ordered = Ordered { collisions, schedule: &schedule };
    let profiles: [&'static Profile; 3] = [&FLOAT, &HALF, &MIXED];
    let per = [112, 56, 48];
    let n = collisions.len();
    let source: Vec<Vec<Beat>> = per.iter().map(|b| vec![Beat([1; 4]); n * b / 16]).collect();
    let mut target: Vec<Vec<Beat>> = per.iter().map(|b| vec![Beat([2; 4]); n * b / 16]).collect();
    let mut given: Vec<_> = profiles.iter().map(|p| CollisionPacker::new(p.default_variant())).collect();
    let mut permuted: Vec<_> = profiles.iter().map(|p| CollisionPacker::new(p.default_variant())).collect();
    if let Some(which) = std::env::args().nth(1).filter(|a| !a.starts_with("--")) {
        let runs: usize = std::env::args().nth(2).unwrap().parse().unwrap();
        let profile = match &which[1..] { "h" => &HALF, "m" => &MIXED, _ => &FLOAT };
        let mut p = CollisionPacker::new(profile.default_variant());
        for _ in 0..runs { black_box(match &which[..1] { "g" => p.pack(bodies, collisions, shapes), _ => p.pack(bodies, &ordered, shapes) }); }
        return;
    }
    let mut contestants: Vec<Run<'_>> = Vec::new();
    for ((s, t), (g, p)) in source.iter().zip(&mut target).zip(given.iter_mut().zip(&mut permuted)) {
        contestants.push(Box::new(move || { t.copy_from_slice(s); black_box(&t); }));
        contestants.push(Box::new(move || { black_box(g.pack(bodies, collisions, shapes)); }));
        let ordered = &ordered;
        contestants.push(Box::new(move || { black_box(p.pack(bodies, ordered, shapes)); }));
    }
    medians(1, &mut contestants);
    for _ in 0..3 {
    let times = medians(15, &mut contestants);
    for (t, (p, per)) in times.chunks(3).zip(profiles.iter().zip(per)) {
        let ms = |i: usize| t[i].as_secs_f64() * 1e3;
        println!("{:6} memcpy {:.3} ms {:.2} GB/s  given {:.3} {:.2}  ordered {:.3} {:.2}", p.name, ms(0), (n * per) as f64 / ms(0) / 1e6, ms(1), ms(0)/ms(1), ms(2), ms(0)/ms(2));
    }
    }
}
