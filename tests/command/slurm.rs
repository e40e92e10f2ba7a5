//! A campaign on Slurm, where it is installed: a controller and two nodes on this machine, as an ordinary user, on separate
//! ports. A killed job array is submitted again and collects to the same bytes.
#![cfg(target_os = "linux")]

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::campaign::{collected, folder, plan, run, stored};
use crate::folder::{Folder, stdout, succeeds};

/// Fits of a few tenths of a second, so that jobs are killed at them.
const CAMPAIGN: &str = r#"
fits = ["fit.toml"]
[grid]
"rod.section.radius" = [4.9e-3, 5e-3, 5.1e-3, 5.2e-3]
material.density = [1200, 1250, 1300, 1350, 1400, 1450]
"rod.segments" = [40]
"#;

/// A program of Slurm's, wherever distributions put it.
fn program(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::env::split_paths(&path).chain(["/usr/sbin", "/sbin"].map(PathBuf::from));
    folders.map(|folder| folder.join(name)).find(|program| program.is_file())
}

/// Controller and nodes, which end with the test.
struct Slurm<'a> {
    folder: &'a Folder,
    daemons: Vec<Child>,
}

impl Drop for Slurm<'_> {
    fn drop(&mut self) {
        for daemon in &mut self.daemons {
            // It has ended already, or ends now.
            let _ = daemon.kill();
            let _ = daemon.wait();
        }
    }
}

impl<'a> Slurm<'a> {
    fn start(folder: &'a Folder, [controller, node]: [&Path; 2]) -> Self {
        let said = |words: &[&str]| {
            let output = Command::new(words[0]).args(&words[1..]).output().unwrap();
            String::from_utf8(output.stdout).unwrap().trim().to_string()
        };
        let (host, user) = (said(&["uname", "-n"]), said(&["id", "-un"]));
        // Free ones: they are let go when all three are known.
        let ports = [(); 3].map(|()| TcpListener::bind("127.0.0.1:0").unwrap());
        let [port, first, second] = ports.each_ref().map(|p| p.local_addr().unwrap().port());
        drop(ports);
        let place = folder.path("slurm");
        std::fs::create_dir_all(place.join("state")).unwrap();
        let place = place.display();
        let node_line = |n: usize, port: u16| {
            format!(
                "NodeName=n{n} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs=1 State=UNKNOWN"
            )
        };
        let lines = [
            "ClusterName=ci".into(),
            format!("SlurmctldHost={host}(127.0.0.1)"),
            format!("SlurmctldPort={port}"),
            "AuthType=auth/none".into(),
            "CredType=cred/none".into(),
            format!("SlurmUser={user}"),
            format!("SlurmdUser={user}"),
            format!("StateSaveLocation={place}/state"),
            format!("SlurmdSpoolDir={place}/spool-%n"),
            format!("SlurmctldPidFile={place}/c.pid"),
            format!("SlurmdPidFile={place}/%n.pid"),
            "ProctrackType=proctrack/linuxproc".into(),
            "TaskPlugin=task/none".into(),
            "JobAcctGatherType=jobacct_gather/none".into(),
            "SelectType=select/cons_tres".into(),
            "SelectTypeParameters=CR_CPU".into(),
            "ReturnToService=2".into(),
            "MpiDefault=none".into(),
            "SchedulerParameters=sched_interval=1".into(),
            node_line(1, first),
            node_line(2, second),
            "PartitionName=main Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP".into(),
        ];
        folder.write("slurm.conf", &(lines.join("\n") + "\n"));
        let mut slurm = Self { folder, daemons: Vec::new() };
        for (program, words) in
            [(controller, &["-D"][..]), (node, &["-D", "-N", "n1"]), (node, &["-D", "-N", "n2"])]
        {
            let mut command = Command::new(program);
            command.args(words).arg("-f").arg(folder.path("slurm.conf"));
            command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
            slurm.daemons.push(command.spawn().unwrap());
        }
        slurm
    }

    /// Runs a command of Slurm with the test's configuration. Returns its standard output, `None` if it fails.
    fn query(&self, program: &str, words: &[&str]) -> Option<String> {
        let rodfit = Path::new(env!("CARGO_BIN_EXE_rodfit")).parent().unwrap();
        let path = std::env::var_os("PATH").unwrap_or_default();
        let folders = std::iter::once(rodfit.to_path_buf()).chain(std::env::split_paths(&path));
        let output = Command::new(program)
            .args(words)
            .env("SLURM_CONF", self.folder.path("slurm.conf"))
            .env("PATH", std::env::join_paths(folders).unwrap())
            .current_dir(self.folder.path(""))
            .stdin(Stdio::null())
            .output()
            .unwrap();
        output.status.success().then(|| String::from_utf8(output.stdout).unwrap())
    }
}

/// Waits until `done` is true, checked every 0.1 s; fails after a minute.
#[track_caller]
fn until(mut done: impl FnMut() -> bool) {
    let since = Instant::now();
    while !done() {
        assert!(since.elapsed() < Duration::from_secs(60), "not within a minute");
        sleep(Duration::from_millis(100));
    }
}

#[test]
fn killed_job_array_collects_to_the_same_bytes() {
    let programs = ["slurmctld", "slurmd", "sbatch", "scancel"].map(program);
    let [Some(controller), Some(node), Some(_), Some(_)] = &programs else {
        eprintln!("skipped: Slurm (slurmctld, slurmd, sbatch, scancel) is not installed");
        return;
    };
    let folder = folder(CAMPAIGN);
    plan(&folder, "out");
    let slurm = Slurm::start(&folder, [controller, node]);
    until(|| {
        let idle = slurm.query("sinfo", &["-h", "-t", "idle", "-o", "%D"]);
        idle.is_some_and(|text| text.trim() == "2")
    });
    for shards in ["4", "7"] {
        let script =
            folder.run(&["campaign", "sbatch", "out", "--time", "0:10:00", "--shards", shards]);
        succeeds(&script);
        folder.write(&format!("job-{shards}.sh"), &stdout(&script));
    }
    // Four shards, killed as soon as there is something to lose.
    let job = slurm.query("sbatch", &["--parsable", "job-4.sh"]).unwrap();
    until(|| stored(&folder) > 1);
    slurm.query("scancel", &["-f", "-s", "KILL", job.trim()]).unwrap();
    slurm.query("scancel", &[job.trim()]).unwrap();
    until(|| slurm.query("squeue", &["-h"]).is_some_and(|text| text.trim().is_empty()));
    let done = stored(&folder);
    // Some of the 24 tasks are done, but not all: the job was killed in between.
    assert!((2..24).contains(&done), "{done}");
    // Seven.
    slurm.query("sbatch", &["--wait", "job-7.sh"]).expect("all jobs end well");
    assert_eq!(stored(&folder), 24);
    plan(&folder, "alone");
    run(&folder, "alone", &[]);
    assert_eq!(collected(&folder, "out"), collected(&folder, "alone"));
}
