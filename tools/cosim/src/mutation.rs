//! Seeded mistakes in the Verilog, to show that the co-simulation finds their kinds.

use rtlgen::emit::File;

/// A mistake: a text that stands once in a file, and the wrong text in its place.
#[derive(Debug, Clone, Copy)]
pub struct Mutation {
    /// A description of the mistake.
    pub name: &'static str,
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
        file: "contact.v",
        right: "delay #(.WIDTH(32), .SLOTS(36)) delay_linear_a_x_d36",
        wrong: "delay #(.WIDTH(32), .SLOTS(35)) delay_linear_a_x_d36",
    },
    Mutation {
        name: "an operand of the friction pipeline is bound to another value",
        file: "friction.v",
        right: "fmin_0_b = phase0_fmin_0 ? limit_product_d37 : limit_product_d1;",
        wrong: "fmin_0_b = phase0_fmin_0 ? limit_product_d1 : limit_product_d37;",
    },
    Mutation {
        name: "the gate of an unused contact point is lost",
        file: "core.v",
        right: "wire [3:0] used = {points > 3'd3,",
        wrong: "wire [3:0] used = {points > 3'd2,",
    },
    Mutation {
        name: "the hazard window is one slot short",
        file: "issue.v",
        right: "under_way[CONTACT_WINDOW/2-2]",
        wrong: "under_way[CONTACT_WINDOW/2-3]",
    },
    Mutation {
        name: "a static body keeps the velocity of its words",
        file: "loader.v",
        right: "(lookup_moves | kinematic) ? velocity_s2 : 192'd0",
        wrong: "(lookup_moves | 1'b1) ? velocity_s2 : 192'd0",
    },
    Mutation {
        name: "TLAST of the results comes one beat early",
        file: "sender.v",
        right: "row_is_last <= rows_left == 20'd2;",
        wrong: "row_is_last <= rows_left == 20'd3;",
    },
    Mutation {
        name: "the sum of the received words forgets a word",
        file: "word_sum.v",
        right: "low_s1   <= beat[31:0] + beat[63:32];",
        wrong: "low_s1   <= beat[31:0];",
    },
    Mutation {
        name: "the friction impulses do not start at 0",
        file: "impulses.v",
        right: "assign impulse1 = first_of_kind ? 32'd0 : inner[31:0];",
        wrong: "assign impulse1 = inner[31:0];",
    },
    Mutation {
        name: "the adder loses its sticky bit",
        file: "fadd.v",
        right: "lost_in_2s | lost_in_1;",
        wrong: "lost_in_2s | (lost_in_1 & shifted[1]);",
    },
    Mutation {
        name: "a body that moves and weighs nothing counts as static",
        file: "body_shapes.v",
        right: "inverse_mass[table_address] <= {|table_in[30:0], table_in};",
        wrong: "inverse_mass[table_address] <= {|table_in[30:23], table_in};",
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
        let files = emit::files(&Design::new(Parameters::default()));
        for mutation in MUTATIONS {
            assert!(mutation.apply(&files).is_some(), "{}", mutation.name);
        }
    }
}
