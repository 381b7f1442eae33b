//! Checks of free memory before an allocation: a failed allocation would end the interpreter.

use std::fs;

use pyo3::{exceptions::PyMemoryError, prelude::*};

/// Raises `MemoryError` if so many bytes do not fit. `what`: the object that needs them.
#[pyfunction(name = "ensure_memory")]
#[expect(clippy::needless_pass_by_value, reason = "numbers from Python")]
pub fn ensure_memory(bytes: u128, what: String) -> PyResult<()> {
    ensure(bytes, &what)
}

/// Like `ensure_memory`.
pub fn ensure(bytes: u128, what: &str) -> PyResult<()> {
    let free = free();
    let fits = free.is_none_or(|free| bytes <= free);
    if fits && isize::try_from(bytes).is_ok_and(|bytes| can_be_reserved(bytes.unsigned_abs())) {
        return Ok(());
    }
    let free = free.map_or_else(String::new, |free| format!(", and {} are free", gigabytes(free)));
    Err(PyMemoryError::new_err(format!("{what} would take about {}{free}", gigabytes(bytes))))
}

fn can_be_reserved(bytes: usize) -> bool {
    Vec::<u8>::new().try_reserve_exact(bytes).is_ok()
}

/// Bytes that this process may still allocate, if the system tells.
fn free() -> Option<u128> {
    [of_machine(), of_container()].into_iter().flatten().min()
}

fn of_machine() -> Option<u128> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: u128 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes << 10)
}

/// Bytes that the limit of a container leaves (control groups, version 2).
fn of_container() -> Option<u128> {
    let number = |name: &str| -> Option<u128> {
        fs::read_to_string(format!("/sys/fs/cgroup/{name}")).ok()?.trim().parse().ok()
    };
    Some(number("memory.max")?.saturating_sub(number("memory.current")?))
}

fn gigabytes(bytes: u128) -> String {
    format!("{:.1} GB", bytes as f64 / 1e9)
}
