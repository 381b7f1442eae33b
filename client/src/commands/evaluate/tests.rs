//! Conditions, statistics and files of an evaluation, and its arguments.

use std::{fs, path::PathBuf};

use serde_json::{Value, json};

use super::{measured::Measured, *};
use crate::{
    args::{ChangedArg, IsaArgs, StepsArg},
    change::SetArg,
    experiment_file::{Overrides, tests::shipped},
    output_file::Overwrite,
};

fn args() -> EvaluateArgs {
    EvaluateArgs {
        address: None,
        genotype: None,
        config: None,
        changed: ChangedArg::default(),
        trials: 3,
        steps: StepsArg::default(),
        robots: Vec::new(),
        perturb: Vec::new(),
        inhibit: Vec::new(),
        pseudo_realities: None,
        set: SetArg::default(),
        base: Vec::new(),
        every: 1,
        priority: None,
        local: true,
        workers: None,
        to: PathBuf::from("unused"),
        overwrite: Overwrite::default(),
        isa: IsaArgs::default(),
    }
}

fn conditions(config: &str, args: &EvaluateArgs) -> Result<Vec<Condition>, Error> {
    let file = ExperimentFile::read(&shipped(config)).unwrap();
    conditions::all(&file, args).map(|(conditions, _)| conditions)
}

/// The robots of the light follower, or of another experiment of the same name.
fn robots(condition: &Condition) -> Value {
    let config: Value = serde_json::from_str(&condition.config.to_canonical_json()).unwrap();
    config["world"]["objects"]["robotA"].clone()
}

fn strings(texts: &[&str]) -> Vec<String> {
    texts.iter().map(ToString::to_string).collect()
}

#[test]
fn the_nominal_condition_is_the_file() {
    let conditions = conditions("light_follower_snes", &args()).unwrap();
    let file = ExperimentFile::read(&shipped("light_follower_snes")).unwrap();
    let compiled = file.compile(&Overrides::default()).unwrap();
    assert_eq!(conditions.len(), 1);
    assert_eq!(conditions[0].name, "nominal");
    // The order of the keys matters, too: it is the order of the genes.
    let canonical = conditions[0].config.to_canonical_json();
    assert_eq!(canonical, compiled.config.to_canonical_json());
}

#[test]
fn a_swarm_of_another_size_has_the_same_share_of_affected_robots() {
    let args = EvaluateArgs { robots: vec![5, 15, 20, 1], ..args() };
    let conditions = conditions("light_follower_snes", &args).unwrap();
    for (condition, (n, n_blind)) in
        conditions[1..].iter().zip([(5, 4), (15, 12), (20, 16), (1, 1)])
    {
        assert_eq!(condition.name, format!("robots={n}"));
        assert_eq!(condition.n_robots(), n);
        let inhibition = &robots(condition)["perturbations"]["stimuli_inhibition"];
        assert_eq!(inhibition["affected_robots"], n_blind);
    }
}

#[test]
fn an_inhibition_adds_to_those_of_the_file() {
    let args = EvaluateArgs { inhibit: strings(&["msg", "I4", "light_sensor"]), ..args() };
    let followers = conditions("light_follower_snes", &args).unwrap();
    let light = json!({"stimuli": "light_sensor", "affected_robots": 8});
    let sensors = ["wireless_receiver:msg", "wireless_receiver:signal", "light_sensor"];
    for (condition, sensor) in followers[1..].iter().zip(sensors) {
        let all = json!({"stimuli": sensor, "affected_robots": 10});
        let expected = json!([light, all]);
        assert_eq!(robots(condition)["perturbations"]["stimuli_inhibition"], expected);
    }
    // Without other inhibitions, the list has this stimulus alone.
    let args = EvaluateArgs { inhibit: strings(&["state"]), ..args };
    let conditions = conditions("leader_selection_snes", &args).unwrap();
    let inhibition = &robots(&conditions[1])["perturbations"]["stimuli_inhibition"];
    assert_eq!(inhibition["stimuli"], "wireless_receiver:state");
}

#[test]
fn perturbations_take_parameters_or_their_defaults() {
    let perturb = [
        "topology_switch",
        "topology_switch:every=100",
        "uncontrollable_rotation:affected_robots=4,targets=[1,2],start=3",
        "topology_switch:{\"every\": 7}",
    ];
    let args = EvaluateArgs { perturb: strings(&perturb), ..args() };
    let conditions = conditions("orientation_consensus_snes", &args).unwrap();
    let perturbations = |index: usize| robots(&conditions[index])["perturbations"].clone();
    assert_eq!(perturbations(1)["topology_switch"]["every"], 200);
    assert_eq!(perturbations(2)["topology_switch"]["every"], 100);
    let rotation = &perturbations(3)["uncontrollable_rotation"];
    assert_eq!(rotation["affected_robots"], 4);
    assert_eq!((&rotation["targets"], &rotation["start"]), (&json!([1.0, 2.0]), &json!(3)));
    assert_eq!(perturbations(4)["topology_switch"]["every"], 7);
}

#[test]
fn changes_make_a_condition_or_all_of_them() {
    let path = "world.objects.light_red.controller=light_rnd_pos_controller";
    let args = EvaluateArgs {
        set: SetArg { set: strings(&[path]) },
        base: strings(&["world.height=2000; seed=7"]),
        steps: StepsArg { steps: Some(50) },
        ..args()
    };
    let conditions = conditions("light_follower_snes", &args).unwrap();
    let [nominal, changed] = [0, 1].map(|index| {
        let json = conditions[index].config.to_canonical_json();
        serde_json::from_str::<Value>(&json).unwrap()
    });
    let controller = |config: &Value| config["world"]["objects"]["light_red"]["controller"].clone();
    assert_eq!(controller(&nominal)["name"], "light_orbit_controller");
    assert_eq!(controller(&changed)["name"], "light_rnd_pos_controller");
    for config in [&nominal, &changed] {
        assert_eq!((&config["world"]["height"], &config["seed"]), (&json!(2000.0), &json!(7)));
        assert_eq!(config["algorithm"]["evaluation_steps"], 50);
    }
    // Changes of all conditions are listed for the nominal condition alone.
    let paths = [0, 1].map(|index| {
        let changes = conditions[index].changes.iter();
        changes.map(|change| change.path.clone()).collect::<Vec<_>>()
    });
    let expected =
        [strings(&["world.height", "seed"]), strings(&[&path[..path.find('=').unwrap()]])];
    assert_eq!(paths, expected);
}

#[test]
fn a_condition_that_is_given_twice_is_refused() {
    let args = EvaluateArgs { robots: vec![5, 5], ..args() };
    let error = conditions("light_follower_snes", &args).unwrap_err();
    assert_eq!(error.to_string(), "condition robots=5 is given twice");
}

/// Two trials of two steps; one of them never has the second measure.
fn measured() -> Measured {
    let nan = f64::NAN;
    Measured::new(
        &["light_distance_others", "precision"],
        vec![(0.5, vec![10.0, 1.0, 20.0, nan]), (0.25, vec![30.0, nan, 50.0, nan])],
    )
}

#[test]
fn absent_values_are_left_out_of_means_and_files() {
    let dir = tempfile::tempdir().unwrap();
    let conditions = conditions("light_follower_snes", &args()).unwrap();
    let results = Results::begin(dir.path(), Overwrite::default()).unwrap();
    results.write_steps(&conditions, &[measured()], 1).unwrap();
    results.write_trials(&conditions, &[measured()]).unwrap();
    results.write("summary.json", "").unwrap();
    results.finish().unwrap();
    let read = |name| fs::read_to_string(dir.path().join(name)).unwrap();
    let steps = "\
condition,step,metric,n,median,q1,q3,mean
nominal,0,light_distance_others,2,20,15,25,20
nominal,0,precision,1,1,1,1,1
nominal,1,light_distance_others,2,35,27.5,42.5,35
";
    assert_eq!(read("steps.csv"), steps);
    let trials = "\
condition,trial,metric,time_mean,end
nominal,0,fitness,0.5,
nominal,0,light_distance_others,15,20
nominal,0,precision,1,
nominal,1,fitness,0.25,
nominal,1,light_distance_others,40,50
";
    assert_eq!(read("trials.csv"), trials);
}

#[test]
fn the_summary_estimates_time_means_and_ends() {
    let conditions = conditions("light_follower_snes", &args()).unwrap();
    let subject = Subject::new(&conditions, &[0.5; 3]);
    let summary = Summary::new(&subject, &conditions, &[measured()]);
    let summary: Value = serde_json::from_str(&json::document(&summary)).unwrap();
    assert_eq!(summary["simulation"], sim_core::FINGERPRINT);
    assert_eq!(summary["genes"], 3);
    let condition = &summary["conditions"][0];
    assert_eq!((&condition["robots"], &condition["fitness"]["mean"]), (&json!(10), &json!(0.375)));
    let distance = &condition["metrics"]["light_distance_others"];
    assert_eq!((&distance["unit"], &distance["time_mean"]["mean"]), (&json!("cm"), &json!(27.5)));
    assert_eq!(distance["end"]["mean"], 35.0);
    assert_eq!(distance["time_mean"].get("proportion_ci95"), None);
    let precision = &condition["metrics"]["precision"];
    assert_eq!(precision["time_mean"]["n"], 1);
    assert_eq!(precision["time_mean"]["proportion_ci95"], json!([1.0, 1.0]));
    assert_eq!(precision.get("end"), None);
}

#[test]
fn each_value_of_an_option_makes_a_condition() {
    let set = SetArg { set: strings(&["world.height=1000,2000; seed=7", "seed=8"]) };
    let conditions = conditions("light_follower_snes", &EvaluateArgs { set, ..args() }).unwrap();
    let names: Vec<&str> = conditions.iter().map(|condition| &*condition.name).collect();
    let both = ["world.height=1000; seed=7", "world.height=2000; seed=7"];
    assert_eq!(names, ["nominal", both[0], both[1], "seed=8"]);
}

#[test]
fn pseudo_realities_follow_other_conditions_and_each_range_comes_alone() {
    let args = EvaluateArgs { pseudo_realities: Some(3), robots: vec![5], ..args() };
    let found = conditions("leader_selection_snes", &args).unwrap();
    let names: Vec<&str> = found.iter().map(|condition| &*condition.name).collect();
    let expected = [
        "nominal",
        "robots=5",
        "reality 0",
        "reality 1",
        "reality 2",
        "only actuation_delay",
        "only radio_range",
        "only radio_loss",
        "only antenna_heading",
    ];
    assert_eq!(names, expected);
    let reality = |index: usize| robots(&found[index])["perturbations"]["pseudo_reality"].clone();
    assert_eq!(reality(0), Value::Null);
    assert_eq!(reality(7)["radio_loss"], json!([0.0, 0.6]));
    assert_eq!(reality(7)["radio_range"], json!(1.0));
    assert_ne!(reality(2), reality(3));
    let args = EvaluateArgs { pseudo_realities: Some(60), ..args };
    let error = conditions("leader_selection_snes", &args).unwrap_err();
    assert_eq!(error.to_string(), "at most 64 conditions at once; these are 66");
}

#[test]
fn the_ranges_of_the_file_replace_the_default_ones_and_the_nominal_condition_has_none() {
    let reality = "world.objects.robotA.perturbations.pseudo_reality";
    let ranges = r#"{"radio_loss": [0.2, 0.4], "actuation_delay": 1}"#;
    let base = strings(&[&format!("{reality}={ranges}")]);
    let args = EvaluateArgs { pseudo_realities: Some(3), base, ..args() };
    let found = conditions("leader_selection_snes", &args).unwrap();
    let names: Vec<&str> = found[4..].iter().map(|condition| &*condition.name).collect();
    assert_eq!(names, ["only actuation_delay", "only radio_loss"]);
    let plain = conditions("leader_selection_snes", &self::args()).unwrap();
    assert_eq!(found[0].config.to_canonical_json(), plain[0].config.to_canonical_json());
    assert_eq!(found[0].changes.last().unwrap().path, reality);
}
