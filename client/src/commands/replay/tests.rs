//! Written files, and arguments that are refused before any is written.

use std::fs;

use clap::Parser;
use serde_json::{Value, json};

use super::{picture::Moments, *};
use crate::{
    cli::Args,
    commands::{Command, tests::one_world::output},
    experiment_file::{ExperimentFile, tests::quickstart},
    output_format::OutputFormat,
    progress::tests::Captured,
};

/// Genes of the quickstart.
const N_GENES: usize = 424;

/// Runs `swarmctl replay` on the quickstart, in a directory.
async fn run(directory: &Path, options: &[&str]) -> Result<Vec<String>, Error> {
    let genotype = directory.join("genotype.json");
    fs::write(&genotype, json!(vec![0.6; N_GENES]).to_string()).unwrap();
    let config = quickstart();
    let line = ["swarmctl", "replay", "--config", config.to_str().unwrap(), "--genotype"];
    let line = line.iter().copied().chain([genotype.to_str().unwrap()]).chain(options.to_vec());
    let Command::Replay(args) = Args::try_parse_from(line).unwrap().command else { panic!() };
    let captured = Captured::default();
    replay(Settings::default(), &args, &mut captured.progress(OutputFormat::Table)).await?;
    Ok(captured.lines())
}

#[tokio::test]
async fn the_file_stands_alone_and_is_small() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("swarm.html");
    let to = path.to_str().unwrap();
    let robots = "world.objects.robot.num_instances=20";
    let options = ["--to", to, "--steps", "1000", "--set", robots, "--trial", "1"];
    assert_eq!(run(directory.path(), &options).await.unwrap(), [to]);
    let html = fs::read_to_string(&path).unwrap();
    assert!(html.len() < 2_250_000, "{} bytes", html.len());
    assert!(!html.contains("http:") && !html.contains("https:"));
    assert!(html.contains("default-src 'none'"));
}

#[tokio::test]
async fn a_png_is_one_step_or_an_animation_of_several() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("swarm.png");
    let to = path.to_str().unwrap();
    let frames = async |at: &str| {
        run(directory.path(), &["--to", to, "--at", at, "--force"]).await.unwrap();
        let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(&path).unwrap()));
        let reader = decoder.read_info().unwrap();
        reader.info().animation_control().map(|control| control.num_frames)
    };
    assert_eq!(frames("99").await, None);
    assert_eq!(frames("3..7").await, Some(5));
    let error = run(directory.path(), &["--to", to, "--at", "100", "--force"]).await.unwrap_err();
    assert_eq!(error.to_string(), "--at 100: the episode has steps 0 to 99");
}

#[tokio::test]
async fn an_animation_of_25_steps_is_small() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("swarm.png");
    let options = ["--to", path.to_str().unwrap(), "--at", "0..24"];
    run(directory.path(), &options).await.unwrap();
    let len = fs::metadata(&path).unwrap().len();
    assert!(len < 250_000, "{len} bytes");
}

#[tokio::test]
async fn a_picture_has_the_requested_size_and_density() {
    let directory = tempfile::tempdir().unwrap();
    let [png, svg] = ["swarm.png", "swarm.svg"].map(|name| directory.path().join(name));
    let options = ["--at", "60", "--size", "300", "--dpi", "600", "--to"];
    run(directory.path(), &[&options[..], &[png.to_str().unwrap()]].concat()).await.unwrap();
    let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(&png).unwrap()));
    let reader = decoder.read_info().unwrap();
    let info = reader.info();
    assert_eq!((info.width, info.height), (300, 300));
    assert_eq!(info.pixel_dims.unwrap().xppu, 23_622);
    run(directory.path(), &[&options[..], &[svg.to_str().unwrap()]].concat()).await.unwrap();
    let text = fs::read_to_string(&svg).unwrap();
    assert!(text.contains(r#"width="300" height="300" viewBox="0 0 900 900""#), "{text}");
    assert!(text.contains("step 60") && text.contains(" cm"), "no caption or no scale bar");
    let error = run(directory.path(), &["--size", "300", "--to", "swarm.html"]).await.unwrap_err();
    assert_eq!(error.to_string(), "--size is for .png and .svg; a .html has all steps");
    let error = run(directory.path(), &["--at", "3..9", "--to", "many.svg"]).await.unwrap_err();
    assert_eq!(error.to_string(), "an .svg shows one step; a .png may be animated");
}

#[tokio::test]
async fn a_png_shows_ground_areas_in_their_colour() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("swarm.png");
    let n_green = async |changes: &[&str]| {
        let options = [&["--force", "--to", path.to_str().unwrap(), "--at", "3"], changes].concat();
        run(directory.path(), &options).await.unwrap();
        let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(&path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        let more = |a: u8, b: u8| a.saturating_sub(b);
        let is_green = |rgb: &&[u8]| more(rgb[1], rgb[0]) > 20 && more(rgb[1], rgb[2]) > 5;
        pixels.chunks(3).filter(is_green).count()
    };
    let food = r#"world.objects.food={"type": "ground_area", "num_instances": 1, "initializers":
        {"positions": {"name": "fixed", "params": {"values": [[500, 500]]}}},
        "params": {"range": 60, "color": "green"}}"#;
    assert!(n_green(&["--set", food]).await > n_green(&[]).await + 10_000);
}

#[test]
fn steps_are_read_like_seeds() {
    assert_eq!("0..9".parse::<Moments>(), "00..9".parse());
    assert_ne!("9".parse::<Moments>(), "0..9".parse());
    for text in ["", "-1", "x", "9..0", "0..", "1..2..3"] {
        let error = text.parse::<Moments>().unwrap_err();
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[tokio::test]
async fn a_refused_replay_leaves_no_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("swarm.html");
    let to = path.to_str().unwrap();
    for (options, expected) in [
        (["--to", "swarm.txt"], "swarm.txt: the name must end in .html, .png or .svg"),
        (["--set", "world.objects.robot.num_instances=0"], "is not a valid experiment file"),
        (["--set", "nonsense"], "--set "),
    ] {
        let mut options = options.to_vec();
        if options[0] != "--to" {
            options.extend(["--to", to]);
        }
        let error = run(directory.path(), &options).await.unwrap_err();
        assert_eq!(error.exit_code(), 2, "{error}");
        assert!(error.to_string().contains(expected), "{error}");
        assert!(!path.exists());
    }
    let nowhere = directory.path().join("missing/swarm.html");
    let error = run(directory.path(), &["--to", nowhere.to_str().unwrap()]).await.unwrap_err();
    assert!(error.to_string().starts_with("cannot write"), "{error}");
    assert_eq!(error.exit_code(), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_champion_plays_the_median_trial_of_its_judgement() {
    let directory = tempfile::tempdir().unwrap();
    let data = directory.path().join("data");
    let at = ["--data-dir", data.to_str().unwrap()];
    output(&format!("run {} --generations 2", quickstart().display()), &at).await;
    let found: Value = serde_json::from_str(&output("individual 1", &at).await).unwrap();
    let genes: Vec<f64> = serde_json::from_value(found["genotype"].clone()).unwrap();
    let file = ExperimentFile::read(&quickstart()).unwrap();
    let simulation = file.compile(&Overrides::default()).unwrap().experiment;
    let fitness = simulation.evaluate(&genes, TrialSet::Judgement(1), 0..200).unwrap();
    let n = |is_counted: &dyn Fn(f64) -> bool| {
        fitness.iter().filter(|value| is_counted(**value)).count()
    };
    // The hundredth of 200 sorted values.
    let is_median =
        |value: f64| n(&|other| other < value) < 100 && n(&|other| other <= value) >= 100;
    let medians: Vec<usize> = (0..200).filter(|&trial| is_median(fitness[trial])).collect();
    let files = async |option: String| {
        let path = directory.path().join("a.html");
        output(&format!("replay 1 --force --to {}{option}", path.display()), &at).await;
        fs::read_to_string(path).unwrap()
    };
    let played = files(String::new()).await;
    let mut equal = Vec::new();
    for trial in 0..200 {
        if medians.contains(&trial) || trial < 3 {
            equal.push((trial, files(format!(" --judged {trial}")).await == played));
        }
    }
    let found: Vec<usize> =
        equal.iter().filter(|(_, is_equal)| *is_equal).map(|(trial, _)| *trial).collect();
    assert!(matches!(found[..], [trial] if medians.contains(&trial)), "{found:?} {medians:?}");
}
