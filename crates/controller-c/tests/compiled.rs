//! Compiles controllers with the C compiler of this machine, and compares every bit with recorded
//! episodes.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use controller_c::{About, Controller, Episodes, ExportError, LEN_MAX};
use experiment_file::{ExperimentConfig, ScriptConfig, inline_script, script_path};
use serde_json::{Value, json};
use sim_core::{Simulation, TrialSet};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A shipped experiment, with its script.
fn shipped(name: &str) -> ExperimentConfig {
    let path = root().join("configs").join(name).with_extension("json");
    let mut text = fs::read_to_string(&path).unwrap();
    if let Some((script, place)) = script_path(&text) {
        let script = path.parent().unwrap().join(script);
        let name = script.file_name().unwrap().to_string_lossy().into_owned();
        let script = ScriptConfig { name, text: fs::read_to_string(script).unwrap() };
        text = inline_script(&text, place, &script);
    }
    ExperimentConfig::from_json(&text, name, evolution::ALGORITHMS).unwrap().0
}

/// The genotype of a published champion, with its experiment.
fn champion(name: &str, config: &str) -> (ExperimentConfig, Vec<f64>) {
    let file = root().join("results/champions").join(name).with_extension("json");
    let file: Value = serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap();
    let genes = file["genotype"].as_array().unwrap().iter().map(|gene| gene.as_f64().unwrap());
    (shipped(config), genes.collect())
}

/// A shipped experiment with changes, and genes that look random.
fn changed(name: &str, change: impl FnOnce(&mut Value)) -> (ExperimentConfig, Vec<f64>) {
    let mut json: Value = serde_json::from_str(&shipped(name).to_canonical_json()).unwrap();
    change(&mut json);
    let text = json.to_string();
    let (config, _) = ExperimentConfig::from_json(&text, name, evolution::ALGORITHMS)
        .unwrap_or_else(|error| panic!("{error}"));
    let n = Simulation::compile(&config).unwrap().genotype_len();
    let gene = |gene: usize| ((gene * gene + 7_919 * gene + 13) % 1_009) as f64 / 1_008.0;
    (config, (0..n).map(gene).collect())
}

/// Leader selection with spiking neurons of a model, whose weights evolve.
fn spiking(model: &str, change: impl FnOnce(&mut Value)) -> (ExperimentConfig, Vec<f64>) {
    changed("spiking/leader_selection_lif", |json| {
        json["topology"]["neuron_model"] = json!(model);
        for ensemble in json["topology"]["ensembles"].as_object_mut().unwrap().values_mut() {
            ensemble.as_object_mut().unwrap().remove("params");
        }
        let populations = json["algorithm"]["populations"].as_object_mut().unwrap();
        let population = populations.values_mut().next().unwrap();
        population["objects"] = json!(["synapses:weights:all", "decoders:weights:all"]);
        population["min_vals"] = json!([-100, -3]);
        population["max_vals"] = json!([250, 3]);
        change(json);
    })
}

/// The controller of a genotype, with one recorded episode.
fn exported(config: &ExperimentConfig, genotype: &[f64]) -> Result<Controller, ExportError> {
    exported_while(config, genotype, LEN_MAX, &|| true)
}

/// The same within limits.
fn exported_while(
    config: &ExperimentConfig,
    genotype: &[f64],
    len_max: usize,
    keep_going: &dyn Fn() -> bool,
) -> Result<Controller, ExportError> {
    let simulation = Simulation::compile(config).unwrap();
    let about = About {
        experiment: config.name.clone(),
        genotype: "a genotype".into(),
        config_digest: "none".into(),
    };
    let trial_set = TrialSet::Generation(1);
    let episodes = Episodes { trial_set, trials: 0..1, len_max, keep_going };
    controller_c::export(&simulation, genotype, episodes, &about)
}

/// Writes a controller and its test vectors.
fn export(config: &ExperimentConfig, genotype: &[f64], to: &Path) {
    for (name, content) in exported(config, genotype).unwrap().files {
        fs::write(to.join(name), content).unwrap();
    }
}

/// Runs `make` in a directory; returns whether it succeeded, and what it printed.
fn make(directory: &Path, arguments: &[&str]) -> (bool, String) {
    let run = Command::new("make").current_dir(directory).args(arguments).output();
    let output = run.expect("`make` is needed: the build of this project needs a C compiler");
    let text = [output.stdout, output.stderr].concat();
    (output.status.success(), String::from_utf8_lossy(&text).into_owned())
}

/// Compiles and tests a controller without a warning.
fn assert_same_bits(config: &ExperimentConfig, genotype: &[f64]) {
    let directory = tempfile::tempdir().unwrap();
    export(config, genotype, directory.path());
    let (succeeds, text) = make(directory.path(), &["test", "CFLAGS=-O2 -Werror"]);
    assert!(succeeds && text.contains(" robot-steps, 0 bits differ"), "{}: {text}", config.name);
}

#[test]
fn champions_of_the_thesis_compute_the_same_bits() {
    for name in [
        "leader_selection_snes",
        "borderline_snes",
        "light_follower_snes",
        "orientation_consensus_snes",
    ] {
        let (config, genotype) = champion(&format!("{name}-0"), name);
        assert_same_bits(&config, &genotype);
    }
}

#[test]
fn champions_of_scripts_compute_the_same_bits() {
    for name in ["aggregation", "synchronisation", "predator", "foraging"] {
        let (config, genotype) = champion(&format!("{name}-0"), &format!("tasks/{name}"));
        assert_same_bits(&config, &genotype);
    }
}

#[test]
fn champions_with_spiking_neurons_compute_the_same_bits() {
    for name in ["borderline_adex", "leader_selection_lif", "light_follower_lif_encoded"] {
        let (config, genotype) = champion(&format!("{name}-0"), &format!("spiking/{name}"));
        assert_same_bits(&config, &genotype);
    }
}

#[test]
fn every_spiking_model_computes_the_same_bits() {
    for model in ["lif", "exp_lif", "adex", "izhikevich", "morris_lecar"] {
        let (config, genotype) = spiking(model, |_| {});
        assert_same_bits(&config, &genotype);
    }
}

#[test]
fn dynamic_synapses_and_encoders_compute_the_same_bits() {
    for reversal in [json!(null), json!(-40)] {
        let (config, genotype) = spiking("lif", |json| {
            let topology = &mut json["topology"];
            topology["synapse_model"] = json!("dynamic_synapse");
            topology["synapse_params"] = json!({"GABA": {"E": reversal}, "AMPA": {"E": reversal}});
            let groups = topology["synapses"].as_object_mut().unwrap().values_mut();
            for (index, group) in groups.enumerate() {
                group["neuroTX"] = json!(["AMPA+NMDA", "GABA"][index % 2]);
            }
            let field = |name: &str, n: u32, max: f64| json!({"name": name, "params": {"n_neurons": n, "max_val": max}});
            topology["encoding"] = json!({
                "I1": {"scheme": "LIF_Encoding",
                       "receptive_field": field("gaussian_receptive_field", 3, 40.0)},
                "I2": {"scheme": "PoissonRateCoding",
                       "receptive_field": field("parabolic_receptive_field", 2, 3000.0)},
                "I3": {"scheme": "RankOrderCoding",
                       "receptive_field": field("triangular_receptive_field", 4, 20.0)},
            });
        });
        assert_same_bits(&config, &genotype);
    }
}

#[test]
fn every_decoder_computes_the_same_bits() {
    let (config, genotype) = changed("leader_selection_snes", |json| {
        let topology = &mut json["topology"];
        topology["ensembles"]["OUT_LED"] = json!({"n": 5, "activation": "tanh"});
        topology["ensembles"]["H1"]["n"] = json!(7);
        topology["ensembles"]["H2"]["activation"] = json!("tanh");
        topology["decoding"]["outB"] = json!({"scheme": "SoftmaxDecoding"});
        topology["decoding"]["outA"] =
            json!({"scheme": "ThresholdDecoding", "params": {"stochastic": true}});
        topology["bias_in_gain"] = json!(false);
        topology["initial_rates"] = json!("zero");
    });
    assert_same_bits(&config, &genotype);
    let (config, genotype) = spiking("lif", |json| {
        let decoding = &mut json["topology"]["decoding"];
        decoding["outA"] = json!({"scheme": "RankOrderDecoding", "params": {"num_outputs": 2}});
        decoding["outB"] = json!({"scheme": "FirstToSpike"});
        decoding["outC"] = json!({"scheme": "RankOrderDecoding", "params": {"num_outputs": 1}});
    });
    assert_same_bits(&config, &genotype);
}

/// A pseudo-reality changes what a robot perceives and what becomes of its decisions, but neither
/// its network nor its radio.
#[test]
fn controllers_in_a_pseudo_reality_compute_the_same_bits() {
    for name in ["leader_selection_snes", "light_follower_snes", "orientation_consensus_snes"] {
        let (config, genotype) = changed(name, |json| {
            let robots = json["world"]["objects"].as_object_mut().unwrap().values_mut();
            let robots = robots.into_iter().find(|object| object["type"] == "robot").unwrap();
            robots["perturbations"]["pseudo_reality"] = json!({
                "wheel_gain": 0.8, "wheel_asymmetry": 0.2, "actuation_delay": 2,
                "sensor_gain": 0.9, "sensor_offset": 0.05, "sensor_noise": 0.1,
                "radio_range": 1.2, "radio_loss": 0.3, "antenna_heading": 0.4,
            });
        });
        assert_same_bits(&config, &genotype);
    }
}

#[test]
fn names_do_not_break_c() {
    let hostile = ["for", "*/ #error", "größe", "??/", "a%sb", "\"; }", "INT_MAX", "光", "2", "_"];
    let (config, genotype) = changed("leader_selection_snes", |json| {
        let topology = &mut json["topology"];
        for number in 0..250 {
            let name = format!("{}{}", hostile[number % hostile.len()], number / hostile.len());
            topology["ensembles"][&name] = json!({"n": 1, "activation": "sigmoid"});
        }
        for (old, new) in [("I1", "int"), ("I2", "*/ int"), ("I3", "int_")] {
            let stimuli = topology["stimuli"].as_object_mut().unwrap();
            let stimulus = stimuli.remove(old).unwrap();
            stimuli.insert(new.to_owned(), stimulus);
            topology["synapses"][&format!("{old}-H1")]["pre"] = json!([new]);
        }
        json["name"] = json!("*/ \" ??/");
    });
    assert_same_bits(&config, &genotype);
}

#[test]
fn a_difference_is_found_and_named() {
    let (config, genotype) = champion("leader_selection_snes-0", "leader_selection_snes");
    let directory = tempfile::tempdir().unwrap();
    export(&config, &genotype, directory.path());
    let path = directory.path().join("test_vectors.bin");
    let recorded = fs::read(&path).unwrap();
    let n_records = u32::from_le_bytes(recorded[20..24].try_into().unwrap()) as usize;
    let record_len = (recorded.len() - 24) / n_records;
    // One bit in the last activity of robot 3 in step 7: 5 stimuli and 2 draws precede them.
    let mut changed = recorded.clone();
    changed[24 + 73 * record_len + 4 * (5 + 4 + 23)] ^= 1;
    fs::write(&path, changed).unwrap();
    let (succeeds, text) = make(directory.path(), &["test"]);
    let place = "first difference: trial 0, step 7, robot 3: out_led[0] is ";
    assert!(!succeeds && text.contains(place), "{text}");
    fs::write(&path, &recorded[..recorded.len() - 1]).unwrap();
    let (succeeds, text) = make(directory.path(), &["test"]);
    assert!(!succeeds && text.contains("the test vectors end too early"), "{text}");
    fs::write(&path, recorded).unwrap();
    // One bit of the last synapse's weight.
    let source = directory.path().join("controller.c");
    let text = fs::read_to_string(&source).unwrap();
    let table = text.find("RECURRENT_WEIGHT[] = {").unwrap();
    let weight = table + text[table..].find("0x1.").unwrap() + "0x1.".len();
    let (before, after) = text.split_at(weight);
    let other = if after.starts_with('8') { "9" } else { "8" };
    fs::write(&source, format!("{before}{other}{}", &after[1..])).unwrap();
    let (succeeds, text) = make(directory.path(), &["test"]);
    assert!(!succeeds && text.contains("first difference: trial 0, step "), "{text}");
}

/// Rate neurons that learn, and spiking neurons with encoders that learn; with reward and without.
#[test]
fn plastic_weights_compute_the_same_bits() {
    let (config, genotype) =
        champion("leader_selection_lif_plastic-0", "spiking/leader_selection_lif_plastic");
    assert_same_bits(&config, &genotype);
    for reward in [json!(null), json!({"delay": 5, "discount": 0.9})] {
        let learning = |rate: f64| {
            json!({
                "learning_rate": rate, "max_weight": 300,
                "A": 500, "B": 0, "C": -20, "D": 1,
                "synapses": ["I1-H1", "H1-H1"], "reward": reward,
            })
        };
        let (config, genotype) = changed("leader_selection_snes", |json| {
            json["topology"]["learning"] = learning(1e-4);
            json["topology"]["ensembles"]["H2"]["activation"] = json!("tanh");
        });
        assert_same_bits(&config, &genotype);
        let (config, genotype) = spiking("lif", |json| {
            json["topology"]["learning"] = learning(1.0);
            json["topology"]["encoding"] = json!({
                "I1": {"scheme": "PoissonRateCoding",
                       "receptive_field": {"name": "linear_receptive_field", "params": {"n_neurons": 3}}},
            });
        });
        assert_same_bits(&config, &genotype);
    }
}

#[test]
fn a_genotype_that_does_not_fit_is_refused() {
    let error = exported(&shipped("quickstart"), &[0.5]).unwrap_err();
    assert!(matches!(error, ExportError::Evaluate(_)), "{error}");
}
