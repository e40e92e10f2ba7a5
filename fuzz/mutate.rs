//! Files that are nearly right: bytes, numbers, fields and lines of good ones changed, left out, doubled and mixed.

/// Random numbers (SplitMix64): the same ones on every machine.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `n`; 0 of nothing.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    fn of<'a, T: ?Sized>(&mut self, all: &[&'a T]) -> &'a T {
        all[self.below(all.len())]
    }
}

/// Numbers where something turns.
const NUMBERS: [&str; 30] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "3",
    "0.5",
    "1e-3",
    "1e308",
    "-1e308",
    "1e309",
    "5e-324",
    "1e-320",
    "nan",
    "NaN",
    "inf",
    "-inf",
    "Infinity",
    "1e",
    "e5",
    ".",
    "0x10",
    "99999999999999999999",
    "9223372036854775807",
    "-9223372036854775808",
    "4294967296",
    "65535",
    "1_000",
    "1,5",
    "3.5.1",
];
/// What has a meaning somewhere.
const WORDS: [&str; 56] = [
    "\n",
    "\r\n",
    "\t",
    ",",
    ";",
    "\"",
    "\"\"",
    "'",
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    "#",
    ":",
    "/",
    ".",
    "\u{feff}",
    "\0",
    "\u{3b8}",
    "x",
    "y",
    "z",
    "X",
    "Frame",
    "Time",
    "t",
    "tip",
    "true",
    "false",
    "likelihood",
    "Trajectories",
    "Marker",
    "Position",
    "Type",
    "Name",
    "mm",
    "px",
    "(mm)",
    "[px]",
    "[]",
    "scorer",
    "individuals",
    "coords",
    "pt1_cam1_X",
    "rod.",
    "[supports.path]\nfile = \"tip.csv\"\n",
    "[rod.taper]\nradius = [1, 2]\n",
    "experiment = \"a\"\n",
    "[[loads.point]]\n",
    "# a",
    "(sec)",
    "frame_idx",
    "tip.x",
];

/// The ends of a piece, up to `longest` bytes.
fn piece(random: &mut Random, length: usize, longest: usize) -> std::ops::Range<usize> {
    let from = random.below(length + 1);
    from..(from + random.below(longest + 1)).min(length)
}

/// The ends of a line, or of a field, with what ends it.
fn part(random: &mut Random, bytes: &[u8], ends: &[u8]) -> std::ops::Range<usize> {
    let at = random.below(bytes.len());
    let is_end = |b: &u8| ends.contains(b);
    let from = bytes[..at].iter().rposition(is_end).map_or(0, |i| i + 1);
    let to = bytes[at..].iter().position(is_end).map_or(bytes.len(), |i| at + i + 1);
    from..to
}

/// The ends of a number.
fn number(random: &mut Random, bytes: &[u8]) -> std::ops::Range<usize> {
    let at = random.below(bytes.len());
    let of_number = |b: &u8| b.is_ascii_digit() || b"+-.e".contains(b);
    let Some(from) = bytes[at..].iter().position(u8::is_ascii_digit).map(|i| at + i) else {
        return 0..0;
    };
    let from = bytes[..from].iter().rposition(|b| !of_number(b)).map_or(0, |i| i + 1);
    let to = bytes[from..].iter().position(|b| !of_number(b)).map_or(bytes.len(), |i| from + i);
    from..to
}

/// A file like one of the corpus.
pub fn mutated(random: &mut Random, corpus: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = corpus[random.below(corpus.len())].clone();
    for _ in 0..1 + random.below(5) {
        let length = bytes.len();
        match random.below(14) {
            0 if length > 0 => bytes[random.below(length)] ^= 1 << random.below(8),
            1 if length > 0 => bytes[random.below(length)] = random.next() as u8,
            2 => drop(bytes.splice(piece(random, length, 20), [])),
            3 => drop(
                bytes.splice(piece(random, length, 0), WORDS[random.below(WORDS.len())].bytes()),
            ),
            4 | 5 => {
                drop(bytes.splice(number(random, &bytes.clone()), random.of(&NUMBERS).bytes()))
            }
            6 => drop(bytes.splice(part(random, &bytes.clone(), b"\n"), [])),
            7 => {
                let line = bytes[part(random, &bytes.clone(), b"\n")].to_vec();
                let at = part(random, &bytes.clone(), b"\n").start;
                drop(bytes.splice(at..at, line));
            }
            8 => drop(bytes.splice(part(random, &bytes.clone(), b",;\t= \n"), [])),
            9 => {
                let field = bytes[part(random, &bytes.clone(), b",;\t= \n")].to_vec();
                let at = part(random, &bytes.clone(), b",;\t= \n").start;
                drop(bytes.splice(at..at, field.repeat(1 + random.below(3))));
            }
            10 => bytes.truncate(random.below(length + 1)),
            11 => {
                let other = &corpus[random.below(corpus.len())];
                let from = other[piece(random, other.len(), 200)].to_vec();
                drop(bytes.splice(piece(random, length, 200), from));
            }
            12 => {
                let (from, to) = (
                    random.of(&[b",", b";", b"\t", b".", b"\n"]),
                    random.of(&[b",", b";", b"\t", b" ", b"\r"]),
                );
                bytes.iter_mut().filter(|b| **b == from[0]).for_each(|b| *b = to[0]);
            }
            _ => drop(
                bytes.splice(part(random, &bytes.clone(), b",;\t=\n"), random.of(&WORDS).bytes()),
            ),
        }
    }
    bytes
}
