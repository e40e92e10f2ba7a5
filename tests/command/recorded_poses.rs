//! Tables of positions and rotations of grippers: forms of the rotation, names and units of columns, and rejected
//! files.

use crate::common::poses::quaternion;
use crate::folder::{Folder, refused, replaced, stdout, succeeds};

const SCENE: &str = r#"
[rod]
segments = 10
dimension = "spatial"
shape = { kind = "straight", length = 0.3, direction = [1, 0, 0] }
section = { kind = "circle", radius = 0.002 }
[material]
density = 1270
youngs_modulus = 1e7
poisson_ratio = 0.4
[supports]
end = "clamped"
[[supports.motion]]
end = "end"
file = "robot.csv"
pose = { offset = [0.01, 0, 0] }
[initial]
state = "equilibrium"
[loads]
gravity = [0, 0, -9.8]
[time]
end = 0.2
step = 2e-3
scheme = "generalised-alpha"
"#;

/// Rotation vector, rad, and place, m, of the gripper at a frame.
fn at(k: u32) -> ([f64; 3], [f64; 3]) {
    let t = f64::from(k) * 0.01;
    ([0.8 * (6.0 * t).sin(), 0.2 * t, 0.3 * (5.0 * t).sin()], [0.27 - 0.1 * t, 0.02 * t, 0.01])
}

/// A table of 31 frames by its header and the row of each frame.
fn table(header: &str, row: impl Fn(f64, [f64; 3], [f64; 3]) -> String) -> String {
    let line = |k: u32| {
        let (turn, place) = at(k);
        row(f64::from(k) * 0.01, turn, place) + "\n"
    };
    format!("{header}\n{}", (0..=30).map(line).collect::<String>())
}

/// The table with quaternions.
fn quaternions() -> String {
    table("t,x,y,z,qw,qx,qy,qz", |t, turn, [x, y, z]| {
        let [a, b, c, d] = quaternion(turn);
        format!("{t},{x},{y},{z},{a},{b},{c},{d}")
    })
}

/// Tip coordinates of the run of a scene with this table.
fn tip(scene: &str, csv: &str) -> Vec<f64> {
    let folder = Folder::new();
    folder.write("posed.toml", scene);
    folder.write("robot.csv", csv);
    succeeds(&folder.run(&["simulate", "posed.toml", "--json", "run.json"]));
    let report = folder.json("run.json");
    let last = report["tip"].as_array().unwrap().last().unwrap().as_array().unwrap();
    last.iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Requires that a simulation of the scene with this table is rejected with all words.
fn is_refused(scene: &str, csv: &str, words: &[&str]) {
    let folder = Folder::new();
    folder.write("posed.toml", scene);
    folder.write("robot.csv", csv);
    refused(&folder.run(&["simulate", "posed.toml"]), words);
}

#[test]
fn all_forms_of_a_rotation_give_the_same_motion() {
    let expected = tip(SCENE, &quaternions());
    let same = |name: &str, scene: &str, csv: &str| {
        let found = tip(scene, csv);
        let off = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{name}: {off:e}");
        assert!(off < 1e-9, "{name}: {found:?} {expected:?}");
    };
    // Other columns, order, units and prefix; quaternions with four digits more than the sign need no common sign.
    let csv = table("qz,qy,qx,qw,gripper_width,z[mm],y[mm],x[mm],t[ms]", |t, turn, place| {
        let sign = if (t * 100.0).round() as u32 % 3 == 1 { -1.0 } else { 1.0 };
        let [a, b, c, d] = quaternion(turn).map(|c| c * sign * 1.001);
        let [x, y, z] = place.map(|c| c * 1e3);
        format!("{d},{c},{b},{a},80,{z},{y},{x},{}", t * 1e3)
    });
    same("order and units", SCENE, &csv);
    let csv = table(
        "time,start_x,start_y,start_z,start_rx,start_ry,start_rz,end_x,end_y,end_z,end_rx,end_ry,end_rz",
        |t, [a, b, c], [x, y, z]| format!("{t},1,2,3,0.1,0.2,0.3,{x},{y},{z},{a},{b},{c}"),
    );
    same("rotation vector of one of two grippers", SCENE, &csv);
    let csv = table("t,x,y,z,ux,uy,uz,angle[deg]", |t, turn, [x, y, z]| {
        let angle = turn.iter().map(|c| c * c).sum::<f64>().sqrt();
        let [a, b, c] = if angle == 0.0 { [1.0, 0.0, 0.0] } else { turn.map(|c| c / angle) };
        format!("{t},{x},{y},{z},{a},{b},{c},{}", angle.to_degrees())
    });
    same("axis and angle", SCENE, &csv);
    // Stated columns of a table without a header, whose clock begins before the motion.
    let early = quaternions();
    let rows = early.lines().skip(1).map(|line| {
        let (t, rest) = line.split_once(',').unwrap();
        format!("{},{rest}\n", t.parse::<f64>().unwrap() + 5.0)
    });
    let rows: String = rows.collect();
    let csv = format!("4.5,0.1,0.1,0.1,1,0,0,0\n{rows}");
    let columns = "columns = { t = 1, x = 2, y = 3, z = 4, qw = 5, qx = 6, qy = 7, qz = 8 }\ntime_zero = 5.0\npose =";
    same("columns", &replaced(SCENE, "pose =", columns), &csv);
}

/// An export of Motive with the poses of the gripper as the rigid body `hand`, in mm, beside another body; frame 8 has
/// no pose of that one. `rotation` is the setting, and returns the columns of a rotation vector, rad.
fn motive(setting: &str, columns: &str, rotation: impl Fn([f64; 3]) -> String) -> String {
    let width = columns.split(',').count();
    let repeated = |text: &str, count: usize| format!(",{text}").repeat(count);
    let pose = |name: &str| repeated(name, width + 3);
    let properties = repeated("Rotation", width) + &repeated("Position", 3);
    let header = format!(
        "Format Version,1.23,Take Name,rod,Rotation Type,{setting},Length Units,Millimeters,Coordinate Space,Global\n\n\
         ,Type{}{},Rigid Body\n,Name{}{},hand\n,ID{}{},2\n,{properties}{properties},Mean Marker Error\n\
         Frame,Time (Seconds),{columns},X,Y,Z,{columns},X,Y,Z,",
        pose("Rigid Body"),
        pose("Rigid Body"),
        pose("table"),
        pose("hand"),
        pose("1"),
        pose("2"),
    );
    table(&header, |t, turn, place| {
        let [x, y, z] = place.map(|c| c * 1e3);
        let frame = (t * 100.0).round() as u32;
        let other = match frame {
            8 => ",".repeat(width + 3),
            _ => format!(",{},1,2,3", rotation([0.0; 3])),
        };
        format!("{frame},{t:.9}{other},{},{x},{y},{z},0.1", rotation(turn))
    })
}

/// Angles, deg, of the relative rotations about x, y and z, in this order, with the rotation of a vector, rad.
fn euler(turn: [f64; 3]) -> [f64; 3] {
    let q = quaternion(turn);
    let column = |v| crate::common::poses::rotated(q, v);
    let [a, b, c] = [column([1.0, 0.0, 0.0]), column([0.0, 1.0, 0.0]), column([0.0, 0.0, 1.0])];
    // R_x(p) R_y(h) R_z(r): the first row is (cos h cos r, -cos h sin r, sin h).
    [(-c[1]).atan2(c[2]), c[0].asin(), (-b[0]).atan2(a[0])].map(f64::to_degrees)
}

#[test]
fn rigid_bodies_of_motive_drive_an_end_as_a_table_does() {
    let expected = tip(SCENE, &quaternions());
    let scene = replaced(SCENE, "pose = {", "pose = { body = \"Hand\",");
    let quaternion_file = motive("Quaternion", "X,Y,Z,W", |turn| {
        let [w, x, y, z] = quaternion(turn);
        format!("{x},{y},{z},{w}")
    });
    let euler_file = motive("XYZ", "X,Y,Z", |turn| {
        let [x, y, z] = euler(turn);
        format!("{x},{y},{z}")
    });
    for (name, csv) in [("quaternion", &quaternion_file), ("angles", &euler_file)] {
        let found = tip(&scene, csv);
        let off = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{name}: {off:e}");
        assert!(off < 1e-9, "{name}: {found:?} {expected:?}");
    }
    is_refused(SCENE, &quaternion_file, &["robot.csv:1: ", "the key body", "table, hand"]);
    let other = replaced(SCENE, "pose = {", "pose = { body = \"foot\",");
    is_refused(&other, &quaternion_file, &["robot.csv:1: ", "`foot`", "table, hand"]);
    is_refused(&scene, &quaternions(), &["robot.csv:1: ", "body = \"Hand\"", "Motive"]);
    let local = quaternion_file.replace("Space,Global", "Space,Local");
    is_refused(&scene, &local, &["robot.csv:1: ", "Coordinate Space `Local`", "Global"]);
    let partial = quaternion_file.replacen(",1,2,3,", ",1,,3,", 1);
    is_refused(&scene, &partial, &["robot.csv:8: ", "`table`", "1 of 7 numbers blank"]);
}

#[test]
fn invalid_poses_are_refused_with_file_line_and_allowed_values() {
    let ok = quaternions();
    let line = |k: usize, text: &str| {
        let mut lines: Vec<&str> = ok.lines().collect();
        lines[k] = text;
        lines.join("\n")
    };
    let near = "0.03,0.267,0.0006,0.01";
    for (text, words) in [
        ("0,0,0,0", "quaternion of the length 0, allowed: 0.99 .. 1.01"),
        ("0.5,0.5,0.5,0.4", "quaternion of the length 0.95"),
        ("nan,0,0,0", "found a pose without `qw`"),
        ("1,,0,0", "found a pose without `qx`"),
        ("0,1,0,0", "a rotation by 1"),
        ("1e200,1e200,0,0", "quaternion of the length inf"),
        ("one,0,0,0", "one"),
    ] {
        is_refused(SCENE, &line(4, &format!("{near},{text}")), &["robot.csv:5", words, "allowed"]);
    }
    is_refused(
        SCENE,
        &line(4, "0.03,1e300,0,0,1,0,0,0"),
        &["robot.csv:5", "coordinate 1", "allowed"],
    );
    is_refused(SCENE, &line(4, "0.01,0.26,0,0,1,0,0,0"), &["robot.csv:5", "increasing"]);
    is_refused(SCENE, &line(4, ",0.26,0,0,1,0,0,0"), &["robot.csv:5", "blank time"]);
    is_refused(
        SCENE,
        &line(1, "0.001,0.27,0,0.01,1,0,0,0"),
        &["robot.csv:2", "first time", "time_zero"],
    );
    is_refused(SCENE, "t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n", &["found 1 poses", "at least two"]);
    is_refused(SCENE, "t,x,y,z,qw,qx,qy,qz\n", &["robot.csv"]);
    for (header, words) in [
        ("t,x,y,qw,qx,qy,qz,z2", "x, y, z of the position"),
        ("t,x,y,z,qw,qx,qy,a", "one form of the rotation"),
        ("t,x,y,z,a,b,c,d", "one form of the rotation"),
        ("t,x,y,z,qw,qx,qy,qz,rx", "one form of the rotation"),
        ("s,x,y,z,qw,qx,qy,qz", "no column `t`"),
        ("t,x,y,z,rx[m],ry,rz,d", "unit [m] of `rx`"),
        ("t,x[rad],y,z,rx,ry,rz,d", "unit [rad] of `x`"),
    ] {
        let row = vec!["0"; header.split(',').count()].join(",");
        is_refused(SCENE, &format!("{header}\n{row}\n{row}\n"), &["robot.csv:1", words]);
    }
    let blanks: String = (1..30).map(|k| format!("{},,,,,,,\n", f64::from(k) * 0.01)).collect();
    let gap =
        format!("t,x,y,z,qw,qx,qy,qz\n0,0.27,0,0.01,1,0,0,0\n{blanks}0.3,0.27,0,0.01,0,1,0,0\n");
    is_refused(SCENE, &gap, &["robot.csv:32", "a rotation by 180 deg", "up to 90 deg"]);
}

#[test]
fn scenes_in_which_a_pose_has_no_effect_or_no_place_are_refused() {
    for (from, to, words) in [
        ("file = \"robot.csv\"\n", "", &["supports.motion[0].pose", "no recording of a pose"][..]),
        ("end = \"clamped\"", "end = \"pinned\"", &["supports.motion[0].pose", "not clamped"]),
        ("end = \"clamped\"", "end = \"free\"", &["supports.motion[0].pose", "not clamped"]),
        ("dimension = \"spatial\"", "dimension = \"planar\"", &["supports.motion[0].pose"]),
        (
            "state = \"equilibrium\"",
            "state = \"rest\"",
            &["supports.motion[0].pose", "initial.state = \"equilibrium\""],
        ),
        (
            "offset = [0.01, 0, 0]",
            "axes = [\"x\", \"y\", \"none\"]",
            &["supports.motion[0].pose.axes", "none"],
        ),
        ("offset = [0.01, 0, 0]", "axes = [\"x\", \"y\", \"-z\"]", &["mirror image"]),
        ("offset = [0.01, 0, 0]", "offset = [0.01, 0]", &["offset"]),
        ("offset = [0.01, 0, 0]", "offset = [nan, 0, 0]", &["offset", "finite"]),
        ("pose = { offset = [0.01, 0, 0] }", "", &["robot.csv:1"]),
        ("scheme = \"generalised-alpha\"", "scheme = \"verlet\"", &["supports.motion", "verlet"]),
        ("end = 0.2", "end = 0.4", &["time.end", "robot.csv ends"]),
        (
            "[initial]",
            "[supports.path]\nfile = \"clip.csv\"\ninner = [\"A\"]\n[initial]",
            &["supports.motion[0].pose", "supports.path"],
        ),
        (
            "[initial]",
            "[[supports.motion]]\nend = \"end\"\nfile = \"robot.csv\"\npose = {}\n[initial]",
            &["supports.motion[1].pose", "second"],
        ),
    ] {
        let folder = Folder::new();
        folder.write("posed.toml", &replaced(SCENE, from, to));
        folder.write("robot.csv", &quaternions());
        folder.write(
            "clip.csv",
            "t,xA,yA,zA,xB,yB,zB,xC,yC,zC\n0,0,0,0,0.1,0,0,0.3,0,0\n1,0,0,0,0.1,0,0,0.3,0,0\n",
        );
        println!("{to}");
        refused(&folder.run(&["simulate", "posed.toml"]), words);
    }
}

/// Missing frames are interpolated, with a warning where the motion is fast; a recording of slow motion needs none.
#[test]
fn missing_poses_and_jumps_are_reported() {
    let warned = |csv: &str| {
        let folder = Folder::new();
        folder.write("posed.toml", SCENE);
        folder.write("robot.csv", csv);
        let output = folder.run(&["simulate", "posed.toml"]);
        succeeds(&output);
        stdout(&output)
    };
    assert!(!warned(&quaternions()).contains("missing-frames"));
    let blank = |line: &str| {
        let (t, _) = line.split_once(',').unwrap();
        format!("{t},,,,,,,")
    };
    let last = quaternions()
        .lines()
        .enumerate()
        .map(|(k, line)| if k > 28 { blank(line) } else { line.into() } + "\n")
        .collect::<String>();
    let shown = warned(&last);
    assert!(shown.contains("[missing-frames]") && shown.contains("robot.csv"), "{shown}");
}
