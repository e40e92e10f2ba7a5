//! Detection of frames in which a tracker lost the marker and wrote a constant, such as (0, 0) or -1, as its position.
//!
//! Input: positions in the order of time. The placeholder is the position that occurs most often, at least twice,
//! exactly. Steps between it and other positions must all exceed [`FAR`] times the largest step between other
//! positions, and in one place at least the marker is found again near where it was lost. Frames without a position do
//! not count. Output: the placeholder with its number of frames (`placeholder_frames`), or the refusal of a recorded
//! motion that has one ([`refuse_placeholder_frames`]).

use crate::error::Error;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::dataset::DataKind;
use crate::numerics::vector::{norm, sub};

/// Smallest step to or from a placeholder, over the largest step between other positions. Smaller: positions of fast
/// motions are taken for placeholders.
const FAR: f64 = 3.0;
/// Largest distance between the positions before and after a placeholder, over those from it. Larger: rods that move
/// from one place of rest to another are taken for lost ones.
const NEAR: f64 = 0.5;
/// Smallest number of steps between other positions.
const ENOUGH: usize = 5;

/// Rejects a recorded motion with a placeholder; `label` is that of the observation. Planned ones are not examined.
pub(crate) fn refuse_placeholder_frames(
    measurement: &Measurement,
    label: &str,
) -> Result<(), Error> {
    let Some(motion) = measurement.motion().filter(|_| !measurement.planned()) else {
        return Ok(());
    };
    let positions = motion.positions();
    let Some((position, lost)) = placeholder_frames(&positions) else { return Ok(()) };
    let place = position.iter().flatten().map(|x| format!("{x:.4}")).collect::<Vec<_>>().join(", ");
    let frames = positions.len();
    let found = format!(
        "the position ({place}) m in {lost} of {frames} frames, far from those before and after"
    );
    let allowed = "an empty cell where the marker is lost: trackers write (0, 0) or -1 there";
    Err(Error::invalid(label, found, allowed))
}

/// The placeholder of lost frames and the number of frames with it; `None` without one.
fn placeholder_frames(positions: &[[Option<f64>; 3]]) -> Option<([Option<f64>; 3], usize)> {
    let seen: Vec<_> = positions.iter().filter(|own| own.iter().any(Option::is_some)).collect();
    let bits = |own: &[Option<f64>; 3]| own.map(|x| x.map(f64::to_bits));
    let mut counts = std::collections::BTreeMap::new();
    for own in &seen {
        *counts.entry(bits(own)).or_insert(0) += 1;
    }
    let (most, lost) =
        counts.into_iter().max_by_key(|(_, count)| *count).filter(|own| own.1 > 1)?;
    let is_lost = |own: &[Option<f64>; 3]| bits(own) == most;
    let place = |own: &[Option<f64>; 3]| own.map(Option::unwrap_or_default);
    let step = |a, b| norm(sub(place(a), place(b)));
    // Steps to or from the placeholder, and all others.
    let (mut far, mut near) = (f64::INFINITY, 0.0_f64);
    let mut others = 0;
    for pair in seen.windows(2) {
        match [is_lost(pair[0]), is_lost(pair[1])] {
            [true, true] => {}
            [false, false] => {
                near = near.max(step(pair[0], pair[1]));
                others += 1;
            }
            _ => far = far.min(step(pair[0], pair[1])),
        }
    }
    // A marker that is found again near where it was lost has not moved to the placeholder.
    let returns = seen.chunk_by(|a, b| is_lost(a) == is_lost(b)).collect::<Vec<_>>();
    let is_back = returns.windows(3).any(|runs| match (runs[0].last(), runs[1][0], runs[2][0]) {
        (Some(before), own, after) => {
            is_lost(own) && step(before, after) < NEAR * step(own, before).min(step(own, after))
        }
        _ => false,
    });
    let position = *seen.iter().find(|own| is_lost(own)).copied()?;
    (others >= ENOUGH && far > FAR * near && is_back).then_some((position, lost))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A swing of 40 frames in which some frames have another position.
    fn swing(lost: &[usize], placeholder: [f64; 2]) -> Vec<[Option<f64>; 3]> {
        let frame = |k: usize| {
            let angle = 0.2 * k as f64;
            let [x, y] =
                if lost.contains(&k) { placeholder } else { [0.3, 0.05 * angle.cos() - 0.1] };
            [Some(x), Some(y), None]
        };
        (0..40).map(frame).collect()
    }

    #[test]
    fn lost_frames_are_found_and_motions_are_not() {
        for lost in [vec![7, 8], vec![7, 20, 21, 39], vec![0, 1, 12]] {
            let found = placeholder_frames(&swing(&lost, [-0.2, 0.4]));
            assert_eq!(found, Some(([Some(-0.2), Some(0.4), None], lost.len())), "{lost:?}");
        }
        assert_eq!(placeholder_frames(&swing(&[], [0.0; 2])), None);
        // One frame may be a glitch of another kind.
        assert_eq!(placeholder_frames(&swing(&[7], [-0.2, 0.4])), None);
        // A position that the marker passes.
        assert_eq!(placeholder_frames(&swing(&[7, 20], [0.3, -0.1])), None);
        // A rod at rest that jumps to another place.
        let rests = |k: usize| [Some(if k < 20 { 0.0 } else { 1.0 }), Some(1e-9 * k as f64), None];
        let mut frames: Vec<_> = (0..40).map(rests).collect();
        assert_eq!(placeholder_frames(&frames), None);
        frames[..20].fill([Some(0.0), Some(0.0), None]);
        assert_eq!(placeholder_frames(&frames), None);
        assert_eq!(placeholder_frames(&[]), None);
    }
}
