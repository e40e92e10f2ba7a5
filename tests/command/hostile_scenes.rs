//! Invalid and hostile scenes: each is rejected with exit code 2 and the name of the fault.

use crate::folder::{SCENE, replaced};
use crate::hostile::{Case, all_are_answered};

const LENGTH: &str = "length = 0.5";
const SHAPE: &str = "{ kind = \"straight\", length = 0.5, direction = [1, 0, 0] }";
const SECTION: &str = "{ kind = \"circle\", radius = 0.005 }";
const GRAVITY: &str = "gravity = [0, -9.8, 0]";
const TIME: &str = "[time]";

/// A part of the scene, its replacement, and words of the message.
const SCENES: &[(&str, &str, &[&str])] = &[
    // Numbers of the wrong kind.
    ("segments = 20", "segments = 20.5", &["scene.toml", "line 3", "20.5"]),
    ("segments = 20", "segments = 1e3", &["scene.toml", "line 3"]),
    ("segments = 20", "segments = 99999999999999999999", &["scene.toml", "line 3"]),
    ("segments = 20", "segments = true", &["scene.toml", "line 3"]),
    ("segments = 20", "segments = [20]", &["scene.toml", "line 3"]),
    ("segments = 20", "segments = 20\nsegments = 30", &["scene.toml", "line 4", "segments"]),
    (LENGTH, "length = nan", &["rod.shape.length", "NaN"]),
    (LENGTH, "length = inf", &["rod.shape.length", "inf"]),
    (LENGTH, "length = -inf", &["rod.shape.length", "-inf"]),
    (LENGTH, "length = \"0.5\"", &["scene.toml", "string"]),
    (LENGTH, "length = 0", &["rod.shape.length", "found 0"]),
    (LENGTH, "length = -0.0", &["rod.shape.length", "found -0"]),
    (LENGTH, "length = 1e-320", &["scene.toml"]),
    ("[1, 0, 0]", "[1, 0]", &["scene.toml", "line 4"]),
    ("[1, 0, 0]", "[nan, 0, 0]", &["rod.shape.direction", "NaN"]),
    ("[1, 0, 0]", "[inf, 0, 0]", &["rod.shape.direction", "inf"]),
    ("[1, 0, 0]", "[\"x\", 0, 0]", &["scene.toml", "line 4"]),
    ("[1, 0, 0]", "\"x\"", &["scene.toml", "line 4"]),
    ("[1, 0, 0]", "[1e200, 1e200, 0]", &["rod.shape.direction"]),
    ("density = 1273.52", "density = 0", &["material.density", "found 0"]),
    ("density = 1273.52", "density = -1", &["material.density", "found -1"]),
    ("density = 1273.52", "density = nan", &["material.density", "NaN"]),
    ("density = 1273.52", "density = \"steel\"", &["scene.toml", "string"]),
    ("density = 1273.52", "density = 1e-320", &["scene.toml"]),
    ("= 1e8", "= -1e8", &["material.youngs_modulus", "-1"]),
    ("= 1e8", "= nan", &["material.youngs_modulus", "NaN"]),
    ("= 1e8", "= inf", &["material.youngs_modulus", "inf"]),
    ("= 1e8", "= 1e-320", &["scene.toml"]),
    ("= 1e8", "= \"soft\"", &["scene.toml", "string"]),
    ("poisson_ratio = 0.5", "poisson_ratio = nan", &["material.poisson_ratio", "NaN"]),
    ("poisson_ratio = 0.5", "poisson_ratio = inf", &["material.poisson_ratio", "inf"]),
    ("poisson_ratio = 0.5", "poisson_ratio = 0.50001", &["material.poisson_ratio", "0.50001"]),
    ("poisson_ratio = 0.5", "shear_modulus = 0", &["material.shear_modulus", "found 0"]),
    ("poisson_ratio = 0.5", "shear_modulus = nan", &["material.shear_modulus", "NaN"]),
    // Sections.
    (SECTION, "{ kind = \"circle\" }", &["scene.toml", "radius"]),
    (SECTION, "{ radius = 0.005 }", &["scene.toml", "kind"]),
    (SECTION, "0.005", &["scene.toml", "line 5"]),
    (SECTION, "{ kind = \"circle\", radius = \"5 mm\" }", &["scene.toml", "line 5"]),
    (SECTION, "{ kind = \"circle\", radius = 1e200 }", &["scene.toml", "section"]),
    (SECTION, "{ kind = \"rectangle\", height = 0.01, up = [0, 1, 0] }", &["width"]),
    (
        SECTION,
        "{ kind = \"rectangle\", width = 0, height = 0.01, up = [0, 1, 0] }",
        &["rod.section.width", "found 0"],
    ),
    (
        SECTION,
        "{ kind = \"rectangle\", width = 0.01, height = inf, up = [0, 1, 0] }",
        &["rod.section.height", "inf"],
    ),
    (
        SECTION,
        "{ kind = \"rectangle\", width = 0.01, height = 0.01, up = [1, 0, 0] }",
        &["rod.section.up"],
    ),
    (
        SECTION,
        "{ kind = \"rectangle\", width = 0.01, height = 0.01, up = [0, 0, 0] }",
        &["rod.section.up"],
    ),
    (
        SECTION,
        "{ kind = \"custom\", area = nan, i1 = 1e-9, i2 = 1e-9, j = 1e-9, up = [0, 1, 0] }",
        &["rod.section.area", "NaN"],
    ),
    (
        SECTION,
        "{ kind = \"custom\", area = 1e-4, i1 = -1e-9, i2 = 1e-9, j = 1e-9, up = [0, 1, 0] }",
        &["rod.section.i1", "-"],
    ),
    // Shapes.
    (SHAPE, "{ kind = \"straight\" }", &["scene.toml", "length"]),
    (SHAPE, "\"straight\"", &["scene.toml", "line 4"]),
    (SHAPE, "{ kind = \"arc\", length = 0, angle = 1 }", &["rod.shape.length", "found 0"]),
    (SHAPE, "{ kind = \"arc\", length = 0.5, angle = nan }", &["rod.shape.angle", "NaN"]),
    (SHAPE, "{ kind = \"arc\", length = 0.5 }", &["scene.toml", "angle"]),
    (
        SHAPE,
        "{ kind = \"arc\", length = 0.5, angle = 1e9 }",
        &["rod.segments", "found 20", "half a turn"],
    ),
    (
        SHAPE,
        "{ kind = \"helix\", length = 0.5, radius = 0, pitch = 0.05, axis = [0, 0, 1], handedness = \"left\" }",
        &["rod.shape.radius", "found 0"],
    ),
    (
        SHAPE,
        "{ kind = \"helix\", length = 0.5, radius = 0.02, pitch = -1, axis = [0, 0, 1], handedness = \"left\" }",
        &["rod.shape.pitch", "found -1"],
    ),
    (
        SHAPE,
        "{ kind = \"helix\", length = 0.5, radius = 0.02, pitch = 0.05, axis = [0, 0, 0], handedness = \"left\" }",
        &["rod.shape.axis", "non-zero"],
    ),
    (
        SHAPE,
        "{ kind = \"helix\", length = 0.5, radius = 0.02, pitch = 0.05, axis = [0, 0, 1], handedness = \"up\" }",
        &["scene.toml", "left", "right"],
    ),
    (
        SHAPE,
        "{ kind = \"helix\", length = 0.5, radius = 1e-200, pitch = 1e-200, axis = [0, 0, 1], handedness = \"left\" }",
        &["rod.segments", "found 20", "half a turn"],
    ),
    ("segments = 20\nshape = {", "shape = { kind = \"polyline\" } #", &["scene.toml", "file"]),
    ("segments = 20\nshape = {", "shape = { kind = \"polyline\", file = 3 } #", &["scene.toml"]),
    (
        "segments = 20\nshape = {",
        "shape = { kind = \"polyline\", file = \".\" } #",
        &["allowed: a regular file"],
    ),
    (
        "segments = 20\nshape = {",
        "shape = { kind = \"polyline\", file = \"/dev/zero\" } #",
        &["/dev/zero", "allowed: a regular file"],
    ),
    (
        "segments = 20\nshape = {",
        "shape = { kind = \"polyline\", file = \"scene.toml\" } #",
        &["scene.toml:"],
    ),
    ("segments = 20", "segments = 20\ndimension = \"2d\"", &["`planar`", "`spatial`"]),
    ("segments = 20", "segments = 20\ndiscretization = 1", &["scene.toml", "line 4"]),
    (
        "segments = 20",
        "segments = 20\nnatural_curvature = []",
        &["rod.natural_curvature", "one finite number or more"],
    ),
    ("segments = 20", "segments = 20\nnatural_curvature = \"much\"", &["scene.toml", "a number"]),
    ("segments = 20", "segments = 20\nnatural_twist = nan", &["rod.natural_twist", "NaN"]),
    // Loads.
    (GRAVITY, "gravity = 9.8", &["scene.toml", "line 13"]),
    (GRAVITY, "gravity = \"down\"", &["scene.toml", "line 13"]),
    (GRAVITY, "gravity = [0, -inf, 0]", &["loads.gravity", "inf"]),
    (GRAVITY, "gravity = [[0], [0], [0]]", &["scene.toml", "line 13"]),
    (GRAVITY, "gravty = [0, -9.8, 0]", &["gravty", "gravity"]),
    (GRAVITY, "damping = 3", &["scene.toml", "line 13"]),
    (GRAVITY, "damping = { mass = nan }", &["loads.damping.mass", "NaN"]),
    (GRAVITY, "damping = { stiffness = -1 }", &["loads.damping.stiffness", "-1"]),
    (GRAVITY, "damping = { stiffness = inf }", &["loads.damping.stiffness", "inf"]),
    (GRAVITY, "damping = { viscous = 1 }", &["viscous", "stiffness"]),
    (TIME, "[[loads.point]]\nnode = -1\nforce = [0, 1, 0]\n[time]", &["scene.toml", "tip"]),
    (TIME, "[[loads.point]]\nnode = 1.5\nforce = [0, 1, 0]\n[time]", &["scene.toml", "tip"]),
    (TIME, "[[loads.point]]\nforce = [0, 1, 0]\n[time]", &["scene.toml", "node"]),
    (
        TIME,
        "[[loads.point]]\nnode = \"tip\"\nforce = [nan, 1, 0]\n[time]",
        &["loads.point[0].force", "NaN"],
    ),
    (
        TIME,
        "[[loads.point]]\nnode = \"tip\"\nmoment = [0, 0, inf]\n[time]",
        &["loads.point[0].moment", "inf"],
    ),
    (
        TIME,
        "[[loads.point]]\nnode = 99999999999\nforce = [0, 1, 0]\n[time]",
        &["loads.point[0].node", "99999999999", "0 .. 20"],
    ),
    // Supports.
    (TIME, "[supports]\nstart = \"glued\"\n[time]", &["glued", "`clamped`"]),
    (TIME, "[supports]\nclamp = \"edge\"\n[time]", &["`edge`", "`mid-edge`"]),
    (TIME, "[supports]\nangle = nan\n[time]", &["supports.angle", "NaN"]),
    (TIME, "[supports]\nangle = \"up\"\n[time]", &["scene.toml", "string"]),
    (TIME, "[supports]\nend = \"roller\"\nroller = [0, 0, 0]\n[time]", &["supports.roller"]),
    (TIME, "[supports]\nend = \"roller\"\nroller = [nan, 0, 0]\n[time]", &["supports.roller"]),
    (
        TIME,
        "[[supports.motion]]\nend = \"middle\"\nramp = 1\n[time]",
        &["`middle`", "`start`", "`end`"],
    ),
    (TIME, "[[supports.motion]]\nend = \"start\"\nramp = -1\n[time]", &["supports.motion[0].ramp"]),
    (
        TIME,
        "[[supports.motion]]\nend = \"start\"\nramp = nan\n[time]",
        &["supports.motion[0].ramp"],
    ),
    (
        TIME,
        "[[supports.motion]]\nend = \"start\"\nfrequency = inf\n[time]",
        &["supports.motion[0].frequency"],
    ),
    (
        TIME,
        "[[supports.motion]]\nend = \"start\"\nramp = 1\ndisplacement = [nan, 0, 0]\n[time]",
        &["supports.motion[0].displacement", "NaN"],
    ),
    // The start, the camera, the clock.
    (TIME, "[initial]\nvelocity = [0, nan, 0]\n[time]", &["initial.velocity", "NaN"]),
    (TIME, "[initial]\nangular_velocity = [0, 0, inf]\n[time]", &["initial.angular_velocity"]),
    (TIME, "[initial]\nstate = 1\n[time]", &["scene.toml", "line 16"]),
    (TIME, "[camera]\ntime_offset = nan\n[time]", &["camera.time_offset", "NaN"]),
    (TIME, "[camera]\nzoom = 2\n[time]", &["zoom", "time_offset"]),
    (TIME, "[timing]", &["timing", "time"]),
    ("end = 0.3", "end = 0", &["time.end", "found 0"]),
    ("end = 0.3", "end = nan", &["time.end", "NaN"]),
    ("end = 0.3", "end = inf", &["time.end", "inf"]),
    ("end = 0.3", "end = 1e308", &["time", "1e9 steps"]),
    ("end = 0.3", "end = \"1 s\"", &["scene.toml", "string"]),
    ("step = 2e-3", "step = inf", &["time.step", "inf"]),
    ("step = 2e-3", "step = nan", &["time.step", "NaN"]),
    ("step = 2e-3", "step = -1e-3", &["time.step", "-0.001"]),
    ("step = 2e-3", "step = 1e-320", &["time.step", "1e9 steps"]),
    ("beta = 0.5", "beta = nan", &["time.beta", "NaN"]),
    ("beta = 0.5", "beta = -1", &["time.beta", "-1"]),
    ("beta = 0.5", "scheme = \"\"", &["newmark-beta"]),
    ("beta = 0.5", "scheme = [\"verlet\"]", &["scene.toml"]),
    // The file itself.
    ("[rod]", "[rods]", &["rod"]),
    ("[rod]", "[[rod]]", &["scene.toml"]),
    ("[rod]", "[rod", &["scene.toml", "line 2"]),
    ("[rod]", "[rod]\n\"\" = 1", &["scene.toml", "line 3"]),
    ("[rod]", "[rod]\nshape.kind = \"arc\"", &["scene.toml"]),
    ("[material]", "[rod]", &["scene.toml", "rod"]),
    ("[material]", "material = 1\n[x]", &["scene.toml"]),
    (SCENE, "", &["scene.toml", "rod"]),
    (SCENE, "rod = 1\nmaterial = 2\n", &["scene.toml"]),
    (SCENE, "\u{0}", &["scene.toml", "line 1"]),
    (SCENE, "{\"rod\": {\"segments\": 20}}", &["scene.toml", "line 1"]),
    (SCENE, "# nothing but a comment", &["scene.toml", "rod"]),
];

#[test]
fn faulty_scene_exits_with_2_and_names_the_fault() {
    let case = |(from, to, words): &(&str, &str, &[&'static str])| {
        Case::new(format!("scene: {to}"), &["simulate", "scene.toml"], 2, words)
            .with("scene.toml", replaced(SCENE, from, to))
    };
    all_are_answered(SCENES.iter().map(case).collect(), 100);
}
