//! `rodfit campaign sbatch`: generates the shell script of a Slurm job array for a campaign, which is printed; nothing
//! is submitted.
//!
//! Input are the folder of the plan, the number of jobs, threads per job, and the time limit in the notation of Slurm.
//! Each job of the array runs one shard (part) of the plan with `rodfit campaign run`, which reads the shard's index
//! from the environment of Slurm. Jobs are requeued after a failure of a machine, and get the signal TERM one minute
//! before their time limit, so that finished results are kept. A missing folder, and a time with other characters than
//! digits, `:` and `-`, are errors.

use rodfit::Error;
use std::path::Path;

/// The script of a job array with `shards` jobs of `threads` processors and the time limit `time` (notation of Slurm),
/// which run the plan in `folder`. The job is named after the folder, with hyphens for white space. Fits that an ended
/// job leaves open are computed by the next submission. Errors: a time with other characters than digits, `:` and `-`;
/// a folder that does not exist.
pub(super) fn job_script(
    folder: &Path,
    time: &str,
    shards: u64,
    threads: usize,
) -> Result<String, Error> {
    // The time goes into a script unquoted.
    let is_time = !time.is_empty() && time.chars().all(|c| c.is_ascii_digit() || ":-".contains(c));
    if !is_time {
        let allowed = "minutes, h:m:s or d-h:m:s, as in 1:00:00";
        return Err(Error::invalid("--time", time, allowed));
    }
    let folder = folder.canonicalize().map_err(|source| Error::io(folder, source))?;
    // Job names have no spaces.
    let name =
        folder.file_name().unwrap_or_default().to_string_lossy().replace(char::is_whitespace, "-");
    let folder = folder.display().to_string().replace('\'', r"'\''");
    let last = shards - 1;
    Ok(format!(
        "#!/bin/sh
#SBATCH --job-name={name}
#SBATCH --array=0-{last}
#SBATCH --time={time}
#SBATCH --cpus-per-task={threads}
#SBATCH --requeue
# One minute before the time limit the job stops and keeps all its results.
#SBATCH --signal=B:TERM@60
# Submit it again until `rodfit campaign status` reports a result of every fit. Fits with a result are skipped.
exec rodfit campaign run '{folder}' --threads {threads}
"
    ))
}
