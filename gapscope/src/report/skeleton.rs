//! The robot's skeleton as a picture, and the list of its joints: each leads to what the page says of that joint.

use super::format::{significant, with_unit};
use super::scene::Scene;
use super::{answer, chart::short, words};
use gapscope_diagnosis::schema::{Diagnosis, Evidence};
use glam::DVec3;
use maud::{Markup, html};

/// View to begin with: turned about the vertical, then looked down upon, rad.
const VIEW: [f64; 2] = [-0.6, 0.3];
/// Corners of the circle that stands for the floor, and its radius as a part of the picture.
const FLOOR: usize = 48;
const FLOOR_RADIUS: f64 = 0.35;

/// How boldly a joint is drawn: its gap as a part of the largest with the same unit; `None` at the noise floor.
pub fn boldness(diagnosis: &Diagnosis, evidence: &Evidence, joint: &str) -> Option<f64> {
    let unit = |joint: &str| words::torque_unit(joint, evidence, &diagnosis.gap.regimes);
    let own = *diagnosis.gap.torque.rms.get(joint).filter(|rms| rms.is_finite())?;
    let same = diagnosis.gap.torque.rms.iter().filter(|(other, _)| unit(other) == unit(joint));
    let most = same.map(|(_, rms)| *rms).filter(|rms| rms.is_finite()).fold(0.0, f64::max);
    (answer::is_above_floor(diagnosis, joint) && most > 0.0).then_some(own / most)
}

/// Class and style that colour a joint.
fn tone(bold: Option<f64>) -> (&'static str, String) {
    match bold {
        Some(part) => ("gap", format!("--g:{}%", short(100.0 * part))),
        None => ("quiet", String::new()),
    }
}

/// Picture, its controls and the list; without a scene the list alone.
pub fn render(diagnosis: &Diagnosis, evidence: &Evidence, scene: Option<&Scene>) -> Markup {
    html! {
        div.robot {
            @if let Some((scene, still)) = scene.and_then(|s| Some((s, s.frames.get(s.still())?))) {
                (picture(diagnosis, evidence, scene, still))
            }
            (chips(diagnosis, evidence))
        }
    }
}

fn picture(diagnosis: &Diagnosis, evidence: &Evidence, scene: &Scene, still: &[DVec3]) -> Markup {
    let view = View::of(scene);
    let point = |p: DVec3| view.project(p);
    let middle = |j: usize| 0.5 * (still[2 * j] + still[2 * j + 1]);
    let n = scene.joints.len();
    let floor: Vec<String> = (0..=FLOOR)
        .map(|k| {
            let angle = std::f64::consts::TAU * k as f64 / FLOOR as f64;
            let [x, y] = point(FLOOR_RADIUS * view.radius * DVec3::new(angle.cos(), angle.sin(), 0.0));
            format!("{},{}", short3(x), short3(y))
        })
        .collect();
    let link = |from: DVec3, to: DVec3| {
        let ([x1, y1], [x2, y2]) = (point(from), point(to));
        html! { line.link x1=(short3(x1)) y1=(short3(y1)) x2=(short3(x2)) y2=(short3(y2)) {} }
    };
    html! {
        figure.skeleton {
            svg #skeleton viewBox="-1 -1 2 2" role="group" tabindex="0"
                aria-label={ "Skeleton of " (diagnosis.robot) ", joints coloured by torque gap. Arrow keys turn it." } {
                polyline.floor points=(floor.join(" ")) {}
                g.links {
                    @for j in 0..n { (link(scene.parents[j].map_or(DVec3::ZERO, middle), middle(j))) }
                    @for (k, &j) in scene.tips.iter().enumerate() { (link(middle(j), still[2 * n + k])) }
                }
                g.ghosts {}
                @for (j, name) in scene.joints.iter().enumerate() {
                    @let ([x1, y1], [x2, y2]) = (point(still[2 * j]), point(still[2 * j + 1]));
                    @let (class, style) = tone(boldness(diagnosis, evidence, name));
                    g class={ "joint " (class) } style=(style) data-joint=(name) {
                        title { (name) }
                        line.barrel x1=(short3(x1)) y1=(short3(y1)) x2=(short3(x2)) y2=(short3(y2)) {}
                        text x=(short3(x2)) y=(short3(y2)) dx=".05" dy="-.04" { (j + 1) }
                    }
                }
            }
            figcaption {
                span.muted.needs-script { "Drag or arrow keys turn it; a joint filters the page." }
                span.tools.needs-script {
                    button type="button" data-play="log" { "Play the log" }
                    @if scene.rollouts.len() > 1 {
                        button type="button" data-play="rollout" { "Play a rollout" }
                    }
                }
                span.rollout-key.legend hidden[true] {
                    span.swatch.measured {} " robot " span.swatch.before {} " model as described "
                    @if scene.rollouts.len() > 2 { span.swatch.after {} " with the effects" }
                }
            }
        }
    }
}

/// One entry for each joint: number, name, gap.
fn chips(diagnosis: &Diagnosis, evidence: &Evidence) -> Markup {
    let torque = &diagnosis.gap.torque;
    html! {
        ol.chips aria-label="Torque gap of each joint" {
            @for joint in &diagnosis.joints {
                @let bold = boldness(diagnosis, evidence, joint);
                @let (class, style) = tone(bold);
                @let unit = words::torque_unit(joint, evidence, &diagnosis.gap.regimes);
                li class=(class) style=(style) {
                    a href={ "#torque" } data-pick=(joint) {
                        i.dot aria-hidden="true" {}
                        span.name { (joint) }
                        @match (torque.rms.get(joint), bold) {
                            (Some(rms), Some(_)) => b { (with_unit(&significant(*rms, 3), unit)) },
                            (Some(_), None) => span.muted { "at the noise" },
                            (None, _) => span.muted { "–" },
                        }
                    }
                }
            }
        }
    }
}

/// A place and a scale that hold the robot in all frames.
struct View {
    center: DVec3,
    radius: f64,
}

impl View {
    fn of(scene: &Scene) -> View {
        let all = || scene.frames.iter().flatten().copied().chain([DVec3::ZERO]);
        let (low, high) = all().fold((DVec3::ZERO, DVec3::ZERO), |(a, b), p| (a.min(p), b.max(p)));
        let center = 0.5 * (low + high);
        let radius = all().map(|p| (p - center).length()).fold(0.0, f64::max);
        View { center, radius: if radius > 0.0 { radius } else { 1.0 } }
    }

    /// The script does the same in `project`.
    fn project(&self, p: DVec3) -> [f64; 2] {
        let p = (p - self.center) / self.radius;
        let [yaw, pitch] = VIEW;
        let (x, away) = (p.x * yaw.cos() - p.y * yaw.sin(), p.x * yaw.sin() + p.y * yaw.cos());
        [x, -(p.z * pitch.cos() + away * pitch.sin())]
    }
}

fn short3(value: f64) -> String {
    if value.is_finite() { format!("{value:.3}") } else { "0".into() }
}
