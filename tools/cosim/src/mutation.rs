//! Seeded mistakes in the Verilog, to show that the co-simulation finds their kinds.

use pgs_interface::profile::Inertia;
use rtlgen::emit::File;

/// A mistake: a text that stands once in a file, and the wrong text in its place.
#[derive(Debug, Clone, Copy)]
pub struct Mutation {
    /// A description of the mistake.
    pub name: &'static str,
    /// The build that it is planted in.
    pub inertia: Inertia,
    /// The file of the generated folder.
    pub file: &'static str,
    /// The text as it should be.
    pub right: &'static str,
    /// The text as it is in the mutant.
    pub wrong: &'static str,
}

/// The mutations, of generated and of hand-written Verilog.
pub const MUTATIONS: &[Mutation] = &[
    Mutation {
        name: "a delay of the contact pipeline is one slot short",
        inertia: Inertia::Isotropic,
        file: "pgs_solver.v",
        right: "pgs_delay #(.WIDTH(32), .SLOTS(33)) delay_linear_a_x_d33",
        wrong: "pgs_delay #(.WIDTH(32), .SLOTS(32)) delay_linear_a_x_d33",
    },
    Mutation {
        name: "an operand of the friction pipeline is bound to another value",
        inertia: Inertia::Isotropic,
        file: "pgs_solver.v",
        right: "? friction_limit_product_d37 : friction_limit_product_d1;",
        wrong: "? friction_limit_product_d1 : friction_limit_product_d37;",
    },
    Mutation {
        name: "an adder of the pool works for the contact pipeline in friction passes, too",
        inertia: Inertia::Isotropic,
        file: "pgs_solver.v",
        right: "wire [31:0] fadd_24_b = friction_fadd_24 ?",
        wrong: "wire [31:0] fadd_24_b = 1'b0 ?",
    },
    Mutation {
        name: "an adder of the pool stays with the passes in the integration",
        inertia: Inertia::Isotropic,
        file: "pgs_solver.v",
        right: "always @(posedge clk) integrating_fadd_60 <=",
        wrong: "always @(posedge clk) integrating_fadd_60 <= 1'b0 &",
    },
    Mutation {
        name: "the gate of an unused contact point is lost",
        inertia: Inertia::Isotropic,
        file: "pgs_core.v",
        right: "wire [3:0] used = {points > 3'd3,",
        wrong: "wire [3:0] used = {points > 3'd2,",
    },
    Mutation {
        name: "the hazard window is one slot short",
        inertia: Inertia::Isotropic,
        file: "pgs_issue.v",
        right: "under_way[CONTACT_WINDOW/2-2]",
        wrong: "under_way[CONTACT_WINDOW/2-3]",
    },
    Mutation {
        name: "a static body keeps the velocity of its words",
        inertia: Inertia::Isotropic,
        file: "pgs_loader.v",
        right: "(lookup_moves | kinematic) ? velocity_s2 : 192'd0",
        wrong: "(lookup_moves | 1'b1) ? velocity_s2 : 192'd0",
    },
    Mutation {
        name: "TLAST of the results comes one beat early",
        inertia: Inertia::Isotropic,
        file: "pgs_sender.v",
        right: "row_is_last <= rows_left == 20'd2;",
        wrong: "row_is_last <= rows_left == 20'd3;",
    },
    Mutation {
        name: "the sum of the received words forgets a word",
        inertia: Inertia::Isotropic,
        file: "pgs_word_sum.v",
        right: "low_s1   <= beat[31:0] + beat[63:32];",
        wrong: "low_s1   <= beat[31:0];",
    },
    Mutation {
        name: "the friction impulses do not start at 0",
        inertia: Inertia::Isotropic,
        file: "pgs_impulses.v",
        right: "assign impulse1 = all_are_zero ? 32'd0 : inner[31:0];",
        wrong: "assign impulse1 = inner[31:0];",
    },
    Mutation {
        name: "the adder loses its sticky bit",
        inertia: Inertia::Isotropic,
        file: "pgs_fadd.v",
        right: "lost_in_2s | lost_in_1;",
        wrong: "lost_in_2s | (lost_in_1 & shifted[1]);",
    },
    Mutation {
        name: "a body that moves and weighs nothing counts as static",
        inertia: Inertia::Isotropic,
        file: "pgs_body_shapes.v",
        right: "inverse_mass[table_address] <= {|table_in[30:0], table_in};",
        wrong: "inverse_mass[table_address] <= {|table_in[30:23], table_in};",
    },
    Mutation {
        name: "each collision has the friction of the step",
        inertia: Inertia::Isotropic,
        file: "pgs_core.v",
        right: "<= pair_friction ? own_friction : friction_coefficient;",
        wrong: "<= friction_coefficient;",
    },
    Mutation {
        name: "the spin damping is no argument",
        inertia: Inertia::Isotropic,
        file: "pgs_core.v",
        right: ".spin_damping(spin_damping),\n    .point0",
        wrong: ".spin_damping(32'h3dcccccd),\n    .point0",
    },
    Mutation {
        name: "a warm pass reads 0 for the given impulses",
        inertia: Inertia::Isotropic,
        file: "pgs_impulses.v",
        right: "wire all_are_zero  = first_of_kind & ~warm;",
        wrong: "wire all_are_zero  = first_of_kind;",
    },
    Mutation {
        name: "a warm contact pass applies no impulse that pulls",
        inertia: Inertia::Isotropic,
        file: "pgs_fmax_or.v",
        right: "~condition ? c :",
        wrong: "~condition ? (c[31] ? 32'd0 : c) :",
    },
    Mutation {
        name: "a warm friction pass solves its second impulse",
        inertia: Inertia::Isotropic,
        file: "pgs_fmin_or.v",
        right: "~condition ? c :",
        wrong: "(~condition & c[0]) ? c :",
    },
    Mutation {
        name: "a warm pass takes the given impulse from itself",
        inertia: Inertia::Isotropic,
        file: "pgs_solver.v",
        right: "(solves ? {~impulse3_d123[31], impulse3_d123[30:0]} : 32'h80000000)",
        wrong: "{~impulse3_d123[31], impulse3_d123[30:0]}",
    },
    Mutation {
        name: "a warm friction pass damps the spin",
        inertia: Inertia::Isotropic,
        file: "pgs_flogic_and.v",
        right: "y <= a & b;",
        wrong: "y <= a;",
    },
    Mutation {
        name: "the friction impulses change places as they leave",
        inertia: Inertia::Isotropic,
        file: "pgs_core.v",
        right: "impulse_row   <= friction ? {64'd0, solved_impulses[95:32]} :",
        wrong: "impulse_row   <= friction ? \
                {64'd0, solved_impulses[63:32], solved_impulses[95:64]} :",
    },
    Mutation {
        name: "the impulses leave after every pass",
        inertia: Inertia::Isotropic,
        file: "pgs_step_sequence.v",
        right: "next_sends <= impulses_out & next_is_last;",
        wrong: "next_sends <= impulses_out;",
    },
    Mutation {
        name: "a collision enters its last pass without room for its impulses",
        inertia: Inertia::Isotropic,
        file: "pgs_core.v",
        right: ".streams_ready(beats_there & (room[0] | ~next_sends))",
        wrong: ".streams_ready(beats_there)",
    },
    Mutation {
        name: "a collision enters a warm pass without its impulses",
        inertia: Inertia::Isotropic,
        file: "pgs_core.v",
        right: "(next_warm ? count[3] >= beats_needed : there[3])",
        wrong: "there[3]",
    },
    Mutation {
        name: "every pass on stream 3 is as long as a warm one",
        inertia: Inertia::Isotropic,
        file: "pgs_receiver.v",
        right: "begin_packet(next_segment, next_is_warm);",
        wrong: "begin_packet(next_segment, warm_start);",
    },
    Mutation {
        name: "the oldest collision of the queue lets every other one go first",
        inertia: Inertia::Isotropic,
        file: "pgs_queue.v",
        right: "{1'b0, free} :",
        wrong: "{1'b0, free & ~(oldest & {DEPTH{|(free & ~oldest)}})} :",
    },
    Mutation {
        name: "the queue takes the place of a collision from the one behind it alone",
        inertia: Inertia::Isotropic,
        file: "pgs_queue.v",
        right: "from_pick <= from_first[DEPTH-1:0];",
        wrong: "from_pick <= first_of[DEPTH-1:0];",
    },
    Mutation {
        name: "the queue counts the hazards of collisions that pass the oldest one",
        inertia: Inertia::Isotropic,
        file: "pgs_queue.v",
        right: "meets_hazard <= oldest_goes & held_before",
        wrong: "meets_hazard <= issues & held_before",
    },
    Mutation {
        name: "a collision that comes into the queue misses an issue that is not written",
        inertia: Inertia::Isotropic,
        file: "pgs_queue_hazard.v",
        right: "last_a = early_has_a ? early_use : body_has_a ?",
        wrong: "last_a = early_has_a ? early_use : 1'b0 ?",
    },
    Mutation {
        name: "a collision that comes into the queue misses the issue in the same slot",
        inertia: Inertia::Isotropic,
        file: "pgs_queue_hazard.v",
        right: "(moves_b_s4 & last_has_b)",
        wrong: "(moves_b_s4 & 1'b0)",
    },
    Mutation {
        name: "the patience of the queue ends a slot early",
        inertia: Inertia::Isotropic,
        file: "pgs_queue.v",
        right: "(patience == PATIENCE[10:0] - 11'd1)",
        wrong: "(patience == PATIENCE[10:0] - 11'd2)",
    },
    Mutation {
        name: "the patience of the queue ends a slot late",
        inertia: Inertia::Isotropic,
        file: "pgs_queue.v",
        right: "(patience == PATIENCE[10:0] - 11'd1)",
        wrong: "(patience == PATIENCE[10:0])",
    },
    Mutation {
        name: "a collision that waits in the queue is free a slot early",
        inertia: Inertia::Isotropic,
        file: "pgs_queue.v",
        right: "& (free_at == slot_after);",
        wrong: "& (free_at == slot_after + 8'd1);",
    },
    Mutation {
        name: "the last beat of numbers keeps words of the one before",
        inertia: Inertia::Isotropic,
        file: "pgs_issue_numbers.v",
        right: "{96'd0, word}",
        wrong: "{beat[127:32], word}",
    },
    Mutation {
        name: "a beat of numbers takes no credit",
        inertia: Inertia::Isotropic,
        file: "pgs_core.v",
        right: "((issues & sends) | numbers_follow)",
        wrong: "(issues & sends)",
    },
    Mutation {
        name: "the queue takes collisions of the pass behind the next one",
        inertia: Inertia::Isotropic,
        file: "pgs_finder.v",
        right: "queued ? has_slot & ~pass_taken :",
        wrong: "queued ? has_slot :",
    },
    Mutation {
        name: "two products of inertia change places",
        inertia: Inertia::World,
        file: "pgs_solver.v",
        right: "inverse_inertia_a_xz = inverse_inertia_a[159:128];",
        wrong: "inverse_inertia_a_xz = inverse_inertia_a[191:160];",
    },
    Mutation {
        name: "the passes give body B the inertia of body A",
        inertia: Inertia::World,
        file: "pgs_core.v",
        right: ".inverse_inertia_b(mass_b[PROPERTIES-1:32]),\n    .linear_a",
        wrong: ".inverse_inertia_b(mass_a[PROPERTIES-1:32]),\n    .linear_a",
    },
    Mutation {
        name: "a product of inertia comes a slot early in the friction pipeline",
        inertia: Inertia::World,
        file: "pgs_solver.v",
        right: "pgs_delay #(.WIDTH(32), .SLOTS(34)) delay_inverse_inertia_a_yz_d49",
        wrong: "pgs_delay #(.WIDTH(32), .SLOTS(33)) delay_inverse_inertia_a_yz_d49",
    },
    Mutation {
        name: "a body that brings no mass has that of its shape",
        inertia: Inertia::World,
        file: "pgs_world_bodies.v",
        right: "streamed_masses ? {",
        wrong: "(streamed_masses & |diagonal[126:96]) ? {",
    },
    Mutation {
        name: "a streamed mass of subnormal size counts as none",
        inertia: Inertia::World,
        file: "pgs_world_bodies.v",
        right: "? {|diagonal[126:96], diagonal[127:96]}",
        wrong: "? {|diagonal[126:119], diagonal[127:96]}",
    },
    Mutation {
        name: "a body that brings its mass needs a shape of the table",
        inertia: Inertia::World,
        file: "pgs_loader.v",
        right: "write_s1 & beyond_s1 & names_shape;",
        wrong: "write_s1 & beyond_s1;",
    },
    Mutation {
        name: "one body with world inertia has the beats of an isotropic one",
        inertia: Inertia::World,
        file: "pgs_receiver.v",
        right: "(of == VELOCITIES) ? velocities_one :",
        wrong: "(of == VELOCITIES) ? poses_one :",
    },
    Mutation {
        name: "the load with world inertia does not wait for the last row",
        inertia: Inertia::World,
        file: "pgs_bodies.v",
        right: ".there(&there), .linear",
        wrong: ".there(&there[2:0]), .linear",
    },
];

impl Mutation {
    /// The files with the mistake; nothing if the right text does not stand in its file once.
    #[must_use]
    pub fn apply(&self, files: &[File]) -> Option<Vec<File>> {
        let mut files = files.to_vec();
        let file = files.iter_mut().find(|file| file.name == self.file)?;
        if file.text.matches(self.right).count() != 1 {
            return None;
        }
        file.text = file.text.replace(self.right, self.wrong);
        Some(files)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rtlgen::design::{Design, Parameters};
    use rtlgen::emit;

    #[test]
    fn every_mutation_has_its_place() {
        let [isotropic, world] = [Inertia::Isotropic, Inertia::World]
            .map(|inertia| emit::files(&Design::new(Parameters::with(inertia))));
        for mutation in MUTATIONS {
            let files = match mutation.inertia {
                Inertia::Isotropic => &isotropic,
                Inertia::World => &world,
            };
            assert!(mutation.apply(files).is_some(), "{}", mutation.name);
        }
    }
}
