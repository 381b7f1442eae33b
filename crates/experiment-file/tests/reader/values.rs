//! The meaning of valid files: defaults, alternatives, the canonical form.

use super::validator::is_valid;
use super::{BASE, accept, defaults, edited, read, refuse};
use evolution::ALGORITHMS;
use experiment_file::{
    Activation, AreaController, ExperimentConfig, GaussianField, Initializer, LightController,
    LightSourceConfig, NeuronModel, ObjectConfig, OrbitConfig, RandomTargetsConfig, ReceptiveField,
    RewardConfig, RobotController, Seed, TopologyConfig, UncontrollableRotationConfig, json_schema,
};

/// The light follower with LIF neurons, with this entry of `encoding` for its light and this
/// `learning`.
fn spiking_with(entry: &str, learning: &str) -> TopologyConfig {
    let text = include_str!("../../../../configs/spiking/light_follower_lif.json")
        .replace(r#""I5": {"scheme": "IdentityEncoding"}"#, &format!(r#""I5": {entry}"#))
        .replace(r#""synapse_model""#, &format!(r#""learning": {learning}, "synapse_model""#));
    accept(&text).topology
}

#[test]
fn receptive_fields_have_the_defaults_of_their_scheme() {
    for (scheme, values) in [("PoissonRateCoding", [0.0, 1.0]), ("RankOrderCoding", [1.0, 20.0])] {
        let topology = spiking_with(&format!(r#"{{"scheme": "{scheme}"}}"#), "null");
        assert_eq!(topology.encoding.len(), 1, "the identity is no encoder");
        let expected = GaussianField {
            sigma: 6.0,
            n_neurons: 1,
            min_stim: 0.0,
            max_stim: 1.0,
            min_val: values[0],
            max_val: values[1],
            inverted: false,
        };
        let field = topology.encoding["I5"].receptive_field;
        assert_eq!(field, ReceptiveField::Gaussian(expected));
        assert_eq!((topology.n_sources("I5"), topology.n_sources("I1")), (6, 2));
        assert_eq!(topology.learning, None);
    }
}

#[test]
fn a_seed_may_be_text_of_its_digits_and_means_the_same() {
    for seed in ["0", "9007199254740993", "18446744073709551615"] {
        let with = |seed: &str| {
            let text = edited(r#""name": "base","#, &format!(r#""name": "base", "seed": {seed},"#));
            text.replace(r#""topology": {"#, &format!(r#""topology": {{"seed": {seed},"#))
        };
        let (number, text) = (with(seed), with(&format!("{seed:?}")));
        let value = serde_json::from_str(&text).unwrap();
        assert!(is_valid(&json_schema(ALGORITHMS), &value), "{text}");
        let config = accept(&text);
        assert_eq!(config.seed.to_string(), seed);
        assert_eq!(config.to_canonical_json(), accept(&number).to_canonical_json());
    }
    for seed in ["", "-1", "1.0", "0x7", "18446744073709551616"] {
        let text = edited(r#""name": "base","#, &format!(r#""name": "base", "seed": {seed:?},"#));
        let problem = format!("must be a whole number between 0 and {}", u64::MAX);
        assert!(refuse(&text).contains(&problem), "{seed}");
    }
}

#[test]
fn a_seed_that_other_programs_would_round_is_text_and_both_forms_are_read() {
    let exact = 1 << 53;
    for (seed, json) in [
        (0, "0"),
        (exact, "9007199254740992"),
        (exact + 1, r#""9007199254740993""#),
        (u64::MAX, r#""18446744073709551615""#),
    ] {
        assert_eq!(serde_json::to_string(&Seed(seed)).unwrap(), json);
        assert_eq!(serde_json::from_str::<Seed>(json).unwrap(), Seed(seed));
        let number = seed.to_string();
        assert_eq!(serde_json::from_str::<Seed>(&number).unwrap(), Seed(seed));
    }
}

#[test]
fn invalid_seeds_are_refused_with_the_valid_forms() {
    for json in ["-1", "1.5", r#""""#, r#""+1""#, r#"" 1""#, r#""18446744073709551616""#, "null"] {
        let error = serde_json::from_str::<Seed>(json).unwrap_err().to_string();
        assert!(error.contains("or a text of its digits"), "{json}: {error}");
    }
}

#[test]
fn all_groups_learn_unless_a_file_names_some() {
    let identity = r#"{"scheme": "IdentityEncoding"}"#;
    let topology = spiking_with(identity, "{}");
    let learning = topology.learning.unwrap();
    assert!(learning.synapses.iter().eq(topology.synapses.keys()));
    assert_eq!((learning.learning_rate, learning.max_weight), (1e-4, 1_000.0));
    assert_eq!((learning.coefficients(), learning.reward), ([1.0, 0.0, 0.0, 0.0], None));
    let some = spiking_with(identity, r#"{"synapses": "H1-H2", "reward": {}}"#).learning.unwrap();
    assert_eq!(some.synapses, ["H1-H2"]);
    assert_eq!(some.reward, Some(RewardConfig { delay: 30, discount: 0.9 }));
}

#[test]
fn omitted_keys_have_their_documented_defaults() {
    let config = accept(BASE);
    assert_eq!((config.seed, config.topology.seed), (0, 821));
    assert_eq!((config.topology.dt, config.topology.time_scale), (0.1, 20));
    assert_eq!((config.world.height, config.world.width), (1000.0, 1000.0));
    assert_eq!(config.topology.ensembles["H"].activation, Some(Activation::Sigmoid));
    assert_eq!(config.topology.ensembles["H"].params, NeuronModel::Rate.default_params());
    assert!(config.topology.synapses["out"].trainable);
    let (_, bots) = config.robots().next().unwrap();
    let receiver = bots.sensors.wireless_receiver.as_ref().unwrap();
    assert_eq!((receiver.n_sectors, receiver.range, receiver.max_hops), (4, 100.0, 10));
    let transmitter = bots.actuators.wireless_transmitter.as_ref().unwrap();
    assert_eq!((transmitter.quantize, transmitter.n_levels()), (true, 4));
    let headings = Initializer::RandomUniform { low: 0.0, high: std::f64::consts::TAU, size: 1 };
    assert_eq!(bots.initializers.orientations, headings);
}

#[test]
fn the_name_is_name_else_checkpoint_file_else_the_default() {
    let name = r#""name": "base","#;
    let both = r#""checkpoint_file": "chk", "name": "base","#;
    assert_eq!(accept(&edited(name, both)).name, "base");
    assert_eq!(accept(&edited(name, r#""checkpoint_file": "chk","#)).name, "chk");
    assert_eq!(accept(&edited(name, r#""checkpoint_file": null,"#)).name, "default");
    assert_eq!(accept(&edited(name, "")).name, "default");
}

#[test]
fn one_bound_serves_all_queries() {
    let config = accept(&edited("[1.5, 0.75]", "0.5"));
    assert_eq!(config.algorithm.populations["neurons"].max_vals, [0.5, 0.5]);
}

#[test]
fn operators_stand_in_params_or_in_the_population() {
    let config = accept(BASE);
    let expected = defaults("GA").with("num_elite", 2_u32);
    assert_eq!(config.algorithm.populations["neurons"].params, expected);
}

#[test]
fn gains_is_another_name_of_gain() {
    let queries = r#""neurons:bias:all", "neurons:tau:H""#;
    let config = accept(&edited(queries, r#""neurons:gains:all", "neurons:tau:H""#));
    let queries = &config.algorithm.populations["neurons"].objects;
    assert_eq!(queries[0].to_string(), "neurons:gain:all");
}

#[test]
fn the_neuron_model_has_several_names_and_forms() {
    let model = r#""neuron_model": "rate_model","#;
    for form in [r#""neuron_model": "ctrnn","#, r#""neurons": {"model": "ctrnn"},"#, ""] {
        assert_eq!(accept(&edited(model, form)), accept(BASE), "{form}");
    }
}

#[test]
fn activation_stands_in_the_ensemble_or_in_its_params() {
    let direct = r#""activation": "tanh""#;
    let inner = r#""params": {"activation": "tanh"}"#;
    assert_eq!(accept(&edited(direct, inner)), accept(BASE));
}

#[test]
fn light_controllers_have_three_forms() {
    let controller = |form: &str| {
        let config = accept(&edited(r#""controller": null"#, &format!("\"controller\": {form}")));
        match config.world.objects["lamp"].clone() {
            ObjectConfig::LightSource(LightSourceConfig { controller, .. }) => controller,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(controller("null"), LightController::Static {});
    let random = |every, speed, step| {
        LightController::LightRndPosController(RandomTargetsConfig {
            every,
            speed,
            step,
            ..Default::default()
        })
    };
    assert_eq!(controller(r#""light_rnd_pos_controller""#), random(50, Some(3.0), None));
    let params = |params: &str| {
        controller(&format!(r#"{{"name": "light_rnd_pos_controller", "params": {params}}}"#))
    };
    assert_eq!(params(r#"{"every": 90}"#), random(90, Some(3.0), None));
    assert_eq!(params(r#"{"speed": 1.5}"#), random(50, Some(1.5), None));
    assert_eq!(params(r#"{"every": 9, "step": 0.1}"#), random(9, None, Some(0.1)));
}

/// These keys were constants before. The canonical form keeps stated values and omits defaults.
#[test]
fn constants_of_tasks_and_lights_are_keys_with_the_thesis_s_defaults() {
    let goto_light = r#""fitness_function": "goto_light""#;
    let params = |params: &str| {
        let config =
            accept(&edited(goto_light, &format!("{goto_light}, \"fitness_params\": {params}")));
        (config.algorithm.fitness_params.near, config.to_canonical_json())
    };
    assert_eq!(params("{}").0, 80.0);
    assert_eq!(params(r#"{"near": 80, "alpha": 15}"#).1, accept(BASE).to_canonical_json());
    let (near, canonical) = params(r#"{"near": 55.5}"#);
    assert!(near == 55.5 && canonical.contains(r#""fitness_params":{"near":55.5}"#), "{canonical}");
    let orbit = |params: &str| {
        let orbit = format!(r#"{{"name": "light_orbit_controller", "params": {params}}}"#);
        accept(&edited(r#""controller": null"#, &format!("\"controller\": {orbit}")))
    };
    let expected = OrbitConfig { radius: 120.0, ..OrbitConfig::default() };
    let config = orbit(r#"{"radius": 120}"#);
    assert_eq!(lamp(&config).controller, LightController::LightOrbitController(expected));
    assert_eq!(orbit(r#"{"radius": 200}"#).to_canonical_json(), orbit("{}").to_canonical_json());
    let targets = r#"{"name": "light_rnd_pos_controller", "params": {"square": 90}}"#;
    let config = accept(&edited(r#""controller": null"#, &format!("\"controller\": {targets}")));
    let expected = RandomTargetsConfig { square: 90.0, ..Default::default() };
    assert_eq!(lamp(&config).controller, LightController::LightRndPosController(expected));
    let config =
        accept(&edited(r#""controller": null"#, r#""controller": "light_prey_controller""#));
    assert_eq!(lamp(&config).controller, LightController::LightPreyController {});
}

#[test]
fn food_areas_and_nests_are_ground_areas_of_a_colour() {
    let light = r#""type": "light_source",
        "num_instances": 1,
        "controller": null,"#;
    let goto_light = r#""fitness_function": "goto_light""#;
    let text = BASE.replace(goto_light, r#""fitness_function": "grouping""#);
    for (name, color) in [("food_area", "green"), ("nest", "black")] {
        let area = format!(r#""type": "{name}", "num_instances": 1,"#);
        let with = |params: &str| text.replace(light, &format!("{area} {params}"));
        for (params, range) in [("", 150.0), (r#""params": {"range": 40},"#, 40.0)] {
            let config = accept(&with(params));
            let ObjectConfig::GroundArea(area) = &config.world.objects["lamp"] else { panic!() };
            assert_eq!((area.params.range, area.params.color.as_str()), (range, color));
        }
        let error = refuse(&with(r#""params": {"color": "red"},"#));
        assert!(error.contains("lamp.params.color: unknown key"), "{error}");
    }
}

#[test]
fn sensors_of_the_original_have_their_lengths() {
    let sensors = r#""sensors": {"wireless_receiver": {}, "light_sensor": {}}"#;
    let stimulus = r#""sensor": "light_sensor""#;
    for (sensor, params, n) in [
        ("own_position_sensor", r#"{"range": 100, "noise_sigma": 0}"#, 2),
        ("own_orientation_sensor", "{}", 1),
        ("food_sensor", "{}", 1),
        ("food_area_sensor", "{}", 1),
        ("nest_sensor", "{}", 1),
        ("neighborhood_pos_sensor", r#"{"n_neighbors": 4}"#, 12),
    ] {
        let mounted = format!(
            r#""sensors": {{"wireless_receiver": {{}}, "light_sensor": {{}}, "{sensor}": {params}}}"#
        );
        let read_it = format!(r#""sensor": "{sensor}""#);
        let text = BASE.replace(sensors, &mounted).replace(stimulus, &read_it);
        let error = read(&text.replace(r#""n": 6"#, r#""n": 5"#)).unwrap_err().to_string();
        assert!(
            error.contains(&format!("is 5, but the reading of robot `bots` has length {n}")),
            "{error}"
        );
        assert!(read(&text.replace(r#""n": 6"#, &format!("\"n\": {n}"))).is_ok(), "{sensor}");
    }
}

/// A script with every function.
pub(super) const TASK: &str =
    r#""task": {"script": {"name": "t.star", "text": "pass"}}, "world": {"#;

#[test]
fn robots_lights_and_areas_may_be_left_to_the_script() {
    let with_task = BASE.replace(r#""world": {"#, TASK);
    let area = r#""type": "ground_area", "num_instances": 1, "controller": "script_controller","#;
    let light = r#""type": "light_source",
        "num_instances": 1,
        "controller": null,"#;
    for controller in [r#""script_controller""#, r#"{"name": "script_controller"}"#] {
        let text =
            with_task.replace(r#""controller": null"#, &format!("\"controller\": {controller}"));
        assert_eq!(lamp(&accept(&text)).controller, LightController::ScriptController {});
    }
    let text = with_task
        .replace(light, area)
        .replace(r#""fitness_function": "goto_light""#, r#""fitness_function": "grouping""#);
    let ObjectConfig::GroundArea(area) = &accept(&text).world.objects["lamp"] else { panic!() };
    assert_eq!(area.controller, Some(AreaController::ScriptController));
    let (config, warnings) =
        read(&with_task.replace("\"neural_controller\"", "\"script_controller\"")).unwrap();
    assert_eq!(config.robots().next().unwrap().1.controller, RobotController::ScriptController);
    let warning =
        warnings.iter().find(|warning| warning.path == "world.objects.bots.controller").unwrap();
    assert!(warning.message.ends_with("but it does not evolve"), "{}", warning.message);
}

pub(super) fn lamp(config: &ExperimentConfig) -> &LightSourceConfig {
    match &config.world.objects["lamp"] {
        ObjectConfig::LightSource(light) => light,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_perturbation_affects_all_robots_unless_it_states_their_number() {
    let perturbation = r#""stimuli_inhibition": {"affected_robots": 2}"#;
    for form in [r#"{"affected_robots": "all"}"#, "{}"] {
        let config = accept(&edited(
            perturbation,
            &format!("\"stimuli_inhibition\": {form}, \"uncontrollable_rotation\": {form}"),
        ));
        let (_, bots) = config.robots().next().unwrap();
        assert_eq!(bots.perturbations.stimuli_inhibition[0].affected_robots, 4);
        let targets = [270.0_f64, 90.0, 15.0, 180.0].map(f64::to_radians).to_vec();
        assert_eq!(
            bots.perturbations.uncontrollable_rotation,
            Some(UncontrollableRotationConfig {
                affected_robots: 4,
                start: 200,
                targets,
                switch_at: 600,
                speed: 0.1,
            })
        );
    }
}

#[test]
fn inputs_without_a_synapse_are_named() {
    let warnings = |pre: &str| {
        let text = edited(r#""pre": ["MSG", "LIGHT"]"#, &format!(r#""pre": {pre}"#));
        let (_, warnings) = read(&text).unwrap();
        warnings.into_iter().map(|warning| warning.path).collect::<Vec<_>>()
    };
    assert_eq!(warnings(r#""MSG""#), ["topology.stimuli.LIGHT"]);
    assert_eq!(warnings(r#""OUT_LED""#), ["topology.stimuli"]);
}

#[test]
fn whole_numbers_may_be_written_as_json_schema_allows() {
    let text =
        |number: &str| edited(r#""generations": 10"#, &format!(r#""generations": {number}"#));
    for number in ["10.0", "1e1"] {
        assert_eq!(accept(&text(number)), accept(BASE), "{number}");
    }
    for number in ["10.5", "1e-1", "1e30", "-10.0"] {
        refuse(&text(number));
    }
}

#[test]
fn the_order_of_decoding_has_no_meaning() {
    let msg = r#"      "msg": {"scheme": "IdentityDecoding", "params": {"is_cat": false}},
"#;
    let wheels = r#"      "wheels": {"scheme": "IdentityDecoding"}
"#;
    let text = edited(msg, "").replace(
        wheels,
        r#""wheels": {"scheme": "IdentityDecoding"},
        "msg": {"scheme": "IdentityDecoding"}"#,
    );
    assert_eq!(accept(&text).to_canonical_json(), accept(BASE).to_canonical_json());
}

#[test]
fn the_canonical_form_is_a_file_of_the_same_meaning() {
    let config = accept(BASE);
    let canonical = config.to_canonical_json();
    let again = accept(&canonical);
    assert_eq!(again, config);
    assert_eq!(again.to_canonical_json(), canonical);
}

#[test]
fn a_file_may_name_its_schema() {
    let name = r#""name": "base","#;
    let text = edited(name, r#""$schema": "experiment.schema.json", "name": "base","#);
    assert_eq!(accept(&text), accept(BASE));
    let file: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(is_valid(&json_schema(ALGORITHMS), &file));
}

#[test]
fn a_byte_order_mark_is_ignored() {
    assert_eq!(accept(&format!("\u{feff}{BASE}")), accept(BASE));
}
