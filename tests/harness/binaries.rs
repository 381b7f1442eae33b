//! The programs under test, built like the test itself.

use std::{
    env,
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
};

/// Path of a program of the workspace: `coordinator`, `worker` or `swarmctl`.
///
/// Cargo builds programs only for the tests of their own package, so the first call builds them
/// all, into the directory and profile of the running test. The build also names a test. This gives
/// libraries the same features as in `cargo test --workspace`, so that Cargo does not compile them
/// a second time.
///
/// `SWARM_PROGRAMS` names a directory of built programs, so that a benchmark can compare two
/// versions in turns.
pub fn binary(name: &str) -> PathBuf {
    static DIRECTORY: OnceLock<PathBuf> = OnceLock::new();
    let directory =
        DIRECTORY.get_or_init(|| env::var_os("SWARM_PROGRAMS").map_or_else(build, PathBuf::from));
    directory.join(name)
}

fn build() -> PathBuf {
    // target/PROFILE/deps/TEST
    let test = env::current_exe().expect("a running test has a path");
    let directory = test.parent().and_then(Path::parent).expect("cargo's layout").to_owned();
    let profile = match directory.file_name().and_then(|name| name.to_str()) {
        Some("debug") | None => "dev",
        Some(profile) => profile,
    };
    let cargo = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut build = Command::new(cargo);
    // Removes Cargo's variables about the test's package. They would make build scripts of
    // dependencies, such as ring's, run again, and recompile half of the workspace.
    for (name, _) in env::vars_os() {
        let text = name.to_string_lossy();
        if text.starts_with("CARGO_PKG_") || text.starts_with("CARGO_MANIFEST_") {
            build.env_remove(&name);
        }
    }
    let status = build
        .args(["build", "--quiet", "--workspace", "--bins", "--test", "documents"])
        .args(["--profile", profile, "--target-dir"])
        .arg(directory.parent().expect("cargo's layout"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .status()
        .expect("cargo runs");
    assert!(status.success(), "the programs under test must build");
    directory
}
