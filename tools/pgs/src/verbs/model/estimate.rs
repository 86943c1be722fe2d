//! Each profile's estimate for programs.

use bitstream_model::estimate::thesis::recorded::Design;
use bitstream_model::estimate::{
    MemoryUse, OnChipArray, PortAccount, Records, StepCycles, StepTime, StreamDemand,
};
use bitstream_model::interface::profile::Variant;
use serde_json::{Value, json};

use super::scene::Scene;
use crate::options::bandwidth::bandwidth_number;

pub(super) fn profiles(scene: &Scene) -> Vec<Value> {
    scene.variants.iter().map(|variant| profile(scene, variant)).collect()
}

fn profile(scene: &Scene, variant: &Variant) -> Value {
    let step = &scene.step;
    let memory = MemoryUse::new(variant, step.bodies, step.collisions);
    let ports = PortAccount::new(variant);
    let demand = StreamDemand::new(variant);
    let packed = StepCycles::new(variant, Records::Packed, step);
    let thesis = Design::of(variant.profile).filter(|_| scene.is_thesis_step()).map(|design| {
        json!({
            "cycles": design.cycles,
            "deviation": packed.total as f64 / design.cycles as f64 - 1.0,
            "source": format!("thesis {}", design.results),
        })
    });
    json!({
        "profile": variant.profile.name,
        "clock_khz": variant.profile.clock_khz,
        "thesis_words": estimate(scene, variant, Records::Packed),
        "streamed_words": estimate(scene, variant, Records::Streamed),
        "thesis": thesis,
        "memory": {
            "velocities": memory.bytes_of(OnChipArray::Velocities),
            "impulses": memory.bytes_of(OnChipArray::Impulses),
            "world_inertia": memory.bytes_of(OnChipArray::Inertia),
            "shape_indices": memory.bytes_of(OnChipArray::ShapeIndices),
            "block_ram": memory.block_ram(),
            "with_positions": memory.with_positions(),
            "capacity": memory.capacity,
            "ideal_blocks": memory.ideal_blocks(),
            "shaped_blocks": memory.shaped_blocks(),
            "fits": memory.fits(),
            "collisions_that_fit": MemoryUse::collisions_beside(variant, step.bodies),
        },
        "initiation_interval": {
            "by_ports": ports.by_ports(),
            "by_streams": ports.by_streams,
            "claimed": ports.claimed,
            "collisions": variant.profile.collisions_per_issue,
        },
        "stream_bytes_per_second": demand.rate,
    })
}

fn estimate(scene: &Scene, variant: &Variant, records: Records) -> Value {
    let cycles = StepCycles::new(variant, records, &scene.step);
    let times: Vec<Value> = scene
        .bandwidths
        .iter()
        .map(|bandwidth| {
            let time = StepTime::new(variant, records, &scene.step, *bandwidth);
            json!({
                "bandwidth_bytes_per_second": bandwidth_number(*bandwidth),
                "ms": time.seconds * 1e3,
                "bytes": time.bytes,
                "load_limit": time.load.limit.name(),
                "limit": time.pass.limit.name(),
                "integration_limit": time.integration.limit.name(),
            })
        })
        .collect();
    json!({
        "cycles": {
            "total": cycles.total,
            "load": cycles.load,
            "pass": cycles.pass,
            "fill": cycles.fill,
            "pose_in": cycles.pose_in,
            "result_out": cycles.result_out,
            "integration_fill": cycles.integration_fill,
        },
        "times": times,
    })
}
