//! The sequence of models of the example `recorded_cables`, each with one more effect.

#[path = "../../examples/recorded_cables/cable.rs"]
#[allow(dead_code, reason = "the example uses more of it")]
mod cable;
#[path = "../../examples/recorded_cables/models.rs"]
#[allow(dead_code, reason = "the example uses more of it")]
mod models;

use cable::Cable;
use models::{Found, begin, kept, ladder, scene_of};

/// A model starts at the estimates of a simpler one, except for those at zero: the logarithm of a positive number would stay
/// there. The drag of a straight cable may be zero, and that of a curved one not.
#[test]
fn damping_at_zero_is_raised_on_a_refined_mesh() {
    let cable =
        Cable { name: "any".into(), clips: Vec::new(), table: None, lengths: vec![0.07; 6] };
    let found = |list: &[(&str, f64)]| -> Found {
        list.iter().map(|(name, x)| ((*name).to_string(), *x)).collect()
    };
    let b3 = [("youngs_modulus", 3e8), ("damping.stiffness", 0.02)];
    for drag in [0.0, 1e-12, 0.3] {
        let before = found(&[&b3[..], &[("damping.mass", drag)]].concat());
        let from = kept(&before);
        let expected = if drag == 0.3 { 0.3 } else { 0.2 };
        assert_eq!(begin("damping.mass", &from), Some(expected));
        // The value of the simpler model.
        assert_eq!(begin("youngs_modulus", &from), Some(3e8));
        // What no simpler model had has a start of its own.
        assert_eq!(begin("shear_modulus", &from), Some(5e7));
        for rung in ladder(7, 1).iter().filter(|rung| ["B3", "T7", "T10"].contains(&rung.name)) {
            let scene = scene_of(&cable, rung, &from).unwrap();
            let damping = scene.loads.damping;
            // Positive values continue; zero and tiny ones start at the default 0.2.
            assert_eq!((damping.mass, damping.stiffness), (expected, 0.02), "{}", rung.name);
            assert_eq!(scene.material.youngs_modulus, 3e8);
        }
    }
    // The first model scans the modulus.
    assert_eq!(begin("youngs_modulus", &Found::new()), None);
}
