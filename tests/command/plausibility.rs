//! Implausible scenes get notes: units other than SI, missing gravity, strains beyond a linear material. Usual scenes
//! get none.

use crate::folder::{Folder, stdout, succeeds};

/// A rod along x with this material and section, and more tables.
fn rod(length: f64, section: &str, density: f64, modulus: f64, more: &str) -> String {
    format!(
        "[rod]\nshape = {{ kind = \"straight\", length = {length}, direction = [1, 0, 0] }}\nsection = {section}\n\
         [material]\ndensity = {density}\nyoungs_modulus = {modulus}\n{more}"
    )
}

const ROUND: &str = "{ kind = \"circle\", radius = 2.5e-3 }";
const WEIGHT: &str = "[loads]\ngravity = [0, -9.81, 0]\n";

/// The codes of the warnings of a command on a scene, on the terminal and in JSON.
fn codes(command: &str, scene: &str) -> Vec<String> {
    let folder = Folder::new();
    folder.write("rod.toml", scene);
    let output = folder.run(&[command, "rod.toml", "--json", "out.json"]);
    succeeds(&output);
    let json = folder.json("out.json");
    let codes = json["warning_codes"].as_array().cloned().unwrap_or_default();
    let codes: Vec<String> = codes.iter().map(|code| code.as_str().unwrap().into()).collect();
    let text = stdout(&output);
    for code in &codes {
        assert!(text.contains(&format!("[{code}]")), "{code}: {text}");
    }
    assert_eq!(text.matches("warning: ").count(), codes.len(), "{text}");
    codes
}

#[test]
fn scene_in_millimetres_is_noted_by_every_command() {
    let flat = "{ kind = \"rectangle\", width = 10, height = 2, up = [0, 1, 0] }";
    let scene = rod(300.0, flat, 1.1, 1.5, "");
    assert_eq!(codes("static", &scene), ["implausible-units", "no-gravity"]);
    assert_eq!(codes("modes", &scene), ["implausible-units"]);
    let moving = rod(300.0, flat, 1.1, 1.5, "[time]\nend = 1\n");
    assert_eq!(codes("simulate", &moving), ["implausible-units", "no-gravity"]);
}

#[test]
fn modulus_in_gigapascals_is_noted_with_the_strain() {
    let scene = rod(0.2, ROUND, 7850.0, 200.0, &format!("{WEIGHT}[time]\nend = 0.1\n"));
    assert_eq!(codes("simulate", &scene), ["implausible-units", "large-strain"]);
    // A plastic of 3000 MPa is a gel in Pa: its weight alone strains it.
    let plastic = rod(0.3, ROUND, 1140.0, 3000.0, &format!("{WEIGHT}[time]\nend = 0.2\n"));
    assert_eq!(codes("simulate", &plastic), ["large-strain"]);
}

/// Supported bars of the same thickness, of which only the longer one is slender.
#[test]
fn thick_bars_are_noted_by_every_command() {
    let ends = format!("[supports]\nstart = \"pinned\"\nend = \"roller\"\n{WEIGHT}");
    let bar = |length: f64, more: &str| rod(length, ROUND, 7850.0, 2e11, &format!("{ends}{more}"));
    for command in ["static", "modes", "simulate"] {
        let more = if command == "simulate" { "[time]\nend = 1e-4\n" } else { "" };
        assert_eq!(codes(command, &bar(0.02, more)), ["thick-rod"], "{command}");
        assert!(codes(command, &bar(0.2, more)).is_empty(), "{command}");
    }
}

/// Silicone strips of 1e5 and 1e6 Pa, a steel bar and a horizontal rod of which nothing is wrong.
#[test]
fn usual_scenes_are_not_noted() {
    let strip = "{ kind = \"rectangle\", width = 0.02, height = 2e-3, up = [0, 1, 0] }";
    for (density, modulus, length) in
        [(1070.0, 1e5, 0.015), (1200.0, 1e6, 0.05), (7850.0, 2e11, 0.5)]
    {
        let scene = rod(length, strip, density, modulus, &format!("{WEIGHT}[time]\nend = 0.05\n"));
        for command in ["static", "simulate", "modes"] {
            assert!(codes(command, &scene).is_empty(), "{command} {scene}");
        }
    }
}

/// Gravity of zero is meant where it is given. It is meant too where something else drives the rod, or the rod is
/// upright, as long as its weight is not noticeable.
#[test]
fn missing_gravity_is_noted_where_it_matters() {
    let of = |more: &str| rod(0.3, ROUND, 1140.0, 1e8, more);
    let time = "[time]\nend = 0.01\n";
    assert_eq!(codes("static", &of("")), ["no-gravity"]);
    assert_eq!(codes("simulate", &of(time)), ["no-gravity"]);
    assert!(codes("static", &of("[loads]\ngravity = [0, 0, 0]\n")).is_empty());
    let force = "[[loads.point]]\nnode = \"tip\"\nforce = [0, -1e-3, 0]\n";
    assert_eq!(codes("static", &of(force)), ["no-gravity"]);
    // The weight of a stiff rod is not noticeable.
    let stiff = |more: &str| rod(0.3, ROUND, 1140.0, 1e11, more);
    assert_eq!(codes("static", &stiff("")), ["no-gravity"]);
    assert!(codes("static", &stiff(force)).is_empty());
    assert!(codes("modes", &of("[supports]\nstart = \"free\"\nend = \"free\"\n")).is_empty());
    for driven in [
        "[initial]\nvelocity = [0, 0.1, 0]\n",
        "[[supports.motion]]\nend = \"start\"\ndisplacement = [0, 1e-3, 0]\nfrequency = 2\n",
        "[initial]\nstate = \"equilibrium\"\n[[initial.point]]\nnode = \"tip\"\nforce = [0, -1e-3, 0]\n",
    ] {
        let noted = |scene: &str| codes("simulate", scene).iter().any(|code| code == "no-gravity");
        assert!(!noted(&stiff(&format!("{driven}{time}"))), "{driven}");
        assert!(noted(&of(&format!("{driven}{time}"))), "{driven}");
    }
    let upright = |scene: String| scene.replace("[1, 0, 0]", "[0, 1, 0]");
    assert!(codes("static", &upright(stiff(""))).is_empty());
    assert_eq!(codes("static", &upright(of(""))), ["no-gravity"]);
}
