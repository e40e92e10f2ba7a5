//! All results together: one of each task, in an order of their own, whoever computed them.

use crate::campaign::plan::{Plan, Task};
use crate::campaign::store::{Broken, Record, Store};
use crate::error::Error;
use serde_json::{Value, json};
use std::collections::HashMap;
use std::fmt;
use std::io::{self, Write};

/// Results from different platforms are the same where their values and errors differ by less than this part.
const SAME: f64 = 1e-9;

/// The results of a campaign.
#[derive(Debug)]
#[non_exhaustive]
pub struct Collected<'a> {
    plan: &'a Plan,
    /// By the ids of their tasks.
    results: HashMap<String, Record>,
    /// Lines of the parts that are not whole.
    pub damaged: Vec<Damage>,
}

/// A line that is not whole, and does not count.
#[derive(Clone, Debug, PartialEq)]
pub struct Damage(Broken);

impl Damage {
    /// Whether it is the last of a process that was killed, as is to be expected.
    pub fn is_torn(&self) -> bool {
        self.0.torn
    }
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Broken { file, line, torn } = &self.0;
        let how = if *torn { "torn" } else { "damaged" };
        write!(
            f,
            "{}:{line} is {how} and is ignored. Run the campaign again to compute it",
            file.display()
        )
    }
}

impl<'a> Collected<'a> {
    /// Reads all results of a plan's tasks.
    ///
    /// # Errors
    ///
    /// Results that cannot be read, and two of one task that differ: byte for byte where they are of one platform,
    /// by more than 1e-9 elsewhere.
    pub fn of(plan: &'a Plan) -> Result<Self, Error> {
        let planned: std::collections::HashSet<&str> =
            plan.tasks.iter().map(|task| &*task.id).collect();
        let mut results: HashMap<String, Record> = HashMap::new();
        let mut failure = None;
        let broken = Store::new(&plan.folder).read(|record| {
            if failure.is_some() || !planned.contains(&*record.id) {
                return;
            }
            match results.get(&record.id) {
                Some(other) => match differ(other, &record) {
                    Some(error) => failure = Some(error),
                    // Of two platforms always the same one.
                    None if record.result < other.result => {
                        drop(results.insert(record.id.clone(), record))
                    }
                    None => {}
                },
                None => drop(results.insert(record.id.clone(), record)),
            }
        })?;
        match failure {
            Some(error) => Err(error),
            None => Ok(Self { plan, results, damaged: broken.into_iter().map(Damage).collect() }),
        }
    }

    /// The tasks that have no result.
    pub fn missing(&self) -> impl Iterator<Item = &Task> {
        self.plan.tasks.iter().filter(|task| !self.results.contains_key(&task.id))
    }

    /// The tasks with their results, in the order of the plan.
    pub(crate) fn results(&self) -> impl Iterator<Item = (&'a Task, &Record)> {
        self.plan.tasks.iter().filter_map(|task| Some((task, self.results.get(&task.id)?)))
    }

    /// A line of JSON for every task that has a result, sorted by id: the same bytes on one platform however the campaign
    /// was run.
    ///
    /// # Errors
    ///
    /// What the system says.
    pub fn write_lines(&self, to: &mut impl Write) -> io::Result<()> {
        let mut sorted: Vec<_> = self.results().collect();
        sorted.sort_by(|(a, _), (b, _)| a.id.cmp(&b.id));
        for (Task { id, name, fit, changes }, record) in sorted {
            let named =
                if name.is_empty() { String::new() } else { format!("\"name\":{},", json!(name)) };
            let (fit, changes) = (json!(fit), json!(changes));
            let result = &record.result;
            writeln!(
                to,
                "{{\"id\":\"{id}\",{named}\"fit\":{fit},\"changes\":{changes},\"result\":{result}}}"
            )?;
        }
        Ok(())
    }
}

/// An error if two results of a task are not the same.
fn differ(one: &Record, other: &Record) -> Option<Error> {
    let same = one.result == other.result || {
        let both = [one, other].map(|record| serde_json::from_str::<Value>(&record.result).ok());
        let [Some(one), Some(other)] = both else { return Some(difference(one, other)) };
        one["platform"] != other["platform"] && agree(&one, &other)
    };
    (!same).then(|| difference(one, other))
}

fn difference(one: &Record, other: &Record) -> Error {
    let at = |record: &Record| format!("{}:{}", record.file.display(), record.line);
    let found = format!("different results at {} and {}", at(one), at(other));
    Error::invalid(format!("result of {}", one.id), found, "equal results; remove one of the two")
}

/// Whether results of two platforms end alike, with the same numbers.
fn agree(one: &Value, other: &Value) -> bool {
    let parameters =
        |of: &Value| of["report"]["parameters"].as_array().cloned().unwrap_or_default();
    let (these, those) = (parameters(one), parameters(other));
    let near = |a: &Value, b: &Value, key: &str| match (a[key].as_f64(), b[key].as_f64()) {
        (Some(a), Some(b)) => (a - b).abs() <= SAME * a.abs().max(b.abs()),
        (a, b) => a == b,
    };
    let alike = |(a, b): (&Value, &Value)| {
        a["name"] == b["name"]
            && a["experiments"] == b["experiments"]
            && near(a, b, "value")
            && near(a, b, "std_error")
    };
    one["code"] == other["code"]
        && these.len() == those.len()
        && these.iter().zip(&those).all(alike)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::store::About;
    use std::path::PathBuf;

    fn result(platform: &str, value: f64, std_error: f64, other: f64) -> Record {
        let parameters = json!([{ "name": "radius", "value": value, "std_error": std_error }]);
        let report = json!({ "parameters": parameters, "residual_rms": other });
        let result = json!({ "platform": platform, "code": 0, "report": report }).to_string();
        let about = About { wall_seconds: 0.0, host: String::new(), finished: 0.0 };
        Record { id: "7".into(), result, about, file: PathBuf::from(platform), line: 3 }
    }

    #[test]
    fn results_are_compared_as_their_platforms_allow() {
        let here = result("a", 1.0, 0.1, 1e-3);
        assert!(differ(&here, &result("a", 1.0, 0.1, 1e-3)).is_none());
        // To the last bit on one platform.
        let error = differ(&here, &result("a", 1.0, 0.1, 1.0000000000000002e-3)).unwrap();
        assert!(error.to_string().contains("different results at a:3 and a:3"), "{error}");
        assert!(differ(&here, &result("b", 1.0 + 5e-10, 0.1, 1.1e-3)).is_none());
        for other in [result("b", 1.0 + 2e-9, 0.1, 1e-3), result("b", 1.0, 0.1 + 1e-9, 1e-3)] {
            let error = differ(&here, &other).unwrap().to_string();
            assert!(error.contains("result of 7") && error.contains("a:3 and b:3"), "{error}");
        }
    }
}
