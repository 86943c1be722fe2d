//! Pipelines on one pool of units, as a Verilog module.
//!
//! Every value has the name of its node, behind the name of its pipeline. The unit that computes it
//! drives it in one cycle of each interval. A value that is read later goes through a chain of
//! delays, and `name_d3` is the value 3 intervals later. A chain belongs to an input, or to a phase
//! of a unit: contact and friction passes never run together, so that they share it.
//!
//! The module knows the phase from its port `phase`, one bit a phase, and the pipeline that runs
//! from a port each, such as `friction`, which change where no record is under way. Each
//! unit, and each input that waits, has copies of its own, because no single register could drive
//! all of them.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use pgs_interface::number::Precision;

use crate::design::Pipeline;
use crate::graph::{Input, Kind, NodeId, Operand, Output};
use crate::number;
use crate::pool::{self, Unit};

use super::nets::{Net, Value, nets, slots, taps};
use super::text::{Text, line};

/// Copies that follow the same register.
const LEAVES_PER_COPY: usize = 12;
/// The ports that select the second pipeline of a module and the third.
const SELECTORS: [&str; 2] = ["friction", "integrating"];

/// The Verilog of the module.
pub(super) fn module(pipelines: &[&Pipeline; 3], smallest_normal: bool) -> String {
    let units = pool::units(pipelines);
    let emitter = Emitter {
        precision: pipelines[0].graph.precision(),
        pipelines,
        smallest_normal,
        nets: nets(pipelines, &units),
        taps: taps(pipelines),
        copies: RefCell::default(),
    };
    // The body asks for the copies that it needs.
    let mut body = Text::default();
    emitter.inputs(&mut body);
    for unit in &units {
        emitter.results(&mut body, unit);
    }
    emitter.delays(&mut body);
    for unit in &units {
        emitter.unit(&mut body, unit);
    }
    emitter.outputs(&mut body);
    let mut text = Text::default();
    emitter.head(&mut text);
    emitter.copies(&mut text);
    format!("{}{}endmodule\n\n`default_nettype wire\n", text.into_string(), body.into_string())
}

/// `[31:0] ` of 32 bits; nothing of one.
fn range(width: u32) -> String {
    if width == 1 { String::new() } else { format!("[{}:0] ", width - 1) }
}

struct Emitter<'a> {
    /// Of all numbers.
    precision: Precision,
    pipelines: &'a [&'a Pipeline; 3],
    smallest_normal: bool,
    /// For each pipeline, by node.
    nets: Vec<Vec<Net>>,
    /// For each value the numbers of intervals after which it is read.
    taps: BTreeMap<Value, BTreeSet<i32>>,
    /// The copies that are needed: their sources, and the units and inputs that they belong to.
    copies: RefCell<BTreeSet<(Source, String)>>,
}

/// The port that a copy follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Source {
    Phase(usize),
    Selector(&'static str),
}

impl Emitter<'_> {
    /// The phases of the passes.
    fn phases(&self) -> usize {
        let intervals = self.pipelines.iter().map(|pipeline| pipeline.schedule.interval);
        usize::try_from(intervals.max().unwrap_or(1)).unwrap_or(1)
    }

    /// Width of a value on the nets: two numbers that an operator gives together are two nets.
    fn width(&self, pipeline: usize, node: NodeId) -> u32 {
        self.pipelines[pipeline].graph.width(node)
    }

    /// Width of a number.
    fn number(&self) -> u32 {
        number::width(self.precision)
    }

    /// The copy of a phase, or of the selector, that belongs to a unit or an input.
    fn copy(&self, source: Source, owner: &str) -> String {
        self.copies.borrow_mut().insert((source, owner.into()));
        match source {
            Source::Phase(phase) => format!("phase{phase}_{owner}"),
            Source::Selector(selector) => format!("{selector}_{owner}"),
        }
    }

    /// The name of a value as it comes.
    fn name(&self, (pipeline, node, upper): Value) -> String {
        let Pipeline { name, graph, .. } = self.pipelines[pipeline];
        let node = graph.node(node);
        let prefix = match node.kind {
            Kind::Operation(_) => format!("{name}_"),
            _ => String::new(),
        };
        format!("{prefix}{}{}", node.name, if upper { "_upper" } else { "" })
    }

    /// The net that carries a value at `cycle`.
    fn net(&self, value: Value, cycle: i32) -> String {
        let (pipeline, node, _) = value;
        let name = self.name(value);
        if self.pipelines[pipeline].graph.node(node).kind.is_still() {
            return name;
        }
        match slots(self.pipelines[pipeline], node, cycle) {
            0 => name,
            slots => format!("{name}_d{slots}"),
        }
    }

    /// The expression of a read at `cycle`.
    fn read(&self, pipeline: usize, operand: &Operand, cycle: i32) -> String {
        let (width, top) = (self.number(), self.number() - 1);
        let sign = 1 << top;
        let digits = (width / 4) as usize;
        let constant = |bits: u32| format!("{width}'h{bits:0digits$x}");
        let graph = &self.pipelines[pipeline].graph;
        if let Kind::Constant(bits) = graph.node(operand.node).kind {
            return constant(if operand.negated { bits ^ sign } else { bits });
        }
        let net = self.net((pipeline, operand.node, operand.upper), cycle);
        let value = match operand.negated {
            true => format!("{{~{net}[{top}], {net}[{}:0]}}", top - 1),
            false => net,
        };
        match operand.gate {
            Some(gate) => {
                let gate = self.net((pipeline, gate, false), cycle);
                format!("({gate} ? {value} : {})", constant(sign))
            }
            None => value,
        }
    }

    /// The input ports: the ones of the first pipeline, then the ones that only the others have.
    fn input_ports(&self) -> Vec<(usize, &Input)> {
        let mut ports: Vec<(usize, &Input)> = Vec::new();
        for (pipeline, Pipeline { graph, .. }) in self.pipelines.iter().enumerate() {
            for input in graph.inputs() {
                if ports.iter().all(|(_, port)| port.name != input.name) {
                    ports.push((pipeline, input));
                }
            }
        }
        ports
    }

    /// The output ports, and the pipelines that give each of them.
    fn output_ports(&self) -> Vec<Vec<(usize, &Output)>> {
        let mut ports: Vec<Vec<(usize, &Output)>> = Vec::new();
        for (pipeline, Pipeline { graph, .. }) in self.pipelines.iter().enumerate() {
            for output in graph.outputs() {
                match ports.iter_mut().find(|port| port[0].1.name == output.name) {
                    Some(port) => port.push((pipeline, output)),
                    None => ports.push(vec![(pipeline, output)]),
                }
            }
        }
        ports
    }

    fn head(&self, text: &mut Text) {
        line!(text, "// Generated by rtlgen; changes belong into the equations.");
        for Pipeline { name, schedule, .. } in self.pipelines {
            line!(text, "//");
            line!(
                text,
                "// {name}: a record every {} cycles, {} cycles from record to results,",
                schedule.interval,
                schedule.depth
            );
            line!(
                text,
                "// velocities at cycle {}, impulses at cycle {}.",
                schedule.velocities_at,
                schedule.impulses_at
            );
        }
        line!(text, "`default_nettype none\n");
        line!(text, "module pgs_solver (\n  input wire clk,");
        line!(text, "  input wire [{}:0] phase,", self.phases() - 1);
        for selector in SELECTORS {
            line!(text, "  input wire {selector},");
        }
        for (pipeline, input) in self.input_ports() {
            let width = input.nodes.iter().map(|node| self.width(pipeline, *node)).sum();
            line!(text, "  input wire {}{},", range(width), input.name);
        }
        let outputs: Vec<String> = self
            .output_ports()
            .iter()
            .map(|port| {
                let (pipeline, output) = port[0];
                let widths = output.operands.iter().map(|read| self.width(pipeline, read.node));
                format!("  output wire {}out_{}", range(widths.sum()), output.name)
            })
            .collect();
        line!(text, "{}\n);", outputs.join(",\n"));
    }

    /// The copies of the phases and of the selector, in two levels of registers. A copy of a phase
    /// follows the phase before its own, so that it is not late.
    fn copies(&self, text: &mut Text) {
        let before = |phase: usize| (phase + self.phases() - 1) % self.phases();
        let register = |text: &mut Text, name: &str, follows: &str| {
            line!(text, "  (* keep = \"true\" *) reg {name};");
            line!(text, "  always @(posedge clk) {name} <= {follows};");
        };
        let copies = self.copies.borrow();
        let sources: BTreeSet<Source> = copies.iter().map(|copy| copy.0).collect();
        for source in sources {
            let owners: Vec<&String> =
                copies.iter().filter(|copy| copy.0 == source).map(|copy| &copy.1).collect();
            let (name, follows) = match source {
                Source::Phase(phase) => {
                    (format!("phase{phase}"), format!("phase[{}]", before(before(phase))))
                }
                Source::Selector(selector) => (selector.to_owned(), selector.to_owned()),
            };
            for (group, owners) in owners.chunks(LEAVES_PER_COPY).enumerate() {
                let trunk = format!("{name}_group{group}");
                line!(text);
                register(text, &trunk, &follows);
                for owner in owners {
                    register(text, &format!("{name}_{owner}"), &trunk);
                }
            }
        }
    }

    fn inputs(&self, text: &mut Text) {
        line!(text);
        for (pipeline, input) in self.input_ports() {
            if let [_] = input.nodes[..] {
                continue;
            }
            let width = self.number();
            for (part, node) in (0..).zip(&input.nodes) {
                let (low, high) = (width * part, width * (part + 1) - 1);
                let name = self.name((pipeline, *node, false));
                line!(text, "  wire {}{name} = {}[{high}:{low}];", range(width), input.name);
            }
        }
        // Tools warn of an input that nothing reads.
        let mut read = BTreeSet::new();
        for Pipeline { graph, .. } in self.pipelines {
            let inputs = graph.inputs().iter().zip(graph.inputs_read());
            read.extend(inputs.filter(|(_, read)| *read).map(|(input, _)| &input.name));
        }
        for (_, Input { name, .. }) in self.input_ports() {
            if !read.contains(name) {
                line!(text, "  wire unused_{name} = &{{1'b0, {name}}};");
            }
        }
    }

    /// The values that a node gives: whether each is the upper one of two.
    fn parts(&self, pipeline: usize, node: NodeId) -> &'static [bool] {
        let is_pair = self.pipelines[pipeline].graph.node(node).kind.is_pair();
        if is_pair { &[false, true] } else { &[false] }
    }

    /// The result of a unit, and the names of the values that it is.
    fn results(&self, text: &mut Text, unit: &Unit) {
        let name = unit.name(self.precision);
        let Some(first) = unit.uses.first() else { return };
        let width = self.width(first.pipeline, first.node);
        let parts = self.parts(first.pipeline, first.node);
        line!(text, "  wire {}{name}_y;", range(if parts.len() > 1 { 2 * width } else { width }));
        for used in &unit.uses {
            for part in parts {
                let value = (used.pipeline, used.node, *part);
                if self.taps.get(&value).is_some_and(|taps| taps.contains(&0)) {
                    let result = self.result(&name, value);
                    line!(text, "  wire {}{} = {result};", range(width), self.name(value));
                }
            }
        }
    }

    /// A chain of delays behind each net whose values wait, and the name of each value in it.
    fn delays(&self, text: &mut Text) {
        let taps = &self.taps;
        let mut chains = BTreeMap::<(&Net, bool), Vec<Value>>::new();
        for (value, taps) in taps {
            if taps.iter().any(|tap| *tap > 0) {
                let net = &self.nets[value.0][value.1.index()];
                chains.entry((net, value.2)).or_default().push(*value);
            }
        }
        for ((net, upper), values) in chains {
            let (pipeline, node, _) = values[0];
            let width = self.width(pipeline, node);
            let upper_name = if upper { "_upper" } else { "" };
            let (base, mut source) = if net.is_input {
                (net.driver.clone(), net.driver.clone())
            } else {
                let phase = match net.interval {
                    1 => String::new(),
                    _ => format!("_phase{}", net.phase),
                };
                let base = format!("{}{upper_name}{phase}", net.driver);
                (base, self.result(&net.driver, values[0]))
            };
            let enable = match net.interval {
                1 => "1'b1".into(),
                _ if width == 1 && net.is_input => self.copy(Source::Phase(net.phase), "flags"),
                _ => self.copy(Source::Phase(net.phase), &net.driver),
            };
            let all: BTreeSet<i32> =
                values.iter().flat_map(|value| &taps[value]).copied().collect();
            let mut from = 0;
            line!(text);
            for tap in all.into_iter().filter(|tap| *tap > 0) {
                let target = format!("{base}_d{tap}");
                line!(text, "  wire {}{target};", range(width));
                line!(
                    text,
                    "  pgs_delay #(.WIDTH({width}), .SLOTS({})) delay_{target} (.clk(clk), \
                     .enable({enable}), .d({source}), .q({target}));",
                    tap - from,
                );
                (from, source) = (tap, target);
            }
            for value in values.into_iter().filter(|_| !net.is_input) {
                let name = self.name(value);
                for tap in taps[&value].iter().filter(|tap| **tap > 0) {
                    line!(text, "  wire {}{name}_d{tap} = {base}_d{tap};", range(width));
                }
            }
        }
    }

    fn unit(&self, text: &mut Text, unit: &Unit) {
        let operator = unit.operation.operator(self.precision);
        let name = unit.name(self.precision);
        line!(text);
        let mut ports = vec![".clk(clk)".to_owned()];
        for (port, port_name) in operator.ports.iter().enumerate() {
            let mut width = self.number();
            let mut of_pipelines: Vec<(usize, String)> = Vec::new();
            for (pipeline, Pipeline { graph, schedule, .. }) in self.pipelines.iter().enumerate() {
                let reads = unit.of(pipeline).map(|used| {
                    let operand = &graph.node(used.node).operands[port];
                    width = self.width(pipeline, operand.node);
                    let cycle = schedule.starts[used.node.index()];
                    (used.phase, self.read(pipeline, operand, cycle))
                });
                let reads: Vec<_> = reads.collect();
                of_pipelines.extend(self.by_phase(&name, &reads).map(|read| (pipeline, read)));
            }
            let read = self.by_pipeline(&name, &of_pipelines);
            line!(text, "  wire {}{name}_{port_name} = {read};", range(width));
            ports.push(format!(".{port_name}({name}_{port_name})"));
        }
        let parameters = match operator.set_width {
            Some(width) => format!("#(.WIDTH({width})) "),
            None if operator.smallest_normal && !self.smallest_normal => {
                "#(.SMALLEST_NORMAL(0)) ".into()
            }
            None => String::new(),
        };
        line!(
            text,
            "  pgs_{} {parameters}{name} ({}, .y({name}_y));",
            operator.module,
            ports.join(", ")
        );
    }

    fn outputs(&self, text: &mut Text) {
        line!(text);
        for port in self.output_ports() {
            let name = &port[0].1.name;
            let values = port.iter().map(|(pipeline, output)| {
                let depth = self.pipelines[*pipeline].schedule.depth;
                let reads = output.operands.iter().rev();
                let reads: Vec<String> =
                    reads.map(|operand| self.read(*pipeline, operand, depth)).collect();
                (*pipeline, format!("{{{}}}", reads.join(", ")))
            });
            let values: Vec<(usize, String)> = values.collect();
            line!(text, "  assign out_{name} = {};", self.by_pipeline("outputs", &values));
        }
    }

    /// The expression that chooses the read of the current phase; none without a read.
    fn by_phase(&self, unit: &str, reads: &[(usize, String)]) -> Option<String> {
        let ((_, last), rest) = reads.split_last()?;
        let mut expression = last.clone();
        for (phase, read) in rest.iter().rev() {
            if *read != expression {
                let phase = self.copy(Source::Phase(*phase), unit);
                expression = format!("{phase} ? {read} : {expression}");
            }
        }
        Some(expression)
    }

    /// The expression that chooses the read of the current pipeline.
    fn by_pipeline(&self, owner: &str, reads: &[(usize, String)]) -> String {
        let Some(((_, first), rest)) = reads.split_first() else { return "0".into() };
        rest.iter().fold(first.clone(), |others, (pipeline, read)| {
            if *read == others {
                return others;
            }
            let selector = self.copy(Source::Selector(SELECTORS[pipeline - 1]), owner);
            format!("{selector} ? ({read}) : ({others})")
        })
    }

    /// The result of a unit that a value is, or the part of it.
    fn result(&self, unit: &str, (pipeline, node, upper): Value) -> String {
        let width = self.number();
        match (self.parts(pipeline, node).len(), upper) {
            (1, _) => format!("{unit}_y"),
            (_, false) => format!("{unit}_y[{}:0]", width - 1),
            (_, true) => format!("{unit}_y[{}:{width}]", 2 * width - 1),
        }
    }
}
