//! Draws some steps of an episode as an SVG picture: robots with heading and LED,
//! the way that they came, and the light if there is one.
//!
//! ```sh
//! cargo run --release -p sim-core --example draw_episode -- configs/orientation_consensus_alignment_snes.json \
//!     results/champions/orientation_consensus_alignment_snes-0.json 0 40 100 200 > consensus.svg
//! ```

use std::{env, error::Error, fs};

use experiment_file::ExperimentConfig;
use sim_core::{Simulation, StepRecord, Vec2};

/// Side of a panel, in the picture's units.
const PANEL: f64 = 300.0;
/// Steps of the trail behind a robot.
const TRAIL: usize = 40;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = env::args().skip(1).collect();
    let [config, champion, steps @ ..] = &args[..] else {
        return Err("usage: draw_episode EXPERIMENT CHAMPION STEP...".into());
    };
    let text = fs::read_to_string(config)?;
    let (config, _warnings) = ExperimentConfig::from_json(&text, "episode", evolution::ALGORITHMS)?;
    let champion: serde_json::Value = serde_json::from_str(&fs::read_to_string(champion)?)?;
    let genotype: Vec<f64> = serde_json::from_value(champion["genotype"].clone())?;
    let simulation = Simulation::compile(&config)?;
    let mut episode = Vec::new();
    simulation.simulate(&genotype, 0, 0, &mut |step| episode.push(step))?;

    let mut panels = Vec::new();
    for step in steps {
        let step: usize = step.parse()?;
        panels.push(episode.get(step.saturating_sub(TRAIL)..=step).ok_or("no such step")?);
    }
    let window = Window::around(panels.iter().flat_map(|steps| *steps));
    let (width, height) = (PANEL * steps.len() as f64, PANEL + 24.0);
    println!(r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}">"#);
    println!(r#"<rect width="{width}" height="{height}" fill="white"/>"#);
    for (panel, steps) in panels.iter().enumerate() {
        println!(r#"<g transform="translate({} 0)">"#, PANEL * panel as f64);
        draw(steps, &window);
        println!("</g>");
    }
    println!("</svg>");
    Ok(())
}

/// The square part of the plane that all panels show.
struct Window {
    left: f64,
    top: f64,
    scale: f64,
}

impl Window {
    fn around<'a>(steps: impl Iterator<Item = &'a StepRecord>) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for step in steps {
            for at in step.robots.iter().map(|robot| robot.position).chain(step.lights.clone()) {
                low = [low[0].min(at.x), low[1].min(at.y)];
                high = [high[0].max(at.x), high[1].max(at.y)];
            }
        }
        let side = (high[0] - low[0]).max(high[1] - low[1]) * 1.25 + 20.0;
        Self {
            left: f64::midpoint(low[0], high[0]) - side / 2.0,
            top: f64::midpoint(low[1], high[1]) + side / 2.0,
            scale: (PANEL - 12.0) / side,
        }
    }

    fn place(&self, at: Vec2) -> (f64, f64) {
        (6.0 + (at.x - self.left) * self.scale, 6.0 + (self.top - at.y) * self.scale)
    }
}

/// Draws the last of some steps, and the trails that lead to it.
fn draw(steps: &[StepRecord], window: &Window) {
    let Some(now) = steps.last() else { return };
    let side = PANEL - 12.0;
    println!(
        r##"<rect x="6" y="6" width="{side}" height="{side}" fill="#f7f8fa" stroke="#c4c9d4"/>"##
    );
    for robot in 0..now.robots.len() {
        let mut before = None;
        let mut trail = String::new();
        for (x, y) in steps.iter().map(|step| window.place(step.robots[robot].position)) {
            // The plane is a torus: a robot that leaves at one side comes back at the other.
            let is_drawn = before.is_some_and(|(bx, by)| libm::hypot(x - bx, y - by) < side / 4.0);
            trail.push_str(&format!("{}{x:.0} {y:.0}", if is_drawn { 'L' } else { 'M' }));
            before = Some((x, y));
        }
        println!(r##"<path d="{trail}" stroke="#b9c4dc" fill="none"/>"##);
    }
    for (x, y) in now.lights.iter().map(|light| window.place(*light)) {
        for (radius, opacity) in [(30.0, 0.25), (18.0, 0.4), (9.0, 1.0)] {
            println!(
                r##"<circle cx="{x:.1}" cy="{y:.1}" r="{radius}" fill="#f5b301" opacity="{opacity}"/>"##
            );
        }
    }
    for robot in &now.robots {
        let (x, y) = window.place(robot.position);
        let fill = if robot.led > 0 { "#d7263d" } else { "#2b59c3" };
        let (dx, dy) = (16.0 * libm::cos(robot.heading), -16.0 * libm::sin(robot.heading));
        println!(
            r##"<circle cx="{x:.1}" cy="{y:.1}" r="7" fill="{fill}"/><path d="M{x:.1} {y:.1}l{dx:.1} {dy:.1}" stroke="{fill}" stroke-width="3" stroke-linecap="round"/>"##
        );
    }
    println!(
        r##"<text x="{}" y="{}" font-family="sans-serif" font-size="14" text-anchor="middle" fill="#3d4454">step {}</text>"##,
        PANEL / 2.0,
        PANEL + 14.0,
        now.step
    );
}
