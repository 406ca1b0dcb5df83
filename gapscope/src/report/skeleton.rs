//! The robot's skeleton as a picture, and the list of its joints: each leads to what the page says of that joint.

use super::chart::short;
use super::format::{significant, with_unit};
use super::gauge::Gauge;
use super::scene::Scene;
use glam::DVec3;
use maud::{Markup, html};

/// View to begin with: turned about the vertical, then looked down upon, rad.
const VIEW: [f64; 2] = [-0.6, 0.3];
/// Corners of the circle that stands for the floor, and its radius as a part of the picture.
const FLOOR: usize = 48;
const FLOOR_RADIUS: f64 = 0.35;

/// Class and style that colour a joint.
fn tone(bold: Option<f64>) -> (&'static str, String) {
    match bold {
        Some(part) => ("gap", format!("--g:{}%", short(100.0 * part))),
        None => ("quiet", String::new()),
    }
}

/// Where a number may stand beside the end of its joint, the best place first; and how far numbers stand apart, in parts of
/// the picture's half width. The script does the same.
const BESIDE: [[f64; 2]; 8] = [
    [0.05, -0.04],
    [-0.11, -0.04],
    [0.05, 0.1],
    [-0.11, 0.1],
    [0.18, 0.03],
    [-0.24, 0.03],
    [0.05, -0.18],
    [-0.11, -0.18],
];
const APART: [f64; 2] = [0.12, 0.12];
/// No number stands nearer to the upper and lower edge of the picture.
const EDGE: f64 = 0.92;

/// Picture and controls; nothing without a scene.
pub fn picture(gauge: &Gauge, scene: Option<&Scene>) -> Markup {
    let Some((scene, still)) = scene.and_then(|s| Some((s, s.frames.get(s.still())?))) else { return html! {} };
    let view = View::of(scene);
    let point = |p: DVec3| view.project(p);
    let ends: Vec<[f64; 2]> = (0..scene.joints.len()).map(|j| point(still[2 * j + 1])).collect();
    let middle = |j: usize| 0.5 * (still[2 * j] + still[2 * j + 1]);
    let n = scene.joints.len();
    let floor: Vec<String> = (0..=FLOOR)
        .map(|k| {
            let angle = std::f64::consts::TAU * k as f64 / FLOOR as f64;
            let [x, y] = point(FLOOR_RADIUS * view.wide * DVec3::new(angle.cos(), angle.sin(), 0.0));
            format!("{},{}", short3(x), short3(y))
        })
        .collect();
    let link = |from: DVec3, to: DVec3| {
        let ([x1, y1], [x2, y2]) = (point(from), point(to));
        html! { line.link x1=(short3(x1)) y1=(short3(y1)) x2=(short3(x2)) y2=(short3(y2)) {} }
    };
    html! {
        figure.skeleton.many[n > LABELLED] {
            svg #skeleton viewBox="-1 -1 2 2" role="group" tabindex="0"
                aria-label={ "Skeleton of " (gauge.robot) ", joints coloured by " (gauge.what) " gap. Arrow keys turn it." } {
                polyline.floor points=(floor.join(" ")) {}
                g.links {
                    @for j in 0..n { (link(scene.parents[j].map_or(DVec3::ZERO, middle), middle(j))) }
                    @for (k, &j) in scene.tips.iter().enumerate() { (link(middle(j), still[2 * n + k])) }
                }
                g.ghosts {}
                @for (j, name) in scene.joints.iter().enumerate() {
                    @let ([x1, y1], [x2, y2]) = (point(still[2 * j]), point(still[2 * j + 1]));
                    @let (class, style) = tone(gauge.joint(name).and_then(|joint| gauge.boldness(joint)));
                    g class={ "joint " (class) } style=(style) data-joint=(name) {
                        title { (name) }
                        line.barrel x1=(short3(x1)) y1=(short3(y1)) x2=(short3(x2)) y2=(short3(y2)) {}
                    }
                }
                // Above all joints, or those in front would hide them.
                g.labels aria-hidden="true" {
                    @for ([x, y], end) in labels(&ends).iter().zip(&ends) {
                        @let [x1, y1, x2, y2] = leader(*end, [*x, *y]);
                        line.leader x1=(short3(x1)) y1=(short3(y1)) x2=(short3(x2)) y2=(short3(y2)) {}
                    }
                    @for (j, [x, y]) in labels(&ends).iter().enumerate() {
                        text x=(short3(*x)) y=(short3(*y)) { (j + 1) }
                    }
                }
            }
            figcaption {
                (key(gauge))
                span.tools.needs-script {
                    button type="button" data-play="log" { "Play the log" }
                    @for play in &scene.plays { button type="button" data-play=(play.name) { (play.label) } }
                }
                span.note.needs-script { "Drag to turn it, or use arrow keys. A joint filters the page." }
                span.rollout-key.legend hidden[true] {
                    span.pace {}
                    span { i.swatch.measured {} " robot" }
                    span { i.swatch.before {} " " (gauge.nominal) }
                    @if gauge.has_after() { span { i.swatch.after {} " " (gauge.corrected) } }
                }
            }
        }
    }
}

/// What the colours say; nothing where no gap was evaluated.
fn key(gauge: &Gauge) -> Markup {
    let Some(largest) = gauge.largest().filter(|joint| gauge.boldness(joint).is_some()) else { return html! {} };
    let quiet = gauge.joints.iter().any(|joint| joint.before.is_some() && gauge.boldness(joint).is_none());
    let most = largest.before.map_or(String::new(), |gap| with_unit(&significant(gap.value, 3), &largest.unit));
    html! {
        span.legend.tones {
            (super::words::capital(gauge.what)) " gap, rms"
            @if quiet { span { i.dot.quiet {} " at the noise" } }
            @if gauge.joints.len() > 1 { span { i.tone-ramp {} " to " (most) } } @else { span { i.dot.gap style="--g:100%" {} " " (most) } }
        }
    }
}

/// Where the numbers of joints stand whose barrels end here: beside them, and not on each other.
fn labels(ends: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut placed: Vec<[f64; 2]> = vec![];
    for [x, y] in ends {
        let at = |[dx, dy]: [f64; 2]| [x + dx, y + dy];
        let apart = |p: &[f64; 2], o: &[f64; 2]| (p[0] - o[0]).abs() >= APART[0] || (p[1] - o[1]).abs() >= APART[1];
        let free = |p: &[f64; 2]| p[1].abs() <= EDGE && placed.iter().all(|o| apart(p, o));
        let place = BESIDE.into_iter().map(at).find(free).unwrap_or(at(BESIDE[0]));
        placed.push(place);
    }
    placed
}

/// A line from a joint to a number that stands far from it; of no length to one beside it. The script does the same.
fn leader([x, y]: [f64; 2], [to_x, to_y]: [f64; 2]) -> [f64; 4] {
    let right = to_x > x;
    let side = if right { to_x - 0.02 } else { to_x + 0.08 };
    let far = (to_x - x).abs() > FAR[usize::from(right)] || (to_y - y).abs() > FAR[2];
    if far { [x, y, side, to_y - 0.02] } else { [x, y, x, y] }
}

/// How far a number may stand to the left, to the right and above or below before a line leads to it.
const FAR: [f64; 3] = [0.12, 0.06, 0.11];

/// Joints whose numbers stand beside them; of more each shows as it is pointed at.
const LABELLED: usize = 12;

/// One entry for each joint: number, name, gap.
pub fn list(gauge: &Gauge) -> Markup {
    html! {
        ol.chips.many[gauge.joints.len() > LABELLED] aria-label={ (super::words::capital(gauge.what)) " gap of each joint" } {
            @for joint in &gauge.joints {
                @let bold = gauge.boldness(joint);
                @let (class, style) = tone(bold);
                li class=(class) style=(style) {
                    a href={ "#" (super::OVER_TIME) } data-pick=(joint.name) {
                        i.dot aria-hidden="true" {}
                        span.name title=(joint.name) { bdi { (joint.name) } }
                        @match (joint.before, bold) {
                            (Some(gap), Some(_)) => b { (with_unit(&significant(gap.value, 3), &joint.unit)) },
                            (Some(_), None) => span.muted { "at the noise" },
                            (None, _) => span.muted { "–" },
                        }
                    }
                }
            }
        }
    }
}

/// A place and a scale that hold the robot in all frames, from wherever it is looked at around the vertical.
struct View {
    /// In the plane of the floor.
    center: DVec3,
    /// How far the robot reaches from there.
    wide: f64,
    /// Half the picture, and where its middle lies above the center.
    half: f64,
    rise: f64,
}

/// Free space around the robot, as a part of it; numbers stand there.
const MARGIN: f64 = 0.1;

impl View {
    fn of(scene: &Scene) -> View {
        let all = || scene.robot_frames().flatten().copied().chain([DVec3::ZERO]);
        let (low, high) = all().fold((DVec3::ZERO, DVec3::ZERO), |(a, b), p| (a.min(p), b.max(p)));
        let center = 0.5 * (low + high) * DVec3::new(1.0, 1.0, 0.0);
        // The script does the same in `fit`.
        let (sin, cos) = VIEW[1].sin_cos();
        let (mut wide, mut down, mut up) = (0.0_f64, 0.0_f64, 0.0_f64);
        for p in all() {
            let away = (p - center).truncate().length();
            wide = wide.max(away);
            down = down.min(p.z * cos - away * sin);
            up = up.max(p.z * cos + away * sin);
        }
        // The circle on the floor stands around the base.
        down = down.min(-sin * (FLOOR_RADIUS * wide + center.length()));
        let half = (1.0 + MARGIN) * wide.max(0.5 * (up - down));
        View { center, wide, half: if half > 0.0 { half } else { 1.0 }, rise: 0.5 * (up + down) }
    }

    /// The script does the same in `project`.
    fn project(&self, p: DVec3) -> [f64; 2] {
        let p = p - self.center;
        let [yaw, pitch] = VIEW;
        let (x, away) = (p.x * yaw.cos() - p.y * yaw.sin(), p.x * yaw.sin() + p.y * yaw.cos());
        [x / self.half, (self.rise - p.z * pitch.cos() - away * pitch.sin()) / self.half]
    }
}

fn short3(value: f64) -> String {
    if value.is_finite() { format!("{value:.3}") } else { "0".into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_joints_in_one_place_stand_apart() {
        let placed = labels(&[[0.0, 0.0]; 5]);
        for (i, a) in placed.iter().enumerate() {
            for b in &placed[..i] {
                assert!((a[0] - b[0]).abs() >= APART[0] || (a[1] - b[1]).abs() >= APART[1], "{a:?} {b:?}");
            }
        }
    }
}
