//! Steps at which a test can kill the coordinator, to check that nothing is lost. Builds without
//! debug assertions omit them.

/// The variable that arms a step: `kill STEP N` or `panic STEP N` ends the process at the N-th
/// passage.
#[cfg(debug_assertions)]
const VARIABLE: &str = "SWARM_FAILPOINT";

/// Marks a step; does nothing unless the variable arms it.
#[cfg(not(debug_assertions))]
pub fn reached(_step: &str) {}

/// Marks a step; does nothing unless the variable arms it.
#[cfg(debug_assertions)]
pub fn reached(step: &str) {
    use std::sync::{
        OnceLock,
        atomic::{AtomicU64, Ordering},
    };
    static ARMED: OnceLock<Option<Armed>> = OnceLock::new();
    static N_REACHED: AtomicU64 = AtomicU64::new(0);
    let armed = ARMED.get_or_init(|| Armed::parse(&std::env::var(VARIABLE).ok()?));
    let Some(armed) = armed.as_ref().filter(|armed| armed.step == step) else { return };
    if N_REACHED.fetch_add(1, Ordering::Relaxed) + 1 == armed.passage {
        tracing::error!(step, "a test ends the coordinator here");
        match armed.is_panic {
            true => panic!("failpoint {step}"),
            // No destructor runs and nothing is flushed, as if by SIGKILL.
            false => std::process::abort(),
        }
    }
}

#[cfg(debug_assertions)]
struct Armed {
    is_panic: bool,
    step: String,
    passage: u64,
}

#[cfg(debug_assertions)]
impl Armed {
    fn parse(text: &str) -> Option<Self> {
        let (action, rest) = text.split_once(' ')?;
        let (step, passage) = rest.rsplit_once(' ')?;
        let is_panic = action == "panic";
        Some(Self { is_panic, step: step.to_owned(), passage: passage.parse().ok()? })
    }
}
