//! Crashes made up by a small simulation and written as LS-DYNA writes them, in any units and along
//! any axis: a body behind a crush zone of a few masses meets a wall, or another of its kind.

use std::fmt::Write;
use std::fs;
use std::path::Path;

/// What meets what, in SI.
#[derive(Clone, Copy)]
pub struct Crash {
    pub body_kg: f64,
    /// Mass of the other body, if it is a pair.
    pub other_kg: Option<f64>,
    pub speed_m_per_s: f64,
    /// Speed of the other body, against the first one's.
    pub other_speed_m_per_s: f64,
    /// Free way before the first touch.
    pub gap_m: f64,
    pub duration_s: f64,
    pub interval_s: f64,
}

impl Default for Crash {
    /// A car of 1.2 t against a wall at 50 km/h.
    fn default() -> Self {
        Self {
            body_kg: 1_200.0,
            other_kg: None,
            speed_m_per_s: 50.0 / 3.6,
            other_speed_m_per_s: 0.0,
            gap_m: 0.02,
            duration_s: 0.12,
            interval_s: 2e-4,
        }
    }
}

/// Share of a body's mass that is in each mass of its crush zone, nose first.
const ZONE: [f64; 4] = [0.02, 0.02, 0.03, 0.03];

/// A body's masses over time, the body last.
#[derive(Default)]
pub struct Motions {
    pub displacement_m: [Vec<f64>; ZONE.len() + 1],
    pub velocity_m_per_s: [Vec<f64>; ZONE.len() + 1],
    /// Between crush zone and body.
    pub section_n: Vec<f64>,
}

/// What a crash gives over time; the first body moves in the positive direction.
#[derive(Default)]
pub struct History {
    pub time_s: Vec<f64>,
    pub bodies: Vec<Motions>,
    /// Between the noses, or nose and wall; positive.
    pub contact_n: Vec<f64>,
    pub kinetic_j: Vec<f64>,
}

/// One body under work.
struct Chain {
    mass: Vec<f64>,
    x: Vec<f64>,
    v: Vec<f64>,
    plastic: Vec<f64>,
    /// 1 if its nose points forwards.
    towards: f64,
}

impl Chain {
    fn new(kg: f64, speed: f64, towards: f64) -> Self {
        let mut mass: Vec<f64> = ZONE.iter().map(|share| share * kg).collect();
        mass.push(kg - mass.iter().sum::<f64>());
        let n = mass.len();
        Self { mass, x: vec![0.0; n], v: vec![speed; n], plastic: vec![0.0; n - 1], towards }
    }

    /// Forces of its springs on its masses, and that between crush zone and body.
    fn springs(&mut self) -> (Vec<f64>, f64) {
        let total: f64 = self.mass.iter().sum();
        let (stiffness, damping) = (4e4 * total, 10.0 * total);
        let mut forces = vec![0.0; self.mass.len()];
        let mut last = 0.0;
        for k in 0..self.plastic.len() {
            let yields = total * (150.0 + 20.0 * k as f64);
            let crush = self.towards * (self.x[k + 1] - self.x[k]) - self.plastic[k];
            if stiffness * crush > yields {
                self.plastic[k] += crush - yields / stiffness;
            }
            let crush = self.towards * (self.x[k + 1] - self.x[k]) - self.plastic[k];
            let rate = self.towards * (self.v[k + 1] - self.v[k]);
            last = stiffness * crush + damping * rate;
            forces[k] += self.towards * last;
            forces[k + 1] -= self.towards * last;
        }
        (forces, last)
    }
}

impl Crash {
    pub fn run(&self) -> History {
        const STEP_S: f64 = 1e-5;
        let mut chains = vec![Chain::new(self.body_kg, self.speed_m_per_s, 1.0)];
        if let Some(kg) = self.other_kg {
            chains.push(Chain::new(kg, -self.other_speed_m_per_s, -1.0));
        }
        let mut history = History::default();
        history.bodies.resize_with(chains.len(), Motions::default);
        let every = (self.interval_s / STEP_S).round() as usize;
        for step in 0..=(self.duration_s / STEP_S).round() as usize {
            let other = chains.get(1).map_or((0.0, 0.0), |chain| (chain.x[0], chain.v[0]));
            let depth = chains[0].x[0] - other.0 - self.gap_m;
            let stiffness = 1e5 * self.body_kg;
            let contact = if depth > 0.0 { stiffness * depth } else { 0.0 };
            let mut forces = Vec::new();
            for (k, chain) in chains.iter_mut().enumerate() {
                let (mut of_springs, section) = chain.springs();
                of_springs[0] -= chain.towards * contact;
                if step % every == 0 {
                    history.bodies[k].record(chain, section);
                }
                forces.push(of_springs);
            }
            if step % every == 0 {
                history.time_s.push(step as f64 * STEP_S);
                history.contact_n.push(contact);
                let kinetic = |chain: &Chain| -> f64 {
                    chain.mass.iter().zip(&chain.v).map(|(m, v)| 0.5 * m * v * v).sum()
                };
                history.kinetic_j.push(chains.iter().map(kinetic).sum());
            }
            for (chain, forces) in chains.iter_mut().zip(forces) {
                for (i, force) in forces.into_iter().enumerate() {
                    chain.v[i] += force / chain.mass[i] * STEP_S;
                    chain.x[i] += chain.v[i] * STEP_S;
                }
            }
        }
        history
    }
}

impl Motions {
    fn record(&mut self, chain: &Chain, section: f64) {
        for i in 0..chain.x.len() {
            self.displacement_m[i].push(chain.x[i]);
            self.velocity_m_per_s[i].push(chain.v[i]);
        }
        self.section_n.push(section);
    }
}

/// How a crash is written.
#[derive(Clone, Copy)]
pub struct Layout {
    /// Sizes of the file's units in m, kg and s.
    pub units: (f64, f64, f64),
    /// 0, 1 or 2 for x, y or z.
    pub axis: usize,
    /// 1 or −1: the axis' direction against that of the first body.
    pub sign: f64,
}

pub const MM_T_S: (f64, f64, f64) = (1e-3, 1e3, 1.0);
pub const MM_KG_MS: (f64, f64, f64) = (1e-3, 1.0, 1e-3);
pub const SI: (f64, f64, f64) = (1.0, 1.0, 1.0);

/// A node of a nodout: number, title, body and mass that it sits on (of none it stands still), and
/// by how much it shakes, as a share of the speed.
pub struct Node {
    pub id: i64,
    pub title: &'static str,
    pub on: Option<(usize, usize)>,
    pub shakes: f64,
}

/// A force of an rwforc or rcforc: number, title, values along the motion, in N.
pub struct Force<'a> {
    pub id: i64,
    pub title: &'static str,
    pub along_n: &'a [f64],
    /// What it has across the motion, in N.
    pub across_n: f64,
}

/// A number as Fortran's `E{width}.{digits}` writes it.
fn e(value: f64, width: usize, digits: usize) -> String {
    let text = format!("{value:.digits$E}");
    let (mantissa, exponent) = text.split_once('E').unwrap();
    let exponent: i32 = exponent.parse().unwrap();
    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{:>width$}", format!("{mantissa}E{sign}{:02}", exponent.abs()))
}

const VERSION: &str = "                    ls-dyna smp d R14 R14.0_515_8a12796 date 12/12/2022\n";

fn head(entries: impl Iterator<Item = (i64, &'static str)>) -> String {
    let mut text =
        format!(" made up{:65}\n{VERSION}\n{{BEGIN LEGEND}}\n Entity #        Title\n", "");
    for (id, title) in entries {
        writeln!(text, "{id:>9}     {title:<80}").unwrap();
    }
    text + "{END LEGEND}\n\n"
}

impl Layout {
    fn time(&self, s: f64) -> f64 {
        s / self.units.2
    }

    fn force(&self, n: f64) -> f64 {
        let (m, kg, s) = self.units;
        n / (kg * m / (s * s))
    }

    /// A vector with a value along the motion.
    fn vector(&self, along: f64) -> [f64; 3] {
        let mut vector = [0.0; 3];
        vector[self.axis] = self.sign * along;
        vector
    }

    pub fn nodout(&self, folder: &Path, history: &History, nodes: &[Node]) {
        let (m, _, s) = self.units;
        let mut text = head(nodes.iter().map(|node| (node.id, node.title)));
        for (i, &time_s) in history.time_s.iter().enumerate() {
            write!(
                text,
                "\n\n\n n o d a l   p r i n t   o u t   f o r   t i m e  s t e p{i:8}                              ( at time{} )\n\n nodal point  x-disp     y-disp\n",
                e(self.time(time_s), 14, 7)
            )
            .unwrap();
            for node in nodes {
                let (x, v) = match node.on {
                    Some((body, mass)) => {
                        let motions = &history.bodies[body];
                        let v = &motions.velocity_m_per_s[mass];
                        let wave = (3e3 * time_s + node.id as f64).sin() - (node.id as f64).sin();
                        (motions.displacement_m[mass][i], v[i] + node.shakes * v[0].abs() * wave)
                    }
                    None => (0.0, 0.0),
                };
                let (x, v) = (self.vector(x / m), self.vector(v / (m / s)));
                let fields = x.iter().chain(&v).chain(&[0.0; 6]);
                let fields: String = fields.map(|value| e(*value, 12, 5)).collect();
                writeln!(text, "{:>9} {fields}", node.id).unwrap();
            }
        }
        fs::create_dir_all(folder).unwrap();
        fs::write(folder.join("nodout"), text).unwrap();
    }

    pub fn rwforc(&self, folder: &Path, history: &History, walls: &[Force<'_>]) {
        let mut text = head(walls.iter().map(|wall| (wall.id, wall.title)));
        text += "    time       wall#   normal-force    x-force        y-force        z-force\n";
        for (i, &time_s) in history.time_s.iter().enumerate() {
            for wall in walls {
                let mut force = self.vector(-self.force(wall.along_n[i]));
                force[(self.axis + 1) % 3] = self.force(wall.across_n);
                let normal = force.iter().map(|f| f * f).sum::<f64>().sqrt();
                let fields: String =
                    [normal].iter().chain(&force).map(|value| e(*value, 15, 6)).collect();
                writeln!(text, "{}{:8}{fields}", e(self.time(time_s), 12, 5), wall.id).unwrap();
            }
        }
        fs::write(folder.join("rwforc"), text).unwrap();
    }

    pub fn rcforc(&self, folder: &Path, history: &History, interfaces: &[Force<'_>]) {
        let mut text = head(interfaces.iter().map(|force| (force.id, force.title)));
        for (i, &time_s) in history.time_s.iter().enumerate() {
            for interface in interfaces {
                for (side, sign) in [("SURFA", -1.0), ("SURFB", 1.0)] {
                    let mut force = self.vector(sign * self.force(interface.along_n[i]));
                    force[(self.axis + 1) % 3] = sign * self.force(interface.across_n);
                    let fields: String = ["  x", "  y", "  z"]
                        .iter()
                        .zip(force)
                        .map(|(label, value)| format!("{label}{}", e(value, 13, 5)))
                        .collect();
                    writeln!(
                        text,
                        "  {side}{:>12} time{}{fields} mass  0.00000E+00  mx  0.00000E+00  my  0.00000E+00  mz  0.00000E+00",
                        interface.id,
                        e(self.time(time_s), 12, 5)
                    )
                    .unwrap();
                }
            }
        }
        fs::write(folder.join("rcforc"), text).unwrap();
    }

    pub fn secforc(&self, folder: &Path, history: &History, sections: &[Force<'_>]) {
        let mut text = head(sections.iter().map(|section| (section.id, section.title)));
        text += " line#1  section#     time        x-force     y-force     z-force    magnitude\n line#2  resultant  moments       x-moment    y-moment    z-moment   magnitude\n line#3  centroids                x           y           z            area  \n";
        for (i, &time_s) in history.time_s.iter().enumerate() {
            for section in sections {
                let mut force = self.vector(-self.force(section.along_n[i]));
                force[(self.axis + 1) % 3] = self.force(section.across_n);
                let size = force.iter().map(|f| f * f).sum::<f64>().sqrt();
                let fields: String =
                    force.iter().chain(&[size]).map(|value| e(*value, 12, 4)).collect();
                let zeros = e(0.0, 12, 4).repeat(4);
                writeln!(
                    text,
                    "{:>12}{}   {fields}\nglobal system                 {zeros}\n{:30}{zeros}\n",
                    section.id,
                    e(self.time(time_s), 15, 5),
                    ""
                )
                .unwrap();
            }
        }
        fs::write(folder.join("secforc"), text).unwrap();
    }

    pub fn glstat(&self, folder: &Path, history: &History) {
        let (m, kg, s) = self.units;
        let mut text = format!(" made up\n{VERSION}\n");
        for (&time_s, &kinetic_j) in history.time_s.iter().zip(&history.kinetic_j) {
            write!(
                text,
                "\n dt of cycle       1 is controlled by shell              1 of part         1\n\n time...........................{}\n kinetic energy.................{}\n internal energy................{}\n\n",
                e(self.time(time_s), 14, 5),
                e(kinetic_j / (kg * m * m / (s * s)), 14, 5),
                e(0.0, 14, 5)
            )
            .unwrap();
        }
        fs::write(folder.join("glstat"), text).unwrap();
    }
}
