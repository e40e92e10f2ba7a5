//! Data and model in pictures of a recording: places in the picture, choice of the frames, and rejected pictures.

use rodfit::fit::{FitFile, ImageOverlay};
use rodfit::page::fit_page;
use rodfit::scene::Scene;
use rodfit::{FitReport, Point, Trajectory};
use std::path::Path;
use tempfile::TempDir;

use crate::common::coarse;
use crate::common::fits::of_a_right_mesh;

/// Width and height of the pictures, px.
const SIZE: [u32; 2] = [640, 480];
/// Frames per second.
const FPS: f64 = 100.0;
/// Number of the first frame.
const FIRST: usize = 12;
/// Number of frames.
const FRAMES: usize = 61;
/// Size of a pixel, m.
const PIXEL: f64 = 1e-3;
/// Place of the world's origin in the pictures, px.
const ORIGIN: [f64; 2] = [80.0, 130.0];

/// The chunk of a PNG with its length and checksum.
fn chunk(kind: &[u8], content: &[u8]) -> Vec<u8> {
    let body = [kind, content].concat();
    let crc = body.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| {
            if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 }
        })
    });
    [&(content.len() as u32).to_be_bytes()[..], &body, &(!crc).to_be_bytes()].concat()
}

/// A gray PNG, white but for dark squares of 3 by 3 pixels at these places.
fn png([width, height]: [u32; 2], dots: &[[f64; 2]]) -> Vec<u8> {
    let mut rows = Vec::new();
    for row in 0..height {
        rows.push(0);
        let is_dark = |column: u32| {
            let [x, y] = [f64::from(column) + 0.5, f64::from(row) + 0.5];
            dots.iter().any(|dot| (x - dot[0]).abs() < 1.5 && (y - dot[1]).abs() < 1.5)
        };
        rows.extend((0..width).map(|column| if is_dark(column) { 60 } else { 230 }));
    }
    // Deflate without compression.
    let mut stream = vec![0x78, 0x01];
    let blocks = rows.chunks(65_535).count();
    for (k, block) in rows.chunks(65_535).enumerate() {
        stream.push(u8::from(k + 1 == blocks));
        stream.extend((block.len() as u16).to_le_bytes());
        stream.extend((!(block.len() as u16)).to_le_bytes());
        stream.extend(block);
    }
    let sum = rows.iter().fold([1u32, 0], |[a, b], byte| {
        let a = (a + u32::from(*byte)) % 65_521;
        [a, (a + b) % 65_521]
    });
    stream.extend((sum[1] << 16 | sum[0]).to_be_bytes());
    let header = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[8, 0, 0, 0, 0]].concat();
    let signature = b"\x89PNG\r\n\x1a\n".to_vec();
    [signature, chunk(b"IHDR", &header), chunk(b"IDAT", &stream), chunk(b"IEND", &[])].concat()
}

/// The header of a JPEG of this size, which is all that is examined.
fn jpeg([width, height]: [u16; 2]) -> Vec<u8> {
    let mut bytes = b"\xff\xd8\xff\xc0\0\x11\x08".to_vec();
    bytes.extend(height.to_be_bytes());
    bytes.extend(width.to_be_bytes());
    bytes.extend(b"\x03\x01\x22\0\x02\x11\x01\x03\x11\x01\xff\xd9");
    bytes
}

/// A camera that rotates, scales and distorts the picture, and reads its rows one after another.
struct Lens {
    rotation: f64,
    scale: f64,
    distortion: f64,
    center: [f64; 2],
    row_delay: f64,
}

/// No rotation, no distortion and no delay.
const PLAIN: Lens =
    Lens { rotation: 0.0, scale: 1.0, distortion: 0.0, center: [0.0; 2], row_delay: 0.0 };

impl Lens {
    /// The recorded position of a point of a rod whose first node has the coordinate x `first`, m. It is the center of
    /// rotation and scale.
    fn recorded(&self, x: [f64; 3], first: f64) -> [f64; 2] {
        let (sin, cos) = self.rotation.sin_cos();
        let right = x[0] - first;
        let turned = [cos * right - sin * x[1], sin * right + cos * x[1]];
        let picture = [first + self.scale * turned[0], self.scale * turned[1]];
        let arm = [0, 1].map(|c| picture[c] - self.center[c]);
        let distance = arm[0].hypot(arm[1]);
        let (mut low, mut high) = (0.0, 2.0 * distance);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            match middle * (1.0 + self.distortion * middle * middle) < distance {
                true => low = middle,
                false => high = middle,
            }
        }
        let factor = if distance > 0.0 { low / distance } else { 1.0 };
        [0, 1].map(|c| self.center[c] + factor * arm[c])
    }

    /// The recorded position of a point at a time of the clock, s: where it is when its row is read.
    fn film(&self, run: &Trajectory, point: Point, clock: f64) -> [f64; 2] {
        let mut position = [0.0; 2];
        for _ in 0..60 {
            let time = clock - self.row_delay * position[1];
            position = self.recorded(run.at(point, time).unwrap().0, run.node(0, 0)[0]);
        }
        position
    }
}

/// The place of a recorded position in the picture, px.
fn place(position: [f64; 2]) -> [f64; 2] {
    [ORIGIN[0] + position[0] / PIXEL, ORIGIN[1] - position[1] / PIXEL]
}

/// The scene of a soft cantilever, seen by a lens.
fn scene(lens: &Lens) -> Scene {
    let mut scene = coarse(20, 2e-3, 0.8);
    scene.camera.in_plane_rotation = lens.rotation;
    scene.camera.pixel_scale = lens.scale;
    scene.camera.distortion = lens.distortion;
    scene.camera.optical_center = [lens.center[0], lens.center[1], 0.0];
    scene.camera.row_delay = [0.0, lens.row_delay, 0.0];
    scene
}

/// The two tracked points.
const POINTS: [(&str, Point); 2] = [("mid", Point::ArcLength(0.26)), ("tip", Point::Tip)];

/// Writes a scene, a table of two markers in pixels and its pictures into a folder. Pictures are numbered from `first`
/// on, of every `every`-th frame. Returns the places of both markers in all frames.
fn write(folder: &Path, lens: &Lens, first: usize, every: usize) -> Vec<[[f64; 2]; 2]> {
    let scene = scene(lens);
    std::fs::write(folder.join("scene.toml"), scene.to_toml().unwrap()).unwrap();
    let run = scene.problem().unwrap().simulate().unwrap();
    let mut table = "frame,xmid[px],ymid[px],xtip[px],ytip[px]\n".to_string();
    let mut places = Vec::new();
    for k in 0..FRAMES {
        let clock = (k + 4) as f64 / FPS;
        let own = POINTS.map(|(_, point)| place(lens.film(&run, point, clock)));
        let [mid, tip] = own;
        table += &format!("{},{},{},{},{}\n", FIRST + k + 4, mid[0], mid[1], tip[0], tip[1]);
        if k % every == 0 {
            std::fs::write(folder.join(format!("f{:03}.png", first + k)), png(SIZE, &own)).unwrap();
        }
        places.push(own);
    }
    std::fs::write(folder.join("table.csv"), table).unwrap();
    places
}

/// The fit file of the table, with further keys of the observation.
fn fit_text(keys: &str) -> String {
    format!(
        "scene = \"scene.toml\"\n[[observation]]\nfile = \"table.csv\"\nfps = {FPS}\nscale = {PIXEL}\ny = \"down\"\n\
         origin = [{}, {}, 0]\ntime_zero = {FIRST}\nsigma = 1e-4\n\
         markers = {{ mid = {{ arc_length = 0.26 }}, tip = \"tip\" }}\n{keys}\n\
         [[parameter]]\nname = \"youngs_modulus\"\nstart = 1e8\n",
        ORIGIN[0], ORIGIN[1]
    )
}

fn solved(folder: &Path, text: &str) -> FitReport {
    let file = FitFile::from_toml(text, folder).unwrap();
    file.fit().analyse(of_a_right_mesh()).keep_plot_data().solve().unwrap()
}

fn overlays(report: &FitReport) -> &[ImageOverlay] {
    &report.plot_data.as_ref().unwrap().overlays
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Of exact data, recorded and simulated markers lie at the pixels of the table, and the rod passes through them, with
/// rotation, distortion and rolling shutter.
#[test]
fn markers_and_rod_are_drawn_at_the_pixels_of_the_table() {
    let distorting =
        Lens { rotation: 0.06, scale: 1.03, distortion: 0.4, center: [0.2, -0.1], row_delay: 0.03 };
    for lens in [PLAIN, distorting] {
        let folder = TempDir::new().unwrap();
        let places = write(folder.path(), &lens, FIRST + 4, 1);
        let report = solved(folder.path(), &fit_text("image = \"f{:03}.png\""));
        let first = scene(&lens).problem().unwrap().simulate().unwrap().node(0, 0);
        assert!(report.is_success(), "{report}");
        let overlays = overlays(&report);
        // Six pictures, and that of the largest residual unless it is one of them.
        assert!([6, 7].contains(&overlays.len()), "{}", overlays.len());
        assert_eq!(overlays.iter().filter(|own| own.is_worst).count(), 1);
        let times: Vec<f64> = overlays.iter().filter_map(|own| own.time).collect();
        assert!((times[0] - 0.04).abs() < 1e-12 && (times[times.len() - 1] - 0.64).abs() < 1e-12);
        for own in overlays {
            let k = (own.time.unwrap() * FPS).round() as usize - 4;
            assert!(own.file.ends_with(&format!("f{:03}.png", FIRST + 4 + k)), "{}", own.file);
            assert_eq!((own.size, own.pixel), (SIZE, PIXEL));
            assert_eq!((own.markers.len(), own.rods.len()), (2, 1));
            for (marker, place) in own.markers.iter().zip(places[k]) {
                assert!(distance(marker.recorded, place) < 1e-9);
                assert!(distance(marker.simulated.unwrap(), place) < 1e-3, "{marker:?} {place:?}");
            }
            assert!(own.rms.unwrap() < 1e-3);
            // The last node is the tip, the first one the wall.
            let rod = &own.rods[0];
            assert_eq!(rod.len(), 21);
            let tip = distance(rod[20], places[k][1]);
            assert!(tip < 0.01, "{tip} px at {:?} s", own.time);
            assert!(distance(rod[0], place(lens.recorded(first, first[0]))) < 1e-6);
            // The marker between nodes is on the rod, up to the curvature between two nodes.
            let nearest = rod.iter().map(|node| distance(*node, places[k][0]));
            assert!(nearest.fold(f64::INFINITY, f64::min) < 0.5 * 25.0 + 1.0);
        }
        let page = fit_page(&report, "fit");
        assert_eq!(page.matches("data:image/png;base64,").count(), overlays.len());
        let tip = places[0][1];
        let circle = format!("class=\"ring\" cx=\"{:.2}\" cy=\"{:.2}\"", tip[0], tip[1]);
        assert!(page.contains(&circle), "{circle}");
        for forbidden in ["http:", "https:", "src=", "<script", "NaN"] {
            assert!(!page.contains(forbidden), "{forbidden}");
        }
    }
}

/// Pictures of some frames only, numbered from another number, of validation data of an experiment: the page has those,
/// with the places of the fitted model. In JSON there are the places, without the pictures.
#[test]
fn validation_data_have_the_pictures_that_are_there() {
    let folder = TempDir::new().unwrap();
    let places = write(folder.path(), &PLAIN, 1, 20);
    let picture =
        format!("image = {{ file = \"f{{:03}}.png\", first = {} }}", 1 - (FIRST as i64 + 4));
    let observation = fit_text(&format!("{picture}\nheld_out = true"));
    let (observation, parameter) = observation.split_once("[[parameter]]").unwrap();
    let observation =
        observation.replace("scene = \"scene.toml\"\n", "").replace("[[", "[[experiment.");
    let data = |points: usize| -> String {
        let run = scene(&PLAIN).problem().unwrap().simulate().unwrap();
        let row = |k: usize| {
            let x = run.at(Point::ArcLength(0.4), 0.01 * k as f64).unwrap().0;
            format!("{},{},{}\n", 0.01 * k as f64, x[0], x[1])
        };
        "t,x,y\n".to_string() + &(0..points).map(row).collect::<String>()
    };
    std::fs::write(folder.path().join("inner.csv"), data(70)).unwrap();
    let text = format!(
        "[[experiment]]\nname = \"fitted\"\nscene = \"scene.toml\"\n[[experiment.observation]]\nfile = \"inner.csv\"\n\
         point = {{ arc_length = 0.4 }}\nsigma = 1e-4\n[[experiment]]\nname = \"filmed\"\nscene = \"scene.toml\"\n{observation}\n[[parameter]]{parameter}"
    );
    let report = solved(folder.path(), &text);
    let shown = overlays(&report);
    let times: Vec<f64> = shown.iter().map(|own| own.time.unwrap()).collect();
    assert_eq!(times.len(), 4);
    for (k, own) in shown.iter().enumerate() {
        assert!((own.time.unwrap() - (0.04 + 0.2 * k as f64)).abs() < 1e-12, "{times:?}");
        assert!(own.held_out && own.experiment == "filmed");
        assert!(distance(own.markers[1].simulated.unwrap(), places[20 * k][1]) < 1e-3);
    }
    let page = fit_page(&report, "fit");
    assert!(page.contains("filmed: f{:03}.png, validation"));
    let json = serde_json::to_string(&report).unwrap();
    assert!(json.len() < 2_000_000 && !json.contains("base64"));
    let read: FitReport = serde_json::from_str(&json).unwrap();
    assert_eq!(overlays(&read).len(), 4);
    assert!(fit_page(&read, "fit").contains("4 of 4 pictures are not shown"));
}

/// A photographed droop: the picture has its points and the rod.
#[test]
fn photograph_of_a_droop_has_its_points_and_the_rod() {
    let folder = TempDir::new().unwrap();
    let mut scene = coarse(20, 2e-3, 0.8);
    scene.time = None;
    let rest = Trajectory::at_rest(&scene.problem().unwrap(), &(0..=20).collect::<Vec<_>>(), &[]);
    let rest = rest.unwrap();
    std::fs::write(folder.path().join("scene.toml"), scene.to_toml().unwrap()).unwrap();
    let mut table = "node,x[px],y[px]\n".to_string();
    for node in (4..=20).step_by(4) {
        let place = place(rest.node(node, 0)[..2].try_into().unwrap());
        table += &format!("{node},{},{}\n", place[0], place[1]);
    }
    std::fs::write(folder.path().join("droop.csv"), table).unwrap();
    std::fs::write(folder.path().join("photo.jpg"), jpeg([640, 480])).unwrap();
    let text = |image: &str| {
        format!(
            "scene = \"scene.toml\"\n[[shape]]\nfile = \"droop.csv\"\nsigma = 1e-4\nscale = {PIXEL}\ny = \"down\"\n\
             origin = [{}, {}, 0]\n{image}\n[[parameter]]\nname = \"youngs_modulus\"\nstart = 1e8\n",
            ORIGIN[0], ORIGIN[1]
        )
    };
    // A picture of half the size has twice the pixel.
    let stated = format!(
        "image = {{ file = \"photo.jpg\", scale = {}, origin = [{}, {}] }}",
        2.0 * PIXEL,
        0.5 * ORIGIN[0],
        0.5 * ORIGIN[1]
    );
    for (image, factor) in [("image = \"photo.jpg\"", 1.0), (&stated, 0.5)] {
        let report = solved(folder.path(), &text(image));
        let [own] = overlays(&report) else { panic!("{}", overlays(&report).len()) };
        assert_eq!((own.time, own.markers.len(), own.rods[0].len()), (None, 5, 21));
        for (node, at) in own.rods[0].iter().enumerate() {
            let x = rest.node(node, 0);
            let expected = place([x[0], x[1]]).map(|x| factor * x);
            assert!(distance(*at, expected) < 1e-3, "{at:?} {expected:?}");
        }
        for marker in &own.markers {
            assert!(distance(marker.recorded, marker.simulated.unwrap()) < 1e-3);
        }
        assert!(fit_page(&report, "fit").contains("data:image/jpeg;base64,"));
    }
}

/// A fit leaves out a coordinate that is constant in whole pixels; the picture has the marker nevertheless.
#[test]
fn marker_with_a_constant_coordinate_is_drawn() {
    let folder = TempDir::new().unwrap();
    let places = write(folder.path(), &PLAIN, FIRST + 4, 1);
    let mut table = "frame,xmid[px],ymid[px],xtip[px],ytip[px]\n".to_string();
    for (k, [mid, tip]) in places.iter().enumerate() {
        table += &format!("{},412,{},{},{}\n", FIRST + k + 4, mid[1], tip[0], tip[1]);
    }
    std::fs::write(folder.path().join("table.csv"), table).unwrap();
    let report = solved(folder.path(), &fit_text("image = \"f{:03}.png\""));
    for own in overlays(&report) {
        assert_eq!(own.markers.len(), 2);
        assert!((own.markers[0].recorded[0] - 412.0).abs() < 1e-9, "{own:?}");
    }
}

/// Pictures that cannot be shown are rejected before the fit, with the key, what was found and what is allowed.
#[test]
fn pictures_that_cannot_be_shown_are_rejected_with_the_key() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    write(folder.path(), &PLAIN, FIRST + 4, 30);
    std::fs::write(path("text_16.png"), "no picture").unwrap();
    std::fs::write(path("big_16.png"), vec![0; 10_000_001]).unwrap();
    std::fs::write(path("small_16.png"), png([64, 48], &[])).unwrap();
    std::fs::write(path("mixed_16.png"), png(SIZE, &[])).unwrap();
    std::fs::write(path("mixed_17.png"), png([640, 481], &[])).unwrap();
    std::fs::write(path("photo.png"), png(SIZE, &[])).unwrap();
    std::fs::create_dir(path("folder_16.png")).unwrap();
    let refused = |text: &str, words: &[&str]| {
        let error = FitFile::from_toml(text, folder.path()).map(drop).unwrap_err().to_string();
        for word in words {
            assert!(error.contains(word), "`{word}` in: {error}");
        }
    };
    for (image, words) in [
        ("\"none_{}.png\"", &["observation[0].image", "none_16.png or of 60 further frames"][..]),
        ("\"folder_{}.png\"", &["observation[0].image", "no file"]),
        ("\"photo.png\"", &["observation[0].image", "for a motion", "{:04}"]),
        ("\"f{:03.png\"", &["observation[0].image", "{:0N}"]),
        ("\"text_{}.png\"", &["observation[0].image", "another kind of file", "PNG or JPEG"]),
        ("\"big_{}.png\"", &["big_16.png", "10 MB"]),
        ("\"small_{}.png\"", &["observation[0].image", "inside of the picture", "64 x 48 px"]),
        ("\"mixed_{}.png\"", &["observation[0].image", "640 x 481 px", "one size, 640 x 480"]),
        ("{ file = \"f{:03}.png\", scale = 1e-3 }", &["image", "scale without origin"]),
        ("{ file = \"f{:03}.png\", scale = 0, origin = [1, 2] }", &["image.scale", "above 0"]),
        ("{ name = \"f{:03}.png\" }", &["image", "file = "]),
        ("7", &["image", "frame_{:04}.png"]),
    ] {
        refused(&fit_text(&format!("image = {image}")), words);
    }
    // A table of lengths does not have the place of its points in the picture.
    let table = std::fs::read_to_string(path("table.csv")).unwrap().replace("[px]", "[mm]");
    std::fs::write(path("table.csv"), table).unwrap();
    let text = fit_text("image = \"f{:03}.png\"").replace("scale = 0.001\ny = \"down\"\n", "");
    refused(&text, &["observation[0].image", "not in pixels", "scale = meters per pixel"]);
    // Positions across the picture, and positions in space.
    std::fs::write(path("across.csv"), "t,x,z\n0,0.1,0\n0.1,0.1,0.01\n").unwrap();
    std::fs::write(path("space.csv"), "s,x,y,z\n0.2,0.2,0,0\n0.4,0.4,0,0\n").unwrap();
    let across = "{ file = \"f{:03}.png\", first = 46, scale = 1e-3, origin = [100, 200] }";
    let space = "{ file = \"photo.png\", scale = 1e-3, origin = [100, 200] }";
    for (table, file, image, words) in [
        ("observation", "across.csv", across, "no position with x and y"),
        ("shape", "space.csv", space, "positions with three coordinates"),
    ] {
        let text = format!(
            "scene = \"scene.toml\"\n[[{table}]]\nfile = \"{file}\"\nsigma = 1e-3\nimage = {image}\n[[parameter]]\n\
             name = \"youngs_modulus\"\n"
        );
        refused(&text, &[&format!("{table}[0].image"), words]);
    }
    for (keys, words) in [
        ("duration = 0.5\nfps = 10", "pictures of a planned observation"),
        ("quantity = \"acceleration\"\nfile = \"a.csv\"", "a key of a position with quantity"),
    ] {
        let text = format!(
            "scene = \"scene.toml\"\n[[observation]]\nimage = \"f{{:03}}.png\"\n{keys}\n[[parameter]]\n\
             name = \"youngs_modulus\"\n"
        );
        refused(&text, &["observation[0].image", words]);
    }
}
