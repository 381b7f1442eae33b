//! Files and refusals. `python/tests/test_onnx.py` computes the graphs.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use controller_c::About;
use controller_onnx::{ExportError, export};
use experiment_file::ExperimentConfig;
use sim_core::Simulation;

fn exported(text: &str) -> Result<Vec<u8>, ExportError> {
    let (config, _) = ExperimentConfig::from_json(text, "", evolution::ALGORITHMS).unwrap();
    let simulation = Simulation::compile(&config).unwrap();
    let about = About {
        experiment: config.name.clone(),
        genotype: "a genotype".into(),
        config_digest: "none".into(),
    };
    export(&simulation, &vec![0.3; simulation.genotype_len()], &about)
}

#[test]
fn the_same_controller_is_the_same_file_and_names_its_stimuli() {
    let text = include_str!("../../../configs/quickstart.json");
    let file = exported(text).unwrap();
    assert_eq!(exported(text).unwrap(), file);
    for name in ["stimulus_message", "next_state", "led_probability", "config_digest"] {
        assert!(file.windows(name.len()).any(|part| part == name.as_bytes()), "{name}");
    }
}

#[test]
fn what_no_graph_can_express_is_refused_by_name() {
    let lif = include_str!("../../../configs/spiking/borderline_lif.json");
    assert_eq!(exported(lif), Err(ExportError::Spiking));
    let plastic = include_str!("../../../configs/spiking/leader_selection_lif_plastic.json");
    assert_eq!(exported(plastic), Err(ExportError::Plastic));
    // Few synapses in large matrices.
    let h1 = r#""H1": {"n": 10, "activation": "sigmoid"},"#;
    let quickstart = include_str!("../../../configs/quickstart.json");
    let wide =
        quickstart.replace(h1, &format!("{h1} {}", h1.replace("10", "5000").replace("H1", "IDLE")));
    assert_eq!(exported(&wide), Err(ExportError::TooLarge(5_029)));
}
