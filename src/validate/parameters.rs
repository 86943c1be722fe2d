//! Refuses step parameters outside their range.

use pgs_interface::number::StreamFormat;
use pgs_interface::profile::Variant;

use super::range::{SMALLEST_SHORT, computes_short};
use super::{Excess, InputError, InputItem, Limits, OutOfRange, SceneNeeds};
use crate::scene::StepParameters;

const TIME_STEP: &str = "time step";

/// Checks the step parameters against their ranges, and against the bitstream's arithmetic.
pub(crate) fn check_parameters(
    parameters: &StepParameters,
    needs: &SceneNeeds,
    limits: &Limits,
) -> Result<(), InputError> {
    let finite = |value: f32| value.is_finite();
    let not_negative = |value: f32| value.is_finite() && value >= 0.0;
    // The accelerator computes its reciprocal, which is infinite for a subnormal number.
    let positive = |value: f32| value.is_normal() && value > 0.0;
    let [x, y, z] = parameters.gravity;
    let StepParameters { time_step, position_drift, position_coefficient, .. } = *parameters;
    let StepParameters { friction, angular_damping, spin_damping, .. } = *parameters;
    let share = |value: f32| (0.0..=1.0).contains(&value);
    let checks = [
        (
            TIME_STEP,
            time_step,
            positive(time_step),
            "a finite number of seconds, at least 1.1754944e-38",
        ),
        ("position drift", position_drift, finite(position_drift), "a finite number of metres"),
        (
            "position coefficient",
            position_coefficient,
            finite(position_coefficient),
            "a finite number",
        ),
        ("friction", friction, not_negative(friction), "a finite number of at least 0"),
        ("angular damping", angular_damping, share(angular_damping), "a number from 0 to 1"),
        ("spin damping", spin_damping, share(spin_damping), "a number from 0 to 1"),
        ("gravity in x", x, finite(x), "a finite number of m/s²"),
        ("gravity in y", y, finite(y), "a finite number of m/s²"),
        ("gravity in z", z, finite(z), "a finite number of m/s²"),
    ];
    for (parameter, found, fits, expected) in checks {
        if !fits {
            return Err(InputError::Parameter { parameter, found, expected });
        }
    }
    if parameters.pair_friction && !limits.variant.has_pair_friction() {
        let excess = Excess::NotInRecords { asked: "a friction for each collision" };
        return Err(needs.refuse(excess, &Variant::has_pair_friction));
    }
    if computes_short(&limits.variant.numbers) {
        let (format, component) = (StreamFormat::Binary16, 0);
        let largest = format.largest();
        for (field, found, ..) in checks {
            let (zero, smallest) = match field {
                // Its reciprocal must fit, too.
                TIME_STEP => (false, 1.0 / largest),
                _ => (true, SMALLEST_SHORT),
            };
            let fits = (smallest..=largest).contains(&found.abs()) || (zero && found == 0.0);
            if !fits {
                let item = InputItem::Parameters { zero };
                let number =
                    OutOfRange { item, field, component, found, format, smallest, largest };
                let holds = |variant: &Variant| !computes_short(&variant.numbers);
                return Err(needs.refuse(Excess::OutOfRange(number), &holds));
            }
        }
    }
    for (solver, found) in
        [("contact", parameters.contact_iterations), ("friction", parameters.friction_iterations)]
    {
        if found > InputError::MAX_ITERATIONS {
            return Err(InputError::TooManyIterations { solver, found });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{FLOAT, HALF, NEEDS};
    use super::*;

    fn checked(parameters: &StepParameters) -> Result<(), InputError> {
        check_parameters(parameters, &NEEDS, &FLOAT)
    }

    const NOT_FINITE: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];

    fn refuses(name: &str, values: &[f32], set: impl Fn(&mut StepParameters, f32)) {
        for value in values {
            let mut parameters = StepParameters::default();
            set(&mut parameters, *value);
            assert!(
                matches!(
                    checked(&parameters),
                    Err(InputError::Parameter { parameter, found, .. })
                        if parameter == name && found.to_bits() == value.to_bits()
                ),
                "{name} {value}"
            );
        }
    }

    fn accepts(values: &[f32], set: impl Fn(&mut StepParameters, f32)) {
        for value in values {
            let mut parameters = StepParameters::default();
            set(&mut parameters, *value);
            assert_eq!(checked(&parameters), Ok(()), "{value}");
        }
    }

    #[test]
    fn the_refusal_of_a_time_step_names_the_smallest() {
        let refused = |time_step| {
            let parameters = StepParameters { time_step, ..StepParameters::default() };
            checked(&parameters).map_err(|error| error.to_string())
        };
        let smallest = format!("{:e}", f32::MIN_POSITIVE);
        for time_step in [0.0, 1e-38, -1.0] {
            let error = refused(time_step).expect_err("too small");
            assert!(error.contains(&format!("at least {smallest}")), "{error}");
        }
        assert_eq!(refused(f32::MIN_POSITIVE), Ok(()));
    }

    #[test]
    fn the_defaults_are_accepted() {
        assert_eq!(checked(&StepParameters::default()), Ok(()));
    }

    #[test]
    fn parameters_that_are_not_finite_are_refused() {
        refuses("time step", &NOT_FINITE, |parameters, value| parameters.time_step = value);
        refuses("position drift", &NOT_FINITE, |parameters, value| {
            parameters.position_drift = value;
        });
        refuses("position coefficient", &NOT_FINITE, |parameters, value| {
            parameters.position_coefficient = value;
        });
        refuses("friction", &NOT_FINITE, |parameters, value| parameters.friction = value);
        refuses("angular damping", &NOT_FINITE, |parameters, value| {
            parameters.angular_damping = value;
        });
        refuses("spin damping", &NOT_FINITE, |parameters, value| parameters.spin_damping = value);
        refuses("gravity in x", &NOT_FINITE, |parameters, value| parameters.gravity[0] = value);
        refuses("gravity in y", &NOT_FINITE, |parameters, value| parameters.gravity[1] = value);
        refuses("gravity in z", &NOT_FINITE, |parameters, value| parameters.gravity[2] = value);
    }

    #[test]
    fn parameters_outside_their_range_are_refused() {
        let subnormal = 1e-40;
        refuses("time step", &[0.0, -0.0, -1.0, subnormal], |parameters, value| {
            parameters.time_step = value;
        });
        refuses("friction", &[-0.5], |parameters, value| parameters.friction = value);
        refuses("angular damping", &[-0.1, 1.000_000_1], |parameters, value| {
            parameters.angular_damping = value;
        });
    }

    #[test]
    fn the_ends_of_the_ranges_are_accepted() {
        accepts(&[f32::MIN_POSITIVE, 1.0], |parameters, value| parameters.time_step = value);
        accepts(&[0.0, 5.0], |parameters, value| parameters.friction = value);
        accepts(&[0.0, 1.0], |parameters, value| parameters.angular_damping = value);
        accepts(&[0.0, 1.0], |parameters, value| parameters.spin_damping = value);
        accepts(&[-1.0, 0.0], |parameters, value| parameters.position_drift = value);
        accepts(&[-1.0, 2.0], |parameters, value| parameters.position_coefficient = value);
    }

    #[test]
    fn more_than_255_iterations_are_refused() {
        let mut parameters = StepParameters::default();
        (parameters.contact_iterations, parameters.friction_iterations) = (0, 255);
        assert_eq!(checked(&parameters), Ok(()));
        parameters.friction_iterations = 256;
        let too_many = |solver, found| Err(InputError::TooManyIterations { solver, found });
        assert_eq!(checked(&parameters), too_many("friction", 256));
        parameters.contact_iterations = u32::MAX;
        assert_eq!(checked(&parameters), too_many("contact", u32::MAX));
    }
    #[test]
    fn what_binary16_does_not_hold_is_refused_where_it_computes() {
        let mut parameters = StepParameters::default();
        let check = |parameters: &StepParameters, limits: &Limits| {
            check_parameters(parameters, &NEEDS, limits).map_err(|error| error.to_string())
        };
        assert_eq!(check(&parameters, &HALF), Ok(()));
        parameters.gravity[2] = -7e4;
        assert_eq!(check(&parameters, &FLOAT), Ok(()));
        assert_eq!(
            check(&parameters, &HALF),
            Err("the gravity in z is -7e4, but this bitstream computes in binary16, which takes \
                 0, or 5.9604645e-8 to 65504: correct the step parameters, or load another \
                 (profiles that could: naive, float)"
                .to_owned())
        );
        // The reciprocal of 10 us is 100,000.
        let time = |time_step| StepParameters { time_step, ..StepParameters::default() };
        let text = check(&time(1e-5), &HALF).expect_err("its reciprocal overflows");
        assert!(text.contains("time step is 1e-5") && text.contains("takes 1.5266"), "{text}");
        assert_eq!(check(&time(5e-5), &HALF), Ok(()));
        assert_eq!(check(&time(1e-5), &FLOAT), Ok(()));
    }

    #[test]
    fn what_binary16_would_take_for_zero_is_refused_where_it_computes() {
        type Set = fn(&mut StepParameters, f32);
        let sets: [(&str, Set); 6] = [
            ("position drift", |parameters, value| parameters.position_drift = -value),
            ("position coefficient", |parameters, value| parameters.position_coefficient = value),
            ("friction", |parameters, value| parameters.friction = value),
            ("angular damping", |parameters, value| parameters.angular_damping = value),
            ("spin damping", |parameters, value| parameters.spin_damping = value),
            ("gravity in y", |parameters, value| parameters.gravity[1] = -value),
        ];
        let smallest = 2.0_f32.powi(-24);
        for (name, set) in sets {
            let check = |value, limits| {
                let mut parameters = StepParameters::default();
                set(&mut parameters, value);
                check_parameters(&parameters, &NEEDS, limits).map_err(|error| error.to_string())
            };
            assert_eq!(check(0.0, &HALF), Ok(()), "{name}");
            assert_eq!(check(smallest, &HALF), Ok(()), "{name}");
            let text = check(smallest.next_down(), &HALF).expect_err(name);
            assert!(text.contains(name), "{text}");
            assert!(text.contains(&format!("takes 0, or {smallest:e} to 65504")), "{text}");
            assert_eq!(check(1e-30, &FLOAT), Ok(()), "{name}");
        }
    }
}
