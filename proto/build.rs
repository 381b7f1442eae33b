//! Compiles the proto files with protox, so that no `protoc` is needed.

use std::{env, error::Error, fs, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    use prost::Message as _;

    let files = [
        "swarm/v1/evaluation.proto",
        "swarm/v1/experiment.proto",
        "swarm/v1/fleet.proto",
        "swarm/v1/worker.proto",
    ];
    for file in files {
        println!("cargo::rerun-if-changed={file}");
    }
    let descriptors = protox::compile(files, ["."])?;
    let out_dir = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out_dir.join("swarm.v1.bin"), descriptors.encode_to_vec())?;
    // Ordered maps, so that their debug output is the same on every run.
    tonic_prost_build::configure().btree_map(".").compile_fds(descriptors)?;
    Ok(())
}
