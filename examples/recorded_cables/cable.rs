//! The recordings of a cable, its scenes and its fits: a rod between two grippers whose motion is recorded, with the other
//! markers as data.

use rodfit::fit::{Analysis, Experiment, Glitches, Loss, Refinement};
use rodfit::scene::{
    Discretization, InitialState, LostFrames, Material, Recorded, Scheme, Section, Shape,
    StepTolerance, Support, SwappedLabels, Time, Track,
};
use rodfit::{Fit, Observation, Point, Problem, Scene};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Assumed density, kg/m^3: the cables were not weighed, so that only moduli over the density have a meaning.
pub const DENSITY: f64 = 1000.0;
/// Assumed radius, m, at which the cables hardly stretch.
pub const RADIUS: f64 = 1.2e-3;
/// Residual of a good model, m; the loss down-weights larger residuals.
pub const SIGMA: f64 = 0.01;
/// One of so many frames is fitted.
pub const EVERY: usize = 10;

/// Recordings of one cable.
pub struct Cable {
    pub name: String,
    pub clips: Vec<(PathBuf, Arc<Track>)>,
    /// File with the vertices of the cable at rest on a table.
    pub table: Option<PathBuf>,
    /// Median distances between its markers, m.
    pub lengths: Vec<f64>,
}

impl Cable {
    /// Reads the recordings of a cable; edge lengths are the medians over all frames.
    pub fn new(
        name: String,
        mut files: Vec<PathBuf>,
        table: Option<PathBuf>,
    ) -> Result<Self, Box<dyn Error>> {
        let number = |path: &PathBuf| -> Option<u32> {
            path.file_stem()?.to_str()?.rsplit('_').next()?.parse().ok()
        };
        files.sort_by_key(number);
        let read = |path: PathBuf| Ok((path.clone(), Arc::new(Track::read(&path)?)));
        let clips: Vec<_> = files.into_iter().map(read).collect::<Result<_, rodfit::Error>>()?;
        let markers = clips.first().ok_or("no recordings")?.1.markers().len();
        let mut lengths = Vec::new();
        for j in 1..markers {
            let mut all: Vec<f64> = Vec::new();
            for (_, track) in &clips {
                let [a, b] = [j - 1, j].map(|j| &track.markers()[j].seen);
                let pairs = a.iter().zip(b).filter_map(|(a, b)| Some(((*a)?, (*b)?)));
                all.extend(pairs.map(|(a, b)| distance(a, b)));
            }
            all.sort_by(f64::total_cmp);
            lengths.push(all[all.len() / 2]);
        }
        Ok(Self { name, clips, table, lengths })
    }

    /// The scene of a straight cable, or, if `curved`, of one with the shape at rest on the table; with `edges` edges between
    /// neighboring markers.
    pub fn scene(&self, curved: bool, edges: usize) -> Scene {
        let shape = match &self.table {
            Some(table) if curved => Shape::polyline(table),
            _ => {
                let ends = self.lengths.iter().scan(0.0, |sum, l| {
                    *sum += l;
                    Some([*sum, 0.0, 0.0])
                });
                Shape::points(std::iter::once([0.0; 3]).chain(ends))
            }
        };
        // Start values of moduli and damping; fits replace them.
        let section = Section::Circle { radius: RADIUS };
        let modulus = 1e8;
        let material =
            Material { shear_modulus: Some(0.5 * modulus), ..Material::new(DENSITY, modulus) };
        let mut scene = Scene::new(self.lengths.len() * edges, shape, section, material);
        if let Shape::Polyline { lengths, .. } = &mut scene.rod.shape {
            *lengths = self.lengths.clone();
        }
        scene.rod.discretization = Some(Discretization::Paper);
        scene.rod.dimension = rodfit::scene::Dimension::Spatial;
        (scene.supports.start, scene.supports.end) = (Support::Recorded, Support::Recorded);
        scene.loads.gravity = [0.0, 0.0, -9.81];
        scene.loads.damping.mass = 0.2;
        scene.loads.damping.stiffness = 0.08;
        scene.initial.state = InitialState::Recorded;
        scene
    }

    /// The problem of a clip, with steps of its frame interval; lost frames and swapped labels of the recording are repaired.
    pub fn problem(&self, scene: &Scene, clip: usize) -> Result<Problem, rodfit::Error> {
        let mut scene = scene.clone();
        let (path, track) = &self.clips[clip];
        scene.supports.path = Some(Recorded {
            track: Some(track.clone()),
            lost_frames: LostFrames::Stretch,
            swapped_labels: SwappedLabels::Mend,
            ..Recorded::new(path)
        });
        let times = track.times();
        let mut time = Time::new(Time::TO_THE_END, times[1] - times[0]);
        time.scheme = Scheme::GeneralisedAlpha;
        // A nanometer; markers are measured to 20 micrometers.
        time.tolerance = StepTolerance::Predicted(1e-9);
        scene.time = Some(time);
        scene.problem()
    }

    /// The name of a clip.
    pub fn name_of(&self, clip: usize) -> String {
        self.clips[clip].0.file_stem().unwrap_or_default().to_string_lossy().into()
    }

    /// The fit of the free markers of these clips.
    pub fn fit(&self, scene: &Scene, clips: &[usize]) -> Result<Fit, rodfit::Error> {
        let mut experiments = Vec::new();
        for clip in clips {
            let problem = self.problem(scene, *clip)?;
            let free = Observation::of_free_markers(&problem, EVERY, Glitches::Mask)?;
            let observe =
                |e: Experiment, o: Observation| e.observe(o.sigma(SIGMA).loss(Loss::SoftL1));
            experiments.push(
                free.into_iter().fold(Experiment::new(self.name_of(*clip), &problem), observe),
            );
        }
        // The number of edges between markers is a part of the model: its error is not estimated.
        let same_mesh = Analysis { discretization_error: Refinement::None, ..Analysis::default() };
        Ok(Fit::of(experiments).analyse(same_mesh))
    }

    /// Mean absolute difference per coordinate of all markers without the first two frames, m: the metric of the authors of the
    /// recordings.
    pub fn error(&self, scene: &Scene, clip: usize) -> Result<f64, rodfit::Error> {
        let problem = self.problem(scene, clip)?;
        let run = problem.simulate()?;
        // The repaired recording.
        let path = problem.scene().supports.path.as_ref();
        let track = path.and_then(|path| path.track.as_ref()).unwrap_or(&self.clips[clip].1);
        let edges = scene.rod.segments.map_or(1, |segments| segments / self.lengths.len());
        let (mut sum, mut count) = (0.0, 0.0);
        for (k, time) in track.times().iter().enumerate().skip(2) {
            for (j, marker) in track.markers().iter().enumerate() {
                let found = run.at(Point::Node(j * edges), *time)?.0;
                for (c, seen) in marker.seen[k].into_iter().flatten().enumerate() {
                    sum += (found[c] - seen).abs();
                    count += 1.0;
                }
            }
        }
        Ok(sum / count)
    }
}

/// Distance of two points, m.
pub fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// The recordings `NAME_train_N.csv` of a cable in a folder, with its shape at rest.
pub fn recordings(folder: &Path, name: &str) -> Result<Cable, Box<dyn Error>> {
    let prefix = format!("{name}_train_");
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let own = path.file_name().is_some_and(|f| f.to_string_lossy().starts_with(&prefix));
        files.extend(own.then_some(path));
    }
    let table = folder.join(format!("{name}_rest_raw.csv"));
    Cable::new(name.into(), files, table.exists().then_some(table))
}
