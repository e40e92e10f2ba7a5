//! One synthetic motion of a tip as files of all supported programs, byte for byte in their layouts.

use rodfit::fit::{Axes, Recording, Vertical};
use rodfit::{Point, Problem};

/// Frames a second: all times have few decimals.
pub const RATE: f64 = 64.0;
/// The frame without a position of the tip.
pub const GAP: usize = 7;

/// Where the tip is in each frame, mm, to a 1024th: exact in the decimals of all files.
pub fn tip(problem: &Problem, frames: usize) -> Vec<[f64; 2]> {
    let run = problem.simulate().unwrap();
    let place = |k: usize| {
        let (x, _) = run.at(Point::Tip, k as f64 / RATE).unwrap();
        [x[0], x[1]].map(|x| (x * 1e3 * 1024.0).round() / 1024.0)
    };
    (0..frames).map(place).collect()
}

/// A file, and how it is read.
pub struct Written {
    pub name: &'static str,
    pub format: &'static str,
    pub text: String,
    pub recording: Recording,
    /// The keys of an observation of a fit file with the same meaning as `recording`.
    pub keys: &'static str,
}

impl Written {
    /// The interpretation of the file with the name of its format.
    pub fn with_format(&self) -> Recording {
        let format = Some(serde_json::from_str(&format!("\"{}\"", self.format)).unwrap());
        Recording { format, ..self.recording.clone() }
    }
}

/// A file of this name with nine frames.
pub fn short_file(name: &str) -> Written {
    let tip: Vec<[f64; 2]> = (0..9).map(|k| [500.5 - f64::from(k), -2.25 * f64::from(k)]).collect();
    all(&tip).into_iter().find(|file| file.name == name).unwrap()
}

/// Rows of a file, one per frame: `row` gets the number of the frame and the position, `None` in the frame [`GAP`].
fn rows(tip: &[[f64; 2]], row: impl Fn(usize, Option<[f64; 2]>) -> String) -> String {
    let seen = |k: usize| (k != GAP).then_some(tip[k]);
    (0..tip.len()).map(|k| row(k, seen(k))).collect()
}

/// Two coordinates with a separator; the separator alone for a missing position.
fn two(place: Option<[f64; 2]>, between: &str) -> String {
    place.map_or(between.into(), |[x, y]| format!("{x}{between}{y}"))
}

/// The tip in every format.
pub fn all(tip: &[[f64; 2]]) -> Vec<Written> {
    let said = Recording::default;
    let of = |marker: &str| Recording { marker: Some(marker.into()), ..said() };
    let flat = Axes::new(["x", "y", "none"]).unwrap();
    let t = |k: usize| k as f64 / RATE;
    let mut files = Vec::new();
    let mut add = |name, format, text: String, recording, keys| {
        files.push(Written { name, format, text, recording, keys })
    };
    add(
        "table.csv",
        "csv",
        format!("t,x[mm],y[mm]\n{}", rows(tip, |k, p| format!("{},{}\n", t(k), two(p, ",")))),
        said(),
        "",
    );
    add(
        "markers.csv",
        "csv",
        format!(
            "t,xmid[mm],ymid[mm],xtip[mm],ytip[mm]\n{}",
            rows(tip, |k, p| format!("{},250,-1,{}\n", t(k), two(p, ",")))
        ),
        of("tip"),
        "marker = \"tip\"\n",
    );
    add(
        "motive.csv",
        "motive",
        format!(
            "Format Version,1.23,Take Name,rod,Take Notes,,Capture Frame Rate,64.000000,Export Frame Rate,64.000000,\
             Capture Start Time,2019-07-29 04.19.58.625 PM,Total Frames in Take,{n},Total Exported Frames,{n},\
             Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global\n\
             \n\
             ,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Marker,Marker,Marker,Marker,Marker,Marker\n\
             ,Name,base,base,base,base,rod:mid,rod:mid,rod:mid,rod:tip,rod:tip,rod:tip\n\
             ,ID,1,1,1,1,97F1B5,97F1B5,97F1B5,97F1B6,97F1B6,97F1B6\n\
             ,,Rotation,Position,Position,Position,Position,Position,Position,Position,Position,Position\n\
             Frame,Time (Seconds),X,X,Y,Z,X,Y,Z,X,Y,Z\n{}",
            rows(tip, |k, p| {
                let z = if p.is_some() { "0.000000" } else { "" };
                format!("{k},{:.6},0,1,2,3,250,-1,0,{},{z}\n", t(k), two(p, ","))
            }),
            n = tip.len()
        ),
        Recording { axes: Some(flat), ..of("rod:tip") },
        "marker = \"rod:tip\"\naxes = [\"x\", \"y\", \"none\"]\n",
    );
    add(
        "tip.trc",
        "trc",
        format!(
            "PathFileType\t4\t(X/Y/Z)\ttip.trc\n\
             DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n\
             64\t64\t{n}\t2\tmm\t64\t1\t{n}\n\
             Frame#\tTime\ttip\t\t\tmid\t\t\n\
             \t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n{}",
            rows(tip, |k, p| {
                let z = if p.is_some() { "0" } else { "" };
                format!("{}\t{:.6}\t{}\t{z}\t250\t-1\t0\n", k + 1, t(k), two(p, "\t"))
            }),
            n = tip.len()
        ),
        Recording { axes: Some(flat), ..of("tip") },
        "marker = \"tip\"\naxes = [\"x\", \"y\", \"none\"]\n",
    );
    add(
        "vicon.csv",
        "vicon",
        format!(
            "\r\n\r\nDevices\r\n1000\r\n,,Force\r\nFrame,Sub Frame,Fx\r\n,,N\r\n1,0,0.5\r\n\r\nTrajectories\r\n64\r\n\
             ,,rod:tip,,,rod:mid,,\r\nFrame,Sub Frame,X,Y,Z,X,Y,Z\r\n,,mm,mm,mm,mm,mm,mm\r\n{}\r\n\
             Model Outputs\r\n64\r\n,,a\r\nFrame,Sub Frame,X\r\n,,mm\r\n1,0,5\r\n",
            rows(tip, |k, p| {
                let z = if p.is_some() { "0" } else { "" };
                format!("{},0,{},{z},250,-0.4,0\r\n", k + 1, two(p, ","))
            })
        ),
        Recording { axes: Some(flat), ..of("rod:tip") },
        "marker = \"rod:tip\"\naxes = [\"x\", \"y\", \"none\"]\n",
    );
    add(
        "tracker.txt",
        "tracker",
        format!("mass_A\nt\tx\ty\n{}", rows(tip, |k, p| format!("{}\t{}\n", t(k), two(p, "\t")))),
        Recording { scale: Some(1e-3), ..said() },
        "scale = 1e-3\n",
    );
    add(
        "tracks.txt",
        "tracker",
        format!(
            ",mass_A,,,,mass_C,,,,mass_B,,mass_C\nt,x,y,vx,vy,x,y,vx,vy,\u{3b8},\u{3c9},\u{3b8}\n{}",
            rows(tip, |k, p| format!("{},1,2,3,4,{},5,6,7,8,9\n", t(k), two(p, ",")))
        ),
        Recording { scale: Some(1e-3), ..of("mass_C") },
        "marker = \"mass_C\"\nscale = 1e-3\n",
    );
    let pixels = |p: Option<[f64; 2]>, first: f64| {
        p.map_or("3.5,4.5,0.1".into(), |[x, y]| format!("{},{},0.99", x + first, -y + first))
    };
    let camera = Recording { likelihood: Some(0.6), fps: Some(RATE), scale: Some(1e-3), ..said() };
    add(
        "deeplabcut.csv",
        "deeplabcut",
        format!(
            "scorer,DLC_resnet50,DLC_resnet50,DLC_resnet50\nbodyparts,tip,tip,tip\ncoords,x,y,likelihood\n{}",
            rows(tip, |k, p| format!("{k},{}\n", pixels(p, 0.0)))
        ),
        camera.clone(),
        "likelihood = 0.6\nfps = 64\nscale = 1e-3\n",
    );
    add(
        "animals.csv",
        "deeplabcut",
        format!(
            "scorer,DLC,DLC,DLC,DLC,DLC,DLC\nindividuals,rod1,rod1,rod1,rod2,rod2,rod2\n\
             bodyparts,tip,tip,tip,tip,tip,tip\ncoords,x,y,likelihood,x,y,likelihood\n{}",
            rows(tip, |k, p| format!("img{k:04}.png,1,2,0.9,{}\n", pixels(p, 0.0)))
        ),
        Recording { marker: Some("rod2:tip".into()), ..camera.clone() },
        "marker = \"rod2:tip\"\nlikelihood = 0.6\nfps = 64\nscale = 1e-3\n",
    );
    let unseen = |p: Option<String>, n: usize| p.unwrap_or(vec!["NaN"; n].join(","));
    add(
        "xypts.csv",
        "dltdv",
        format!(
            "pt1_cam1_X,pt1_cam1_Y,pt1_cam2_X,pt1_cam2_Y\n{}",
            rows(tip, |_, p| {
                let p = p.map(|[x, y]| format!("{},{}", x + 1.0, -y + 1.0));
                format!("NaN,NaN,{}\n", unseen(p, 2))
            })
        ),
        Recording {
            likelihood: None,
            origin: Some([1.0, 1.0, 0.0]),
            y: Some(Vertical::Down),
            marker: Some("pt1_cam2".into()),
            ..camera
        },
        "marker = \"pt1_cam2\"\nfps = 64\nscale = 1e-3\norigin = [1, 1, 0]\ny = \"down\"\n",
    );
    add(
        "xyzpts.csv",
        "dltdv",
        format!(
            "pt1_X,pt1_Y,pt1_Z\n{}",
            rows(tip, |_, p| format!("{}\n", unseen(p.map(|[x, y]| format!("{x},0,{y}")), 3)))
        ),
        Recording {
            fps: Some(RATE),
            scale: Some(1e-3),
            axes: Some(Axes::new(["x", "z", "none"]).unwrap()),
            ..said()
        },
        "fps = 64\nscale = 1e-3\naxes = [\"x\", \"z\", \"none\"]\n",
    );
    add(
        "qualisys.tsv",
        "qualisys",
        format!(
            "NO_OF_FRAMES\t{}\nNO_OF_CAMERAS\t13\nNO_OF_MARKERS\t2\nFREQUENCY\t64\nNO_OF_ANALOG\t0\n\
             ANALOG_FREQUENCY\t0\nDESCRIPTION\t--\nTIME_STAMP\t2024-04-15, 10:39:38.777\t406646.66137317\n\
             DATA_INCLUDED\t3D\nMARKER_NAMES\tmid\ttip\nTRAJECTORY_TYPES\tMeasured\tMeasured\n{}",
            tip.len(),
            rows(tip, |_, p| {
                let p = p.map_or("0.000\t0.000\t0.000".into(), |[x, y]| format!("{x}\t{y}\t0.000"));
                format!("250\t-1\t0\t{p}\n")
            })
        ),
        Recording { axes: Some(flat), ..of("tip") },
        "marker = \"tip\"\naxes = [\"x\", \"y\", \"none\"]\n",
    );
    add(
        "kinovea.csv",
        "kinovea",
        format!(
            "\"Time (ms)\";\"Trajectory 1/0/X (mm)\";\"Trajectory 1/0/Y (mm)\"\n{}",
            rows(tip, |k, p| format!("{};{}\n", 1e3 * t(k), two(p, ";"))).replace('.', ",")
        ),
        said(),
        "",
    );
    add(
        "kinovea.txt",
        "kinovea",
        format!(
            "#Kinovea Trajectory data export\n#T X Y\n\n# Trajectory 1\n{}\n# Trajectory 2\n{}",
            rows(tip, |k, _| format!("{} 250 -1 \n", t(k))),
            rows(tip, |k, p| p.map_or(String::new(), |p| format!("{} {} {} \n", t(k), p[0], p[1])))
        ),
        Recording { scale: Some(1e-3), ..of("Trajectory 2") },
        "marker = \"Trajectory 2\"\nscale = 1e-3\n",
    );
    let image = Recording { fps: Some(RATE), scale: Some(1e-3), ..said() };
    add(
        "sleap.csv",
        "sleap",
        format!(
            "track,frame_idx,instance.score,mid.x,mid.y,mid.score,tip.x,tip.y,tip.score\n{}",
            rows(tip, |k, p| {
                let p = p.map_or("3.5,4.5,0.1".into(), |[x, y]| format!("{x},{},0.99", -y));
                format!("rod,{k},0.9,250,1,0.8,{p}\ncable,{k},0.8,1,2,0.7,3,4,0.7\n")
            })
        ),
        Recording { likelihood: Some(0.6), marker: Some("rod:tip".into()), ..image.clone() },
        "marker = \"rod:tip\"\nlikelihood = 0.6\nfps = 64\nscale = 1e-3\n",
    );
    add(
        "spots.csv",
        "trackmate",
        format!(
            "LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y,POSITION_Z,POSITION_T,FRAME,RADIUS,VISIBILITY\n\
             Label,ElementPlacement ID,Track ID,Quality,X,Y,Z,T,Frame,Radius,Visibility\n\
             Label,ElementPlacement ID,Track ID,Quality,X,Y,Z,T,Frame,R,Visibility\n\
             ,,,(quality),(pixel),(pixel),(pixel),(frame),,(pixel),\n{}",
            // In no order, and with spots of no track.
            rows(tip, |k, p| {
                let spot = |id: usize, x: f64, y: f64| {
                    format!("ID{k},{k},{id},3.3,{x},{},0,{k},{k},5,1\n", -y)
                };
                let tip = p.map_or(String::new(), |[x, y]| spot(7, x, y));
                format!("{tip}ID{k},{k},,3.3,1,2,0,{k},{k},5,1\n{}", spot(2, 250.0, -1.0))
            })
        ),
        Recording { marker: Some("7".into()), ..image },
        "marker = \"7\"\nfps = 64\nscale = 1e-3\n",
    );
    files
}
