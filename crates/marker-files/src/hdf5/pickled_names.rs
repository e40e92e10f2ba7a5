//! The names of columns in a file of pandas: a list of tuples of texts, pickled by Python with protocol 0.
//!
//! [`tuples`] takes the pickle as text and returns the texts of each tuple. A pickle is a sequence of instructions for a
//! stack. Known are those that build lists, tuples and texts, and refer to texts again; all others, of numbers, classes
//! and calls, are errors, and nothing is run. Time and memory are proportional to the length, as a reference to a name
//! copies up to a limit only.

/// Largest size of all names, bytes; a name is in the pickle once, but in many tuples.
const MOST: usize = 4_000_000;

/// A value on the stack.
enum Pickled {
    /// Start of a list or tuple.
    Mark,
    Text(String),
    Tuple(Vec<String>),
    List(Vec<Vec<String>>),
}

/// The texts of all tuples of a pickled list, or what was found instead.
pub(crate) fn tuples(pickle: &str) -> Result<Vec<Vec<String>>, String> {
    use Pickled::{List, Mark, Text, Tuple};
    let mut stack: Vec<Pickled> = Vec::new();
    // Texts by their number, as few as there are.
    let mut stored = std::collections::HashMap::new();
    let mut rest = pickle;
    let mut size = 0;
    let other = |found: &str| Err(format!("{found} in a pickle"));
    loop {
        let mut characters = rest.chars();
        let Some(instruction) = characters.next() else { return other("no end") };
        rest = characters.as_str();
        // The argument of an instruction ends with its line.
        let mut argument = || match rest.split_once('\n') {
            Some((argument, behind)) => {
                rest = behind;
                Ok(argument)
            }
            None => Err("an open line in a pickle".to_string()),
        };
        match instruction {
            '(' => stack.push(Mark),
            ']' => stack.push(List(Vec::new())),
            'V' | 'S' => {
                let text = argument()?;
                let text = if instruction == 'S' { text.trim_matches(['\'', '"']) } else { text };
                // Letters beyond ASCII are escaped, or single bytes that the text no longer has.
                if text.contains(['\\', char::REPLACEMENT_CHARACTER]) {
                    return other("letters beyond ASCII");
                }
                stack.push(Text(text.into()));
            }
            'p' => {
                let number = argument()?.to_string();
                if let Some(Text(text)) = stack.last() {
                    stored.insert(number, text.clone());
                }
            }
            'g' => match stored.get(argument()?) {
                Some(text) => {
                    size += text.len();
                    stack.push(Text(text.clone()));
                }
                None => return other("a reference to no text"),
            },
            'l' | 't' => {
                let mark = stack.iter().rposition(|own| matches!(own, Mark));
                let Some(mark) = mark else { return other("an end without a start") };
                let members = stack.split_off(mark).into_iter().skip(1);
                let (mut texts, mut tuples) = (Vec::new(), Vec::new());
                for member in members {
                    match member {
                        Text(text) => texts.push(text),
                        Tuple(tuple) => tuples.push(tuple),
                        Mark | List(_) => return other("a list in another one"),
                    }
                }
                match (instruction, texts.is_empty(), tuples.is_empty()) {
                    ('t', _, true) => stack.push(Tuple(texts)),
                    ('l', true, _) => stack.push(List(tuples)),
                    _ => return other("names that are no tuples"),
                }
            }
            'a' => match (stack.pop(), stack.last_mut()) {
                (Some(Tuple(tuple)), Some(List(list))) => list.push(tuple),
                _ => return other("names that are no tuples"),
            },
            '.' => match (stack.pop(), stack.is_empty()) {
                (Some(List(list)), true)
                    if list.iter().all(|tuple| tuple.len() == list[0].len()) =>
                {
                    return Ok(list);
                }
                _ => return other("no list of tuples of one length"),
            },
            _ => return other("another object than texts"),
        }
        if size > MOST {
            return other("too many names");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_a_pickle_are_read() {
        let pickle = "(lp0\n(Vnet\np1\nVbase\np2\nVx\np3\ntp4\na(g1\ng2\nVy\np5\ntp6\na.";
        assert_eq!(tuples(pickle).unwrap(), [["net", "base", "x"], ["net", "base", "y"]]);
        // Python 2.
        assert_eq!(
            tuples("(lp0\n(S'net'\np1\nS'base'\nS'x'\ntp4\na.").unwrap(),
            [["net", "base", "x"]]
        );
        assert_eq!(tuples("(l.").unwrap(), Vec::<Vec<String>>::new());
    }

    #[test]
    fn other_pickles_are_refused_and_not_run() {
        for pickle in [
            "cos\nsystem\n(S'ls'\ntR.",
            "(lp0\nI1\na.",
            "(lp0\nVx\na.",
            "(l(g1\nta.",
            "(l(Vx\n",
            "(l(Vr\\u0101\nta.",
            "(l(Vx\nta(Vx\nVy\nta.",
            "t.",
            "a",
            ".",
            "",
        ] {
            let error = tuples(pickle).unwrap_err();
            assert!(error.contains("in a pickle"), "{error}");
        }
    }
}
