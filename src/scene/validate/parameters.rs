//! This file refuses step parameters outside their range.

use crate::scene::{InputError, StepParameters};

/// What of the parameters themselves a step refuses.
pub(super) fn check_parameters(parameters: &StepParameters) -> Result<(), InputError> {
    let finite = |value: f32| value.is_finite();
    let not_negative = |value: f32| value.is_finite() && value >= 0.0;
    // Its reciprocal is computed, and that of a subnormal is infinite.
    let positive = |value: f32| value.is_normal() && value > 0.0;
    let [x, y, z] = parameters.gravity;
    let StepParameters { time_step, position_drift, position_coefficient, .. } = *parameters;
    let StepParameters { friction, angular_damping, .. } = *parameters;
    let share = (0.0..=1.0).contains(&angular_damping);
    let checks = [
        ("time step", time_step, positive(time_step), "a finite number of seconds above 0"),
        ("position drift", position_drift, finite(position_drift), "a finite number of metres"),
        (
            "position coefficient",
            position_coefficient,
            finite(position_coefficient),
            "a finite number",
        ),
        ("friction", friction, not_negative(friction), "a finite number of at least 0"),
        ("angular damping", angular_damping, share, "a number from 0 to 1"),
        ("gravity in x", x, finite(x), "a finite number of m/s²"),
        ("gravity in y", y, finite(y), "a finite number of m/s²"),
        ("gravity in z", z, finite(z), "a finite number of m/s²"),
    ];
    for (parameter, found, fits, expected) in checks {
        if !fits {
            return Err(InputError::Parameter { parameter, found, expected });
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
    use super::*;

    const NOT_FINITE: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];

    fn refuses(name: &str, values: &[f32], set: impl Fn(&mut StepParameters, f32)) {
        for value in values {
            let mut parameters = StepParameters::default();
            set(&mut parameters, *value);
            assert!(
                matches!(
                    check_parameters(&parameters),
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
            assert_eq!(check_parameters(&parameters), Ok(()), "{value}");
        }
    }

    #[test]
    fn the_defaults_are_accepted() {
        assert_eq!(check_parameters(&StepParameters::default()), Ok(()));
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
        accepts(&[-1.0, 0.0], |parameters, value| parameters.position_drift = value);
        accepts(&[-1.0, 2.0], |parameters, value| parameters.position_coefficient = value);
    }

    #[test]
    fn more_than_255_iterations_are_refused() {
        let mut parameters = StepParameters::default();
        (parameters.contact_iterations, parameters.friction_iterations) = (0, 255);
        assert_eq!(check_parameters(&parameters), Ok(()));
        parameters.friction_iterations = 256;
        let too_many = |solver, found| Err(InputError::TooManyIterations { solver, found });
        assert_eq!(check_parameters(&parameters), too_many("friction", 256));
        parameters.contact_iterations = u32::MAX;
        assert_eq!(check_parameters(&parameters), too_many("contact", u32::MAX));
    }
}
