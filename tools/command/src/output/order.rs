//! Reports the order in which a step's collisions were sent, and the reason for it.

use serde_json::{Value, json};
use zynq_pgs::order::Order;
use zynq_pgs::report::OrderChoice;
use zynq_pgs::{Capabilities, StepReport};

use crate::numbers::grouped;
use crate::options::ordering::{is_sequential, name};

/// How the order of a step relates to Bullet's, in words; none if the order is Bullet's and the
/// comparison fails all the same.
pub fn beside_bullet(report: &StepReport, capabilities: &Capabilities) -> Option<&'static str> {
    match report.order {
        Order::AsGiven if is_sequential(capabilities) && !report.queued => {
            Some("Bullet's own, to compare with it")
        }
        Order::AsGiven if !report.queued => None,
        _ => Some("not Bullet's: results differ by the order alone"),
    }
}

/// The order of a step, and the reason for it.
pub fn with_reason(report: &StepReport) -> String {
    let name = name(report.order);
    match reason(report) {
        Some(reason) => format!("{name}: {reason}"),
        None => name,
    }
}

/// Why the driver took this order; none if the caller asked for it.
pub fn reason(report: &StepReport) -> Option<String> {
    let OrderChoice::Cheapest(costs) = report.order_choice else {
        return match report.order_choice {
            OrderChoice::Queue => Some("this board's issue queue keeps hazards apart".to_owned()),
            OrderChoice::NoInterlock => Some("this board does not wait on hazards".to_owned()),
            _ => None,
        };
    };
    let as_given = grouped(costs.as_given);
    Some(match costs.reordered.map(|cycles| (grouped(cycles), cycles < costs.as_given)) {
        Some((reordered, true)) => format!(
            "this board waits on hazards; the passes take {reordered} cycles, as given they \
             take more than {as_given}"
        ),
        Some((reordered, false)) => format!(
            "this board waits on hazards; the passes take {as_given} cycles, {reordered} without \
             hazards"
        ),
        None => format!("no order takes fewer cycles for the passes than {as_given}"),
    })
}

/// The order of a step in words.
pub fn text(report: &StepReport) -> String {
    let mut text = name(report.order);
    if report.empty > 0 {
        let share = report.empty as f64 / (report.collisions as f64).max(1.0);
        text += &format!(", {} empty entries ({:.2} %)", grouped(report.empty), share * 100.0);
    }
    if report.verified {
        text += ", verified: no hazards";
    }
    text
}

/// The same for programs.
pub fn to_json(report: &StepReport) -> Value {
    json!({
        "name": name(report.order),
        "choice": choice_json(&report.order_choice),
        "empty": report.empty,
        "queued": report.queued,
        "verified": report.verified,
    })
}

/// Why the driver took this order, for programs.
fn choice_json(choice: &OrderChoice) -> Value {
    let name = match choice {
        OrderChoice::Asked => "asked",
        OrderChoice::Queue => "queue",
        OrderChoice::NoInterlock => "no_interlock",
        OrderChoice::Cheapest(_) => "cheapest",
        _ => "other",
    };
    match choice {
        OrderChoice::Cheapest(costs) => json!({
            "reason": name,
            "as_given_cycles": costs.as_given,
            "reordered_cycles": costs.reordered,
        }),
        _ => json!({ "reason": name }),
    }
}
