//! What goes wrong in recordings of markers: frames that are lost, labels that change places, and markers
//! that jump for a frame. All of it is found and told, and mended only where that is asked for.

use crate::numerics::vector::{Vector, components, dot, sub};
use crate::scene::fault::{Fault, JUMP};
use crate::scene::track::{Marker, Track};
use serde::{Deserialize, Serialize};

/// Frames looked at on each side of a gap, and the most that are looked for in it.
const BESIDE: usize = 3;
const LONGEST: usize = 12;
/// By how much a gap must fit better than none, in sums of squares.
const BETTER: f64 = 10.0;
/// By how much one of both must fit a single marker better, in RMS, to decide between them.
const DECISIVE: f64 = 2.0;
/// Markers that must jump by lost frames at least: one alone has slipped.
const FEWEST_JUMPING: usize = 2;
/// What fits to this, m, has no gap: cameras see no better.
const SEEN: f64 = 2e-5;
/// By how much a marker must be farther than one that should be beyond it: by less, edges only differ.
const FARTHER: f64 = 1.15;
/// Frames that a jump spoils, on each side of it.
const SPOILED: usize = 2;

/// Treatment of lost frames, where the clock of a recording continued without a gap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum LostFrames {
    /// Lost frames are reported only.
    #[default]
    Keep,
    /// The clock is corrected: later frames are later by the number of lost frames.
    Stretch,
}

/// Treatment of exchanged labels of neighboring markers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum SwappedLabels {
    /// Exchanged labels are reported only.
    #[default]
    Keep,
    /// Each gets the place of the other.
    Mend,
}

impl Track {
    /// The recording with what is wrong in it [told](Self::faults), and mended as these say; `held` are the
    /// markers that lead an end.
    pub(crate) fn examined(
        &self,
        held: &[usize],
        lost: LostFrames,
        swapped: SwappedLabels,
    ) -> Self {
        let mut faults = Vec::new();
        let order = self.order();
        for (j, other) in order.iter().enumerate().filter(|(j, other)| *j < **other) {
            let markers = [j, *other].map(|k| self.markers()[k].name.clone());
            faults.push(Fault::SwappedLabels { markers, mended: swapped == SwappedLabels::Mend });
        }
        // Of the rod's own order, whatever is done about it.
        let places: Vec<&Marker> = order.iter().map(|j| &self.markers()[*j]).collect();
        let held: Vec<&Marker> = held.iter().map(|j| places[*j]).collect();
        let gaps = self.gaps(&held);
        for (frame, steps) in &gaps {
            faults.push(Fault::LostFrames {
                time: self.times()[*frame],
                frames: steps - 1,
                mended: lost == LostFrames::Stretch,
            });
        }
        for (j, marker) in places.iter().enumerate() {
            let beside = [j.checked_sub(1), Some(j + 1)].into_iter().flatten();
            let beside: Vec<&Marker> = beside.filter_map(|j| places.get(j).copied()).collect();
            let frames = self.jumps(marker, &beside, &gaps);
            if !frames.is_empty() {
                let times = frames.iter().map(|k| self.times()[*k]).collect();
                faults.push(Fault::Glitches { marker: marker.name.clone(), frames, times });
            }
        }
        let mut times = self.times().to_vec();
        if lost == LostFrames::Stretch {
            let between = self.usual_step();
            for (frame, steps) in &gaps {
                times[frame + 1..].iter_mut().for_each(|t| *t += (steps - 1) as f64 * between);
            }
        }
        let name = |j: usize| self.markers()[j].name.clone();
        let markers = places.iter().enumerate().map(|(j, place)| match swapped {
            SwappedLabels::Keep => (name(j), self.markers()[j].seen.clone()),
            SwappedLabels::Mend => (name(j), place.seen.clone()),
        });
        // As many sightings as before: it cannot fail.
        let mended = Self::new(times, markers.collect()).unwrap_or_else(|_| self.clone());
        mended.with_faults(faults)
    }

    /// The marker that is at each place along the rod. Two neighbours are taken for swapped where the
    /// farther of them is mostly nearer to the marker before.
    fn order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.markers().len()).collect();
        // A marker beyond its neighbour is farther by an edge.
        let nearer = |from: usize, far: usize, near: usize| {
            let both = (self.distance(from, far), self.distance(from, near));
            matches!(both, (Some(far), Some(near)) if far > FARTHER * near)
        };
        for j in 1..order.len().saturating_sub(1) {
            if nearer(order[j - 1], order[j], order[j + 1]) {
                order.swap(j, j + 1);
            }
        }
        // The first two have no neighbour before them; the one behind them is in its place by now.
        if order.len() > 2 && nearer(order[2], order[1], order[0]) {
            order.swap(0, 1);
        }
        order
    }

    /// The median distance between two markers, m.
    fn distance(&self, a: usize, b: usize) -> Option<f64> {
        let pairs = self.markers()[a].seen.iter().zip(&self.markers()[b].seen);
        let mut all: Vec<f64> = pairs.filter_map(|(a, b)| Some(norm(sub((*a)?, (*b)?)))).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied()
    }

    /// Where frames are missing: the frame before, and how many steps the way to the next one is. There
    /// the way of the held markers is smooth with a gap, and not without.
    fn gaps(&self, held: &[&Marker]) -> Vec<(usize, usize)> {
        let frames = self.times().len();
        let mut gaps: Vec<(usize, usize, f64)> = Vec::new();
        let mut ways: Vec<Frames> = Vec::new();
        for before in BESIDE - 1..frames.saturating_sub(BESIDE) {
            let first = before + 1 - BESIDE;
            ways.clear();
            ways.extend(held.iter().filter_map(|m| ways_of(&m.seen[first..])).flatten());
            if ways.len() < 3 * held.len() {
                continue;
            }
            let roughness = |steps: usize| rms_residual(&self.cubics(first, steps), &ways);
            let here = roughness(1);
            if here <= SEEN {
                continue;
            }
            let best = (2..=LONGEST).map(|m| (m, roughness(m))).min_by(|a, b| a.1.total_cmp(&b.1));
            let found = best.filter(|(steps, rough)| {
                here >= BETTER.sqrt() * rough && self.most_markers_jump(first, *steps)
            });
            if let Some((steps, rough)) = found {
                let better = here / rough.max(f64::MIN_POSITIVE);
                match gaps.last_mut() {
                    // Windows beside a gap see it too.
                    Some(last) if last.0 + 1 == before => {
                        if better > last.2 {
                            *last = (before, steps, better);
                        }
                    }
                    _ => gaps.push((before, steps, better)),
                }
            }
        }
        gaps.into_iter().map(|(before, steps, _)| (before, steps)).collect()
    }

    /// Orthonormal cubics over the window of frames from `first` on, in whose middle the clock makes so many steps.
    fn cubics(&self, first: usize, steps: usize) -> [Frames; 4] {
        let (between, before) = (self.usual_step(), first + BESIDE - 1);
        let time = |k: usize| {
            let t = (self.times()[k] - self.times()[before]) / between;
            if k > before { t + (steps - 1) as f64 } else { t }
        };
        cubics(&components(|k| time(first + k)))
    }

    /// Whether most markers, free ones too, jump by so many steps in the middle of the window of frames from `first` on.
    /// A marker that slips, or was reconstructed elsewhere, jumps alone, and the others go on evenly. Markers at rest count
    /// for neither.
    fn most_markers_jump(&self, first: usize, steps: usize) -> bool {
        let [even, lost] = [1, steps].map(|steps| self.cubics(first, steps));
        let (mut jumping, mut going_on) = (0, 0);
        for marker in self.markers() {
            let Some(ways) = ways_of(&marker.seen[first..]) else { continue };
            let [without, with] = [even, lost].map(|basis| rms_residual(&basis, &ways));
            if without > SEEN && without >= DECISIVE * with {
                jumping += 1;
            } else if with > SEEN && with >= DECISIVE * without {
                going_on += 1;
            }
        }
        jumping >= FEWEST_JUMPING && jumping > going_on
    }

    /// The frames in which a marker jumps and those beside it on the rod do not, which a whip takes along;
    /// away from lost frames.
    fn jumps(&self, marker: &Marker, beside: &[&Marker], gaps: &[(usize, usize)]) -> Vec<usize> {
        let near = |k: usize| gaps.iter().any(|(frame, _)| frame.abs_diff(k) <= SPOILED);
        let jumps = |k: &usize| {
            second(marker, *k) > JUMP
                && beside.iter().all(|other| second(other, *k) < 0.5 * JUMP)
                && !near(*k)
        };
        (1..marker.seen.len().saturating_sub(1)).filter(jumps).collect()
    }

    /// Whether a frame of a marker is spoiled by a jump.
    pub(crate) fn is_spoiled(&self, marker: &Marker, frame: usize) -> bool {
        self.faults().iter().any(|fault| match fault {
            Fault::Glitches { marker: name, frames, .. } => {
                *name == marker.name && frames.iter().any(|k| k.abs_diff(frame) <= SPOILED)
            }
            _ => false,
        })
    }
}

/// The second difference of a marker's places about a frame, m; 0 where it was not seen.
fn second(marker: &Marker, k: usize) -> f64 {
    let [a, b, c] = [k - 1, k, k + 1].map(|k| marker.seen[k]);
    let (Some(a), Some(b), Some(c)) = (a, b, c) else { return 0.0 };
    norm(std::array::from_fn(|i| a[i] - 2.0 * b[i] + c[i]))
}

fn norm(a: Vector<f64>) -> f64 {
    dot(a, a).sqrt()
}

/// The frames around a gap.
const WINDOW: usize = 2 * BESIDE;
/// A number of each of them.
type Frames = [f64; WINDOW];

/// The ways of a marker along the three axes in the first of some frames, if it was seen in all of them.
fn ways_of(seen: &[Option<Vector<f64>>]) -> Option<[Frames; 3]> {
    let mut ways = [[0.0; WINDOW]; 3];
    for (k, seen) in seen.iter().take(WINDOW).enumerate() {
        let place = (*seen)?;
        (0..3).for_each(|c| ways[c][k] = place[c]);
    }
    Some(ways)
}

#[inline]
fn product(a: &Frames, b: &Frames) -> f64 {
    let mut sum = 0.0;
    for k in 0..WINDOW {
        sum += a[k] * b[k];
    }
    sum
}

/// Takes from a list what it has of another, of length 1.
#[inline]
fn take_off(from: &mut Frames, other: &Frames) {
    let along = product(other, from);
    for k in 0..WINDOW {
        from[k] -= along * other[k];
    }
}

/// An orthonormal basis of the cubics at these times.
fn cubics(times: &Frames) -> [Frames; 4] {
    let middle = times.iter().sum::<f64>() / WINDOW as f64;
    let size = times.iter().map(|t| (t - middle).abs()).fold(f64::MIN_POSITIVE, f64::max);
    let mut basis = [[1.0; WINDOW]; 4];
    for power in 1..4 {
        basis[power] = components(|k| basis[power - 1][k] * ((times[k] - middle) / size));
    }
    for power in 0..4 {
        let (done, rest) = basis.split_at_mut(power);
        let new = &mut rest[0];
        done.iter().for_each(|old| take_off(new, old));
        let length = product(new, new).sqrt();
        new.iter_mut().for_each(|x| *x /= length);
    }
    basis
}

/// Residual, RMS, of the least-squares fit of a basis to the ways of markers.
fn rms_residual(basis: &[Frames; 4], ways: &[Frames]) -> f64 {
    let sum = ways.iter().map(|way| left(basis, way)).sum::<f64>();
    (sum / f64::max((WINDOW * ways.len()) as f64, 1.0)).sqrt()
}

/// The sum of squares that a basis leaves of values.
fn left(basis: &[Frames; 4], values: &Frames) -> f64 {
    let mut rest = components(|k| values[k] - values[0]);
    basis.iter().for_each(|old| take_off(&mut rest, old));
    product(&rest, &rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five markers between hands that move, 100 frames a second; without the frames in `lost`, while the
    /// clock goes on as if nothing were missing.
    fn track(lost: &[usize], swapped: Option<[usize; 2]>, glitch: Option<usize>) -> Track {
        let place = |j: usize, frame: usize| {
            let (t, u) = (0.01 * frame as f64, 0.1 * j as f64);
            let noise = 5e-6 * ((frame * 7919 + j * 104_729) as f64).sin();
            let jump = if glitch == Some(frame) && j == 2 { 0.02 } else { 0.0 };
            [u + 0.3 * (4.0 * t).sin(), 0.2 * (3.0 * t).cos() - u * u + noise, 0.1 * t * t + jump]
        };
        let frames: Vec<usize> = (0..120).filter(|k| !lost.contains(k)).collect();
        let times = (0..frames.len()).map(|k| 0.01 * k as f64).collect();
        let mut markers: Vec<_> = (0..5)
            .map(|j| (j.to_string(), frames.iter().map(|k| Some(place(j, *k))).collect::<Vec<_>>()))
            .collect();
        if let Some([a, b]) = swapped {
            let seen = markers[a].1.clone();
            markers[a].1 = std::mem::replace(&mut markers[b].1, seen);
        }
        Track::new(times, markers).unwrap()
    }

    const HELD: [usize; 4] = [0, 1, 3, 4];

    #[test]
    fn clean_recordings_have_no_faults() {
        let clean = track(&[], None, None);
        let examined = clean.examined(&HELD, LostFrames::Stretch, SwappedLabels::Mend);
        assert!(examined.faults().is_empty(), "{:?}", examined.faults());
        assert_eq!((examined.times(), examined.markers()), (clean.times(), clean.markers()));
    }

    #[test]
    fn lost_frames_are_found_and_stretched() {
        let lost: Vec<usize> = (31..34).chain(70..71).collect();
        let recorded = track(&lost, None, None);
        let kept = recorded.examined(&HELD, LostFrames::Keep, SwappedLabels::Keep);
        let found: Vec<(f64, usize)> = kept
            .faults()
            .iter()
            .filter_map(|fault| match fault {
                Fault::LostFrames { time, frames, mended: false } => Some((*time, *frames)),
                _ => None,
            })
            .collect();
        assert_eq!(found, [(0.30, 3), (0.66, 1)], "{:?}", kept.faults());
        assert_eq!(kept.times(), recorded.times());
        let mended = recorded.examined(&HELD, LostFrames::Stretch, SwappedLabels::Keep);
        assert!((mended.times()[31] - 0.34).abs() < 1e-12);
        assert!((mended.end() - 1.19).abs() < 1e-12);
        // What was mended is told, and not found again.
        assert_eq!(mended.faults().len(), 2);
        let again = mended.examined(&HELD, LostFrames::Stretch, SwappedLabels::Keep);
        assert!(again.faults().is_empty(), "{:?}", again.faults());
    }

    #[test]
    fn marker_that_slips_alone_is_no_lost_frame() {
        // A held marker slips by 5 mm against all others, on the way that lost frames would take it.
        let even = track(&[], None, None);
        let slipped = |m: &Marker| {
            let slips = m.name == "3";
            let place = |(k, seen): (usize, &Option<Vector<f64>>)| {
                let [x, y, z] = (*seen)?;
                Some(if slips && k >= 60 { [x + 0.004, y, z + 0.003] } else { [x, y, z] })
            };
            (m.name.clone(), m.seen.iter().enumerate().map(place).collect())
        };
        let markers = even.markers().iter().map(slipped).collect();
        let recorded = Track::new(even.times().to_vec(), markers).unwrap();
        let examined = recorded.examined(&HELD, LostFrames::Stretch, SwappedLabels::Keep);
        let lost = |fault: &&Fault| matches!(fault, Fault::LostFrames { .. });
        assert_eq!(examined.faults().iter().find(lost), None);
        assert_eq!(examined.times(), even.times());
    }

    #[test]
    fn swapped_labels_are_found_and_mended() {
        for pair in [[0, 1], [1, 2], [2, 3], [3, 4]] {
            let recorded = track(&[], Some(pair), None);
            let kept = recorded.examined(&HELD, LostFrames::Keep, SwappedLabels::Keep);
            let markers = pair.map(|j| j.to_string());
            let told = Fault::SwappedLabels { markers, mended: false };
            assert_eq!(kept.faults(), [told]);
            let mended = recorded.examined(&HELD, LostFrames::Keep, SwappedLabels::Mend);
            assert_eq!(mended.markers(), track(&[], None, None).markers());
        }
    }

    #[test]
    fn glitches_are_found() {
        let recorded = track(&[], None, Some(50));
        let examined = recorded.examined(&HELD, LostFrames::Keep, SwappedLabels::Keep);
        let Fault::Glitches { marker, frames, .. } = &examined.faults()[0] else { panic!() };
        // The frames beside it are off by as much as the jump, less than half its second difference.
        assert_eq!((marker.as_str(), &frames[..]), ("2", &[49, 50, 51][..]));
        let spoiled = |k| examined.is_spoiled(&examined.markers()[2], k);
        assert!(spoiled(47) && spoiled(53) && !spoiled(46) && !spoiled(54));
        assert!(!examined.is_spoiled(&examined.markers()[1], 50));
    }
}
