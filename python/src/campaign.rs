//! Campaigns in Python: a plan in a folder, whose tasks a Python scheduler solves one at a time by their ids. Results
//! go to the store of the plan, in a file of this process.

use crate::error::{raised, refused};
use crate::work::interruptible;
use pyo3::prelude::*;
use rodfit::campaign::{Plan, Store};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// A plan with the file of results of this process.
#[pyclass(frozen, name = "Campaign", module = "rodfit._rodfit")]
pub struct PyCampaign {
    inner: Arc<OpenPlan>,
}

/// A plan with its store, and the indices of its tasks by their ids.
struct OpenPlan {
    plan: Plan,
    store: Store,
    /// Indices of tasks by their ids.
    indices: HashMap<String, usize>,
}

#[pymethods]
impl PyCampaign {
    /// Reads the plan in a folder; an error if the folder has no valid plan.
    #[new]
    fn new(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        let plan = Plan::open(&folder).map_err(|error| raised(py, error))?;
        let indices = plan.tasks.iter().enumerate().map(|(k, task)| (task.id.clone(), k)).collect();
        let store = Store::new(&plan.folder);
        Ok(Self { inner: Arc::new(OpenPlan { plan, store, indices }) })
    }

    /// The ids of the tasks of the plan without a result in its store.
    fn open_tasks(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let open = self.inner.plan.open_tasks(None).map_err(|error| raised(py, error))?;
        Ok(open.0.iter().map(|task| task.id.clone()).collect())
    }

    /// Whether the plan has a task with this id.
    fn has(&self, id: &str) -> bool {
        self.inner.indices.contains_key(id)
    }

    /// Solves the task with the id `id` and stores its result. Returns its exit code, or `None` after Ctrl-C. An
    /// `InputError` for an id that the plan does not have.
    fn solve(&self, py: Python<'_>, id: &str) -> PyResult<Option<u8>> {
        let Some(index) = self.inner.indices.get(id).copied() else {
            return Err(refused(py, format!("task: found {id}, allowed: a task of the plan")));
        };
        let inner = self.inner.clone();
        interruptible(py, None, move |hooks| {
            let outcome = inner.plan.solve(&inner.plan.tasks[index], &inner.store, hooks.stop)?;
            Ok(outcome.map(|outcome| outcome.code))
        })
    }
}
