//! This file takes a step again that failed, as often as it may be.

use crate::error::Error;
use crate::fault::Fault;

/// Attempts until one succeeds, at most `retries` times more than once and only while the board is
/// ready for it; what came of it, and how often it was taken again.
pub(super) fn with_retries<T>(
    retries: u32,
    mut attempt: impl FnMut() -> Result<T, Error>,
) -> Result<(T, u32), Error> {
    let mut again = 0;
    loop {
        match attempt() {
            Ok(done) => return Ok((done, again)),
            // What the caller has ended is not begun anew.
            Err(error) if error.may_retry() && !cancelled(&error) && again < retries => {
                again += 1;
                let name = error.fault().map_or("a fault", |fault| fault.name());
                log::info!("the step is taken again after {name} ({again} of {retries} times)");
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

    /// The result of attempts that end in turn like that, and how many there were.
    fn tried(retries: u32, ends: &[Option<Aftermath>]) -> (Result<u32, Error>, usize) {
        let mut attempts = 0;
        let result = with_retries(retries, || {
            attempts += 1;
            ends[attempts - 1].map_or(Ok(()), |aftermath| Err(fault(aftermath)))
        });
        (result.map(|((), again)| again), attempts)
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
