//! `rodfit campaign sbatch`: the script of a Slurm job array.

use rodfit::Error;
use std::path::Path;

/// The script of a job array whose jobs are the shards of the plan in a folder. A job that is ended early, at its time
/// limit or with its machine, leaves the rest to the next submission.
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
