//! Options that would have no effect, and recordings without the needed lengths, are rejected by name.

use crate::folder::{Folder, change, refused};

#[test]
fn predict_options_of_motions_are_refused_for_shapes_at_rest() {
    let folder = Folder::new();
    folder.write("still.toml", &change("[time]\nend = 0.3\nstep = 2e-3\nbeta = 0.5\n", ""));
    folder.write("rest.csv", "s,x,y\n0.1,0.1,-0.001\n0.3,0.299,-0.009\n0.5,0.498,-0.02\n");
    let given = [("--point", "tip"), ("--marker", "a"), ("--time-zero", "1"), ("--fps", "100")];
    for (option, value) in given {
        let arguments = ["predict", "still.toml", option, value, "--on", "rest.csv"];
        refused(&folder.run(&arguments), &[option, "without [time]", "--scale"]);
    }
}

#[test]
fn length_of_a_cable_template_is_refused() {
    let folder = Folder::new();
    let output = folder.run(&["init", "cable", "--length", "0.4"]);
    refused(&output, &["--length", "found 0.4", "between its markers"]);
    assert!(!folder.path("cable.toml").exists());
}

#[test]
fn cable_markers_without_a_common_frame_are_refused() {
    let folder = Folder::new();
    // Marker c is seen in the even frames, its neighbor d in the odd ones.
    let row = |k: u32| {
        let (t, x) = (f64::from(k) * 0.01, f64::from(k) * 1e-3);
        let [c, d] = [0.2 + x, 0.3 + x];
        let pair = if k.is_multiple_of(2) { format!("{c},0,,") } else { format!(",,{d},0") };
        format!("{t},{x},0,{},0,{pair},{},0\n", 0.1 + x, 0.4 + x)
    };
    let rows: String = (0..20).map(row).collect();
    folder.write("clip.csv", &format!("t,xa,ya,xb,yb,xc,yc,xd,yd,xe,ye\n{rows}"));
    let output = folder.run(&["init", "cable", "--from", "clip.csv"]);
    refused(&output, &["--from", "markers c and d", "no common frame"]);
    assert!(!folder.path("cable.toml").exists());
}
