//! The collection of a campaign's results: at most one for each task, from the files that all processes wrote.
//!
//! Input is a plan, whose folder has the files. Two results of one task must agree, else collection is an error. If
//! both come from one platform, their JSON must be equal byte by byte. On two platforms they must have the same exit
//! code and the same parameters (number, order, names and experiments). Values and standard errors must then agree to
//! within a relative `PLATFORM_DIFFERENCE`. All results of a task are compared with each other. The one whose JSON text
//! is first in alphabetical order is kept. So neither the choice nor an error depends on the order of the files.
//! Results of unplanned tasks are ignored. Damaged lines are ignored and listed; `Damage::is_torn` is true for the
//! incomplete last line of a killed process, which is no fault.
//!
//! Output: [`Collected`], the input of the status, the CSV table and the comparison page. `Collected::write_lines`
//! writes a line of JSON per task with a result, sorted by id. `missing` lists tasks without one.

use crate::campaign::plan::{CampaignTask, Plan};
use crate::campaign::store::{DamagedLine, Store, StoredRecord};
use crate::error::Error;
use serde_json::{Value, json};
use std::collections::{HashMap, HashSet};
use std::fmt;
use std::io::{self, Write};

/// Largest relative difference of values and standard errors between results of two platforms that count as equal. It
/// is far above rounding errors and far below any standard error; with a larger value, results of other data could
/// count as equal.
const PLATFORM_DIFFERENCE: f64 = 1e-9;

/// The results of a campaign's tasks, read from the store of its plan.
#[derive(Debug)]
#[non_exhaustive]
pub struct Collected<'a> {
    plan: &'a Plan,
    /// The results by the ids of their tasks.
    results: HashMap<String, StoredRecord>,
    /// Damaged or torn lines, which are ignored.
    pub damaged: Vec<Damage>,
}

/// A damaged or torn line of a file of results, which is ignored.
#[derive(Clone, Debug, PartialEq)]
pub struct Damage(DamagedLine);

impl Damage {
    /// Whether it is the incomplete last line of a killed process, which is no fault.
    pub fn is_torn(&self) -> bool {
        self.0.is_torn
    }
}

impl fmt::Display for Damage {
    /// Writes file, line and kind of the damage (torn or damaged), and the action against it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let DamagedLine { file, line, is_torn } = &self.0;
        let how = if *is_torn { "torn" } else { "damaged" };
        write!(
            f,
            "{}:{line} is {how} and is ignored. Run the campaign again to compute it",
            file.display()
        )
    }
}

impl<'a> Collected<'a> {
    /// Reads all results of a plan's tasks from its folder, one for each id, and the damaged lines. Results of other
    /// tasks are ignored. All results of one task are compared with each other. The one whose JSON is first in
    /// alphabetical order is kept.
    ///
    /// # Errors
    ///
    /// Results that cannot be read, and two different results of one task. On one platform they differ if any byte
    /// does. On two platforms they differ in exit code or parameters, or in a value or standard error by more than 1e-9
    /// of its size.
    pub fn new(plan: &'a Plan) -> Result<Self, Error> {
        let planned: HashSet<&str> = plan.tasks.iter().map(|task| &*task.id).collect();
        let mut results: HashMap<String, Vec<StoredRecord>> = HashMap::new();
        let mut failure = None;
        let damaged = Store::new(&plan.folder).read(|record| {
            if failure.is_some() || !planned.contains(&*record.id) {
                return;
            }
            failure = add_result(results.entry(record.id.clone()).or_default(), record);
        })?;
        // Of the results of several platforms always the same one is kept, in whatever order they are read.
        let first = |own: Vec<StoredRecord>| own.into_iter().min_by(|a, b| a.result.cmp(&b.result));
        let results: HashMap<String, StoredRecord> =
            results.into_iter().filter_map(|(id, own)| Some((id, first(own)?))).collect();
        let damaged = damaged.into_iter().map(Damage).collect();
        failure.map_or(Ok(Self { plan, results, damaged }), Err)
    }

    /// The tasks of the plan without a result, in its order.
    pub fn missing(&self) -> impl Iterator<Item = &CampaignTask> {
        self.plan.tasks.iter().filter(|task| !self.results.contains_key(&task.id))
    }

    /// Pairs of a task with a result and that result, in the order of the plan. Tasks without a result are left out;
    /// tasks with one id share a result and are all listed.
    pub(crate) fn results(&self) -> impl Iterator<Item = (&'a CampaignTask, &StoredRecord)> {
        self.plan.tasks.iter().filter_map(|task| Some((task, self.results.get(&task.id)?)))
    }

    /// Writes a line of JSON for every task with a result, sorted by id: id, name if there is one, fit file, changes,
    /// and the stored result. The bytes are the same on one platform however the campaign was run.
    ///
    /// # Errors
    ///
    /// A failed write.
    pub fn write_lines(&self, to: &mut impl Write) -> io::Result<()> {
        let mut sorted: Vec<_> = self.results().collect();
        // The order of the plan may change, ids do not.
        sorted.sort_by(|(a, _), (b, _)| a.id.cmp(&b.id));
        for (CampaignTask { id, name, fit, changes }, record) in sorted {
            let name = match name.is_empty() {
                true => String::new(),
                false => format!("\"name\":{},", json!(name)),
            };
            let (fit, changes) = (json!(fit), json!(changes));
            let result = &record.result;
            writeln!(
                to,
                "{{\"id\":\"{id}\",{name}\"fit\":{fit},\"changes\":{changes},\"result\":{result}}}"
            )?;
        }
        Ok(())
    }
}

/// Adds a result to those of its task, `own`, unless one of them has the same text. An error if it differs from any of
/// them: two results of one platform may be near that of another platform, and differ.
fn add_result(own: &mut Vec<StoredRecord>, record: StoredRecord) -> Option<Error> {
    let failure = own.iter().find_map(|other| difference(other, &record));
    if own.iter().all(|other| other.result != record.result) {
        own.push(record);
    }
    failure
}

/// An error with the places of both results if two results of a task are not equal. On one platform they must be equal
/// byte by byte, on two by [`have_equal_parameters`]. Texts that differ and are no JSON are not equal. `None` if they
/// are equal.
fn difference(one: &StoredRecord, other: &StoredRecord) -> Option<Error> {
    let value = |record: &StoredRecord| serde_json::from_str::<Value>(&record.result).ok();
    // Equal texts need no parsing.
    let is_same = one.result == other.result
        || value(one).zip(value(other)).is_some_and(|(one, other)| {
            one["platform"] != other["platform"] && have_equal_parameters(&one, &other)
        });
    let line = |record: &StoredRecord| format!("{}:{}", record.file.display(), record.line);
    let found = format!("different results at {} and {}", line(one), line(other));
    let key = format!("result of {}", one.id);
    (!is_same).then(|| Error::invalid(key, found, "equal results; remove one of the two"))
}

/// Whether two results (JSON) have the same exit code, and as many parameters in the same order with the same names and
/// experiments. A result without a report has none. Values and standard errors must agree to [`PLATFORM_DIFFERENCE`] of
/// the larger one, or both be absent.
fn have_equal_parameters(one: &Value, other: &Value) -> bool {
    let parameters =
        |of: &Value| of["report"]["parameters"].as_array().cloned().unwrap_or_default();
    let (these, those) = (parameters(one), parameters(other));
    // Mathematical libraries differ in the last digits; names, counts and exit codes must be equal.
    let is_near = |a: &Value, b: &Value, key: &str| match (a[key].as_f64(), b[key].as_f64()) {
        (Some(a), Some(b)) => (a - b).abs() <= PLATFORM_DIFFERENCE * a.abs().max(b.abs()),
        (a, b) => a == b,
    };
    let is_equal = |(a, b): (&Value, &Value)| {
        ["name", "experiments"].iter().all(|key| a[key] == b[key])
            && ["value", "std_error"].iter().all(|key| is_near(a, b, key))
    };
    one["code"] == other["code"]
        && these.len() == those.len()
        && these.iter().zip(&those).all(is_equal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::store::RecordContext;
    use std::path::PathBuf;

    /// A stored record of task 7 from this platform, with one parameter and the residual `other`.
    fn result(platform: &str, value: f64, std_error: f64, other: f64) -> StoredRecord {
        let parameters = json!([{ "name": "radius", "value": value, "std_error": std_error }]);
        let report = json!({ "parameters": parameters, "residual_rms": other });
        let result = json!({ "platform": platform, "code": 0, "report": report }).to_string();
        let context = RecordContext { wall_seconds: 0.0, host: String::new(), finished: 0.0 };
        StoredRecord { id: "7".into(), result, context, file: PathBuf::from(platform), line: 3 }
    }

    /// Two results of platform a differ by 8e-10, and both by less than 1e-9 from that of platform b.
    #[test]
    fn third_result_near_another_platform_is_compared_with_its_own() {
        let all = [("a", 1.0), ("b", 1.0 + 4e-10), ("a", 1.0 + 8e-10)];
        for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let mut own = Vec::new();
            let mut add = |k: usize| add_result(&mut own, result(all[k].0, all[k].1, 0.1, 1e-3));
            let failures = order.map(|k| add(k).is_some());
            assert!(failures.contains(&true), "{order:?}");
        }
    }

    #[test]
    fn results_of_one_platform_are_equal_to_the_last_bit_and_others_to_1e_9() {
        let here = result("a", 1.0, 0.1, 1e-3);
        assert!(difference(&here, &result("a", 1.0, 0.1, 1e-3)).is_none());
        // To the last bit on one platform.
        let error = difference(&here, &result("a", 1.0, 0.1, 1.0000000000000002e-3)).unwrap();
        assert!(error.to_string().contains("different results at a:3 and a:3"), "{error}");
        assert!(difference(&here, &result("b", 1.0 + 5e-10, 0.1, 1.1e-3)).is_none());
        for other in [result("b", 1.0 + 2e-9, 0.1, 1e-3), result("b", 1.0, 0.1 + 1e-9, 1e-3)] {
            let error = difference(&here, &other).unwrap().to_string();
            assert!(error.contains("result of 7") && error.contains("a:3 and b:3"), "{error}");
        }
    }
}
