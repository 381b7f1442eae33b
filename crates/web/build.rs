//! Puts the simulator for browsers into the program, if there is one: `dist/build simulator` makes
//! it, and the variable `SWARMEVO_SIMULATOR` names its file.

use std::{env, fs, path::Path};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=SWARMEVO_SIMULATOR");
    let directory = env::var_os("OUT_DIR").expect("Cargo sets it");
    let content = match env::var_os("SWARMEVO_SIMULATOR").filter(|path| !path.is_empty()) {
        Some(path) => {
            println!("cargo::rerun-if-changed={}", path.display());
            fs::read(&path).unwrap_or_else(|error| {
                panic!("SWARMEVO_SIMULATOR={}: {error}", path.display());
            })
        }
        None => Vec::new(),
    };
    let to = Path::new(&directory).join("simulator.wasm.gz");
    fs::write(to, content).expect("Cargo's directory is writable");
}
