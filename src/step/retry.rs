//! Repeats a step that failed, within the limit that the caller sets.

use crate::error::Error;
use crate::fault::Fault;

/// Calls `attempt` until it succeeds, with at most `retries` repetitions and only while the board
/// is ready for the next attempt. Returns the result and the number of repetitions.
pub(super) fn with_retries<T>(
    retries: u32,
    mut attempt: impl FnMut() -> Result<T, Error>,
) -> Result<(T, u32), Error> {
    let mut repeated = 0;
    loop {
        match attempt() {
            Ok(done) => return Ok((done, repeated)),
            // The driver does not repeat a step that the caller has cancelled.
            Err(error) if error.may_retry() && !cancelled(&error) && repeated < retries => {
                repeated += 1;
                let name = error.fault().map_or("a fault", |fault| fault.name());
                log::info!("repeating the step after {name} ({repeated} of {retries} times)");
            }
            Err(error) => return Err(error),
        }
    }
}

fn cancelled(error: &Error) -> bool {
    matches!(error.fault(), Some(Fault::Cancelled))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Aftermath;

    fn fault(aftermath: Aftermath) -> Error {
        let fault = Box::new(Fault::Gone { region: "a test".to_owned() });
        Error::Step { fault, aftermath, diagnosis: None }
    }

    /// The result of attempts that end as `ends` lists, and the number of attempts.
    fn tried(retries: u32, ends: &[Option<Aftermath>]) -> (Result<u32, Error>, usize) {
        let mut attempts = 0;
        let result = with_retries(retries, || {
            attempts += 1;
            ends[attempts - 1].map_or(Ok(()), |aftermath| Err(fault(aftermath)))
        });
        (result.map(|((), repeated)| repeated), attempts)
    }

    #[test]
    fn a_step_is_taken_again_as_often_as_it_may_be() {
        let ready = Some(Aftermath::Ready);
        assert!(matches!(tried(0, &[None]), (Ok(0), 1)));
        assert!(matches!(tried(0, &[ready, None]), (Err(_), 1)));
        assert!(matches!(tried(2, &[ready, ready, None]), (Ok(2), 3)));
        assert!(matches!(tried(2, &[ready, ready, ready, None]), (Err(_), 3)));
    }

    #[test]
    fn what_fails_in_the_same_way_or_needs_another_opening_is_not_taken_again() {
        for aftermath in [Aftermath::Untouched, Aftermath::MustReopen] {
            let (result, attempts) = tried(5, &[Some(aftermath), None]);
            assert!(result.is_err() && attempts == 1, "{aftermath:?}");
        }
    }

    #[test]
    fn what_was_cancelled_is_not_taken_again() {
        let mut attempts = 0;
        let cancelled = with_retries(5, || {
            attempts += 1;
            let (fault, aftermath) = (Box::new(Fault::Cancelled), Aftermath::Ready);
            Err::<(), _>(Error::Step { fault, aftermath, diagnosis: None })
        });
        assert!(cancelled.is_err() && attempts == 1);
    }
}
