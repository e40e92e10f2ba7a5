//! Campaigns, a task at a time.

use crate::error::{raised, refused};
use crate::work::interruptible;
use pyo3::prelude::*;
use rodfit::campaign::{Plan, Store};
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// A plan, and where this process stores results.
#[pyclass(frozen, module = "rodfit._rodfit")]
pub struct Campaign {
    inner: Arc<Inner>,
}

struct Inner {
    plan: Plan,
    store: Store,
    /// Indices of tasks by their ids.
    places: HashMap<String, usize>,
}

#[pymethods]
impl Campaign {
    #[new]
    fn new(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        let plan = Plan::open(&folder).map_err(|error| raised(py, error))?;
        let places = plan.tasks.iter().enumerate().map(|(k, task)| (task.id.clone(), k)).collect();
        let store = Store::new(&plan.folder);
        Ok(Self { inner: Arc::new(Inner { plan, store, places }) })
    }

    /// The ids of the tasks that have no result.
    fn open_tasks(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let open = self.inner.plan.open_tasks(None).map_err(|error| raised(py, error))?;
        Ok(open.0.iter().map(|task| task.id.clone()).collect())
    }

    fn has(&self, id: &str) -> bool {
        self.inner.places.contains_key(id)
    }

    /// Solves a task and stores its result; its exit code, or nothing after Ctrl-C.
    fn solve(&self, py: Python<'_>, id: &str) -> PyResult<Option<u8>> {
        let Some(place) = self.inner.places.get(id).copied() else {
            return Err(refused(py, format!("task: found {id}, allowed: one of the plan")));
        };
        let inner = self.inner.clone();
        interruptible(py, None, move |hooks| {
            let outcome = inner.plan.solve(&inner.plan.tasks[place], &inner.store, hooks.stop)?;
            Ok(outcome.map(|outcome| outcome.code))
        })
    }
}
