//! What is done with bytes that nobody vouches for: everything that is read, validated and inspected before anything is
//! computed. Any panic, hang or gigabyte of memory is a fault; errors are what should come of most.

use rodfit::accuracy::Calculation;
use rodfit::campaign::{Admission, Collected, Outcome, Plan, Shard, Status, Store};
use rodfit::fit::{ColumnKey, ColumnRule, ColumnRules};
use rodfit::fit::{FitFile, Format, Inspection, Recording, RestShape, RotationReading};
use rodfit::problem::ParameterList;
use rodfit::scene::{End, Shape, Track};
use rodfit::{Error, Observation, Scene, Trajectory};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// The targets by name: what is read, in which format.
pub const TARGETS: [(&str, Target); 27] = [
    ("scene", Target::Scene),
    ("fit", Target::Fit),
    ("csv", Target::Markers(Format::Csv)),
    ("motive", Target::Markers(Format::Motive)),
    ("vicon", Target::Markers(Format::Vicon)),
    ("tracker", Target::Markers(Format::Tracker)),
    ("deeplabcut", Target::Markers(Format::DeepLabCut)),
    ("dltdv", Target::Markers(Format::Dltdv)),
    ("qualisys", Target::Markers(Format::Qualisys)),
    ("kinovea", Target::Markers(Format::Kinovea)),
    ("sleap", Target::Markers(Format::Sleap)),
    ("trackmate", Target::Markers(Format::TrackMate)),
    ("trc", Target::Markers(Format::Trc)),
    ("sto", Target::Markers(Format::Sto)),
    ("c3d", Target::Markers(Format::C3d)),
    ("hdf5-deeplabcut", Target::Markers(Format::DeepLabCut)),
    ("hdf5-sleap", Target::Markers(Format::Sleap)),
    ("poses", Target::Poses),
    ("accelerations", Target::Accelerations),
    ("image", Target::Image),
    ("campaign", Target::Campaign),
    ("table", Target::CampaignTable),
    ("tasks", Target::Tasks),
    ("shard", Target::Shard),
    ("results", Target::Results),
    ("design", Target::Design),
    ("simulate", Target::Simulation),
];

/// A kind of file.
#[derive(Clone, Copy)]
pub enum Target {
    Scene,
    Fit,
    Markers(Format),
    /// Poses of grippers and of sensors: a table, or rigid bodies of Motive.
    Poses,
    /// The log of an accelerometer, or positions of one point.
    Accelerations,
    /// The picture of a shape at rest.
    Image,
    /// A campaign file: how many tasks it makes, and the plan of a small one.
    Campaign,
    /// The table of a campaign.
    CampaignTable,
    /// The list of tasks of a plan.
    Tasks,
    /// The text of `--shard` on the first line, and variables of a scheduler below.
    Shard,
    /// The results that a campaign has stored.
    Results,
    /// The fit file of an experiment that is only planned.
    Design,
    /// A scene, and its motion as far as it comes in 20 ms.
    Simulation,
}

/// Nodes above which the command asks first whether the memory is there.
const MOST_NODES: usize = 5000;
/// Nodes of a simulation, one step of which takes a millisecond or so.
const MOST_NODES_IN_MOTION: usize = 200;
/// What a simulation may take.
const SIMULATION_TIME: Duration = Duration::from_millis(20);
/// Tasks of campaigns that are planned: each reads its files.
const MOST_TASKS: usize = 8;
/// Files of the data folder that campaigns and designs name.
const PROVIDED: [&str; 3] = ["cantilever.toml", "cantilever-tip.csv", "cantilever-fit.toml"];

impl Target {
    /// Reads a file of this kind; true if it was accepted. Its text may name other files in `folder`, and `place` is
    /// where it may be written to be read.
    pub fn take(self, bytes: &[u8], folder: &Path, place: &Path) -> bool {
        match (self, std::str::from_utf8(bytes)) {
            (Self::Markers(format), _) => {
                std::fs::write(place, bytes).expect("the place can be written");
                markers(place, format)
            }
            (Self::Poses, _) => {
                std::fs::write(place, bytes).expect("the place can be written");
                poses(place, bytes)
            }
            (Self::Accelerations, _) => {
                std::fs::write(place, bytes).expect("the place can be written");
                accelerations(place)
            }
            (Self::Image, _) => {
                std::fs::write(place, bytes).expect("the place can be written");
                image(place, folder)
            }
            (Self::CampaignTable, _) => {
                std::fs::write(place, bytes).expect("the place can be written");
                let name = place.file_name().expect("a file").to_string_lossy();
                let text = format!("fits = [\"cantilever-fit.toml\"]\ntable = \"{name}\"\n");
                campaign(&text, folder, &place.with_extension("toml"))
            }
            (_, Err(_)) => false,
            (Self::Campaign, Ok(text)) => campaign(text, folder, place),
            (Self::Tasks, Ok(text)) => tasks(text, place.parent().expect("a folder")),
            (Self::Shard, Ok(text)) => shard(text),
            (Self::Results, Ok(text)) => results(text, place.parent().expect("a folder")),
            (Self::Design, Ok(text)) => {
                provide(folder, place);
                std::fs::write(place, text).expect("the place can be written");
                FitFile::load_plan_if(place, admit).and_then(FitFile::of_parameters).is_ok()
            }
            (Self::Simulation, Ok(text)) => simulation(text, folder),
            (Self::Scene, Ok(text)) => scene(text, folder),
            (Self::Fit, Ok(text)) => FitFile::from_toml(text, folder).is_ok(),
        }
    }
}

/// Reads a fit file of a droop whose photograph is at this place; the data are in `folder`.
fn image(place: &Path, folder: &Path) -> bool {
    let text = format!(
        "scene = \"droop.toml\"\n[[shape]]\nfile = \"droop.csv\"\n\
         image = {{ file = '{}', scale = 0.02, origin = [8, 8] }}\n[[parameter]]\nname = \"youngs_modulus\"\n",
        place.display()
    );
    FitFile::from_toml(&text, folder).is_ok()
}

/// The nodes of a scene, before its mesh is made; 0 where the program chooses.
fn nodes(scene: &Scene) -> usize {
    match &scene.rod.shape {
        Shape::Polyline { points, .. } => scene.rod.segments.unwrap_or(points.len()),
        _ => scene.rod.segments.unwrap_or(0),
    }
}

/// Refuses what the command refuses as too large.
fn admit(scene: &Scene) -> Result<(), Error> {
    match nodes(scene) > MOST_NODES {
        true => Err(Error::Fit("too many nodes".into())),
        false => Ok(()),
    }
}

/// Puts the files that campaigns and designs name beside a place.
fn provide(folder: &Path, place: &Path) {
    for name in PROVIDED {
        let to = place.with_file_name(name);
        if !to.exists() {
            std::fs::copy(folder.join(name), to).expect("a file of the data folder is there");
        }
    }
}

fn campaign(text: &str, folder: &Path, place: &Path) -> bool {
    provide(folder, place);
    std::fs::write(place, text).expect("the place can be written");
    let Ok(size) = Plan::size(place) else { return false };
    if size > MOST_TASKS {
        return true;
    }
    let admission = Admission { scene: &admit, fit: &|_, _| Ok(()) };
    let out = place.with_file_name("plan");
    let Ok(planned) = Plan::make(place, &out, &admission) else { return false };
    assert_eq!(planned.plan.tasks.len(), size);
    // What is written is read again.
    let plan = Plan::open(&out).expect("a plan that was written can be read");
    assert_eq!(plan.tasks, planned.plan.tasks);
    true
}

fn tasks(text: &str, folder: &Path) -> bool {
    let Ok(plan) = Plan::from_lines(folder, folder, text) else { return false };
    let all = plan.open_tasks(None).expect("there are no results").0.len();
    // Every task is in one shard; ids that are no numbers are in none.
    let shards = ["0/3", "1/3", "2/3"].map(|shard| shard.parse::<Shard>().expect("a shard"));
    let shares = shards.map(|shard| plan.open_tasks(Some(shard)).expect("no results").0.len());
    assert!(shares.iter().sum::<usize>() <= all && all <= plan.tasks.len());
    let collected = Collected::new(&plan).expect("there are no results");
    assert_eq!(Status::new(&collected).open_tasks(), all);
    !plan.tasks.is_empty()
}

fn shard(text: &str) -> bool {
    let mut lines = text.lines();
    let read = lines.next().unwrap_or_default().parse::<Shard>();
    let variables: Vec<(&str, &str)> = lines.filter_map(|line| line.split_once('=')).collect();
    let variable = |name: &str| {
        variables.iter().find(|(own, _)| *own == name).map(|(_, value)| value.to_string())
    };
    let of = variable("of").and_then(|of| of.parse().ok());
    for shard in [read.as_ref().ok().copied(), Shard::from_scheduler(variable, of).ok().flatten()] {
        let _ = shard.map(|shard| shard.contains("00000000000000000000000000000003"));
    }
    read.is_ok()
}

/// Stores lines as results of one task and collects them.
fn results(text: &str, folder: &Path) -> bool {
    const TASK: &str = "{\"id\":\"0a\",\"fit\":\"fit.toml\"}";
    let folder = folder.join("results");
    let plan = Plan::from_lines(&folder, &folder, TASK).expect("a task");
    let _ = std::fs::remove_dir_all(&folder);
    let store = Store::new(&folder);
    for line in text.lines() {
        let stored = store.add("0a", &Outcome::new(0, line.into()), 0.1);
        stored.expect("a result can be stored");
    }
    let Ok(collected) = Collected::new(&plan) else { return false };
    let _ = (Status::new(&collected), collected.write_lines(&mut Vec::new()));
    collected.csv_table().is_ok_and(|sheet| !sheet.is_empty()) && !text.is_empty()
}

/// Sets a flag when a time is over.
struct Watchdog {
    since: Instant,
    /// When, ms since then.
    deadline: AtomicU64,
    stop: Arc<AtomicBool>,
}

impl Watchdog {
    fn new() -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        Self { since: Instant::now(), deadline: AtomicU64::new(u64::MAX), stop }
    }

    fn now(&self) -> u64 {
        self.since.elapsed().as_millis() as u64
    }

    /// The watchdog of this process.
    fn get() -> &'static Self {
        static WATCHDOG: OnceLock<Watchdog> = OnceLock::new();
        static STARTED: OnceLock<()> = OnceLock::new();
        let watchdog = WATCHDOG.get_or_init(Self::new);
        STARTED.get_or_init(|| {
            std::thread::spawn(|| {
                loop {
                    std::thread::sleep(Duration::from_millis(2));
                    let watchdog = Self::get();
                    if watchdog.now() > watchdog.deadline.load(Ordering::Relaxed) {
                        watchdog.stop.store(true, Ordering::Relaxed);
                    }
                }
            });
        });
        watchdog
    }
}

fn simulation(text: &str, folder: &Path) -> bool {
    let Ok(scene) = Scene::from_toml(text, folder) else { return false };
    if nodes(&scene) > MOST_NODES_IN_MOTION {
        return false;
    }
    let Ok(problem) = scene.problem_for(Calculation::Guess) else { return false };
    if problem.nodes() > MOST_NODES_IN_MOTION {
        return false;
    }
    let Ok(steps) = problem.time().map(|time| time.steps()) else { return false };
    let watchdog = Watchdog::get();
    watchdog.stop.store(false, Ordering::Relaxed);
    let end = watchdog.now() + SIMULATION_TIME.as_millis() as u64;
    watchdog.deadline.store(end, Ordering::Relaxed);
    let problem = problem.stop_when(watchdog.stop.clone());
    if let Ok(mut trajectory) = Trajectory::unrecorded(&problem) {
        let tip = problem.nodes() - 1;
        // Errors are allowed, positions that are no numbers are not.
        let _ = trajectory.run(&problem, steps, |simulation| {
            let position = simulation.position(tip);
            assert!(
                position.iter().all(|x| x.is_finite()),
                "{position:?} at {}",
                simulation.time()
            );
        });
    }
    watchdog.deadline.store(u64::MAX, Ordering::Relaxed);
    true
}

fn scene(text: &str, folder: &Path) -> bool {
    let Ok(scene) = Scene::from_toml(text, folder) else { return false };
    if nodes(&scene) > MOST_NODES {
        return true;
    }
    // What is left open is guessed, and not found by simulations.
    let Ok(problem) = scene.problem_for(Calculation::Guess) else { return false };
    let _ = (ParameterList::of(&problem), problem.warnings());
    // What is written is read again.
    let written = scene.to_toml().expect("a scene that was read can be written");
    if let Err(error) = Scene::from_toml(&written, folder) {
        panic!("{written}\nof\n{text}\n{error}");
    }
    true
}

/// A table without a header: a clock and two coordinates.
fn by_columns() -> Recording {
    let rule = |(name, number): (&str, usize)| {
        (name.to_string(), ColumnRule::Column(ColumnKey::Number(number)))
    };
    let rules = ColumnRules([("t", 1), ("x", 2), ("y", 3)].into_iter().map(rule).collect());
    Recording { columns: Some(rules), ..Recording::default() }
}

fn markers(path: &Path, format: Format) -> bool {
    let table = format == Format::Csv;
    let read = table
        && (Observation::read(path).is_ok()
            | RestShape::read(path).is_ok()
            | Track::read(path).is_ok()
            | Track::read_one(path, None).is_ok()
            | Observation::read_as(path, &by_columns()).is_ok());
    let recording = Recording { format: Some(format), ..Recording::default() };
    let Ok(inspection) = Inspection::of(path, &recording) else { return read };
    assert!(!inspection.observation.is_empty() && !inspection.to_string().is_empty());
    // As it was found to be read, with what the file does not say.
    let frames = inspection.clock_unit == "frames" && inspection.rate.is_none();
    let unnamed = ["px", "unnamed"].contains(&&inspection.unit[..]);
    let said = Recording {
        fps: frames.then_some(100.0),
        scale: unnamed.then_some(1e-3),
        ..inspection.recording
    };
    if let Ok(seen) = Observation::read_as(path, &said) {
        let finite = |x: &Option<f64>| x.is_none_or(f64::is_finite);
        assert!(seen.samples.iter().all(|s| s.time.is_finite() && s.position.iter().all(finite)));
    }
    let _ = Track::read_as(path, &said, &[]);
    true
}

/// Whether times and recorded positions of a track are finite.
fn is_finite(track: &Track) -> bool {
    let seen = track.markers().iter().flat_map(|marker| marker.seen.iter().flatten().flatten());
    seen.chain(track.times()).all(|x| x.is_finite())
}

fn poses(path: &Path, bytes: &[u8]) -> bool {
    let bodies = marker_files::read_bodies(path, bytes);
    let names = bodies.map(|read| read.bodies.into_iter().map(|body| body.name).collect());
    let names: Vec<String> = names.unwrap_or_default();
    let names = names.iter().map(|name| Some(&name[..])).chain([None]);
    let recording = |time_zero| Recording { fps: Some(100.0), time_zero, ..Recording::default() };
    let mut accepted = false;
    for name in names {
        if let Ok(track) = Track::read_poses(path, Some(0.0), None, End::Start, name) {
            assert!(is_finite(&track));
            accepted = true;
        }
        for start in [None, Some(1.0)] {
            let Ok(readings) = RotationReading::read_all(path, &recording(start), name) else {
                continue;
            };
            let length = |q: [f64; 4]| q.iter().map(|x| x * x).sum::<f64>();
            assert!(readings.iter().all(|own| (length(own.quaternion) - 1.0).abs() < 1e-9));
            assert!(readings.iter().all(|own| own.time.is_none_or(f64::is_finite)));
            accepted = true;
        }
    }
    accepted
}

fn accelerations(path: &Path) -> bool {
    let tracks = [None, Some(0.0)].map(|start| Track::read_one(path, start));
    tracks.into_iter().flatten().map(|track| assert!(is_finite(&track))).count() > 0
}

/// The files that a target begins with.
pub fn corpus(target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    // HDF5 files are those of the tests of marker-files.
    let parents =
        ["fuzz/corpus", "corpus", "crates/marker-files/tests", "../crates/marker-files/tests"];
    let folders = parents.map(|parent| root.join(parent));
    let read = |folder: &PathBuf| std::fs::read_dir(folder.join(target)).ok();
    let found = folders.iter().find_map(read).expect("every target has a corpus");
    let mut files: Vec<_> = found
        .map(|entry| entry.expect("a folder can be listed").path())
        .map(|path| (path.clone(), std::fs::read(path).expect("a file of the corpus is there")))
        .collect();
    files.sort();
    files
}
