//! What goes wrong on a weekend.

use std::{
    fs,
    io::Write,
    net::TcpStream,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use super::{JUMP, Weekend};

/// Kinds of decks that only acts submit: the last ones of the list.
pub(super) const SPECIAL: usize = 2;
/// Index of the deck that fails.
const POISON: usize = 4;
/// Index of the deck that wants more workers than there are.
pub(super) const CROWD: usize = 5;
/// By so much the clock is wrong (s).
const JUMPS: [i64; 6] = [3_600, -3_600, 86_400, -86_400, 4 * 365 * 86_400, -4 * 365 * 86_400];
/// Callers that say nothing.
const IDLE: usize = 300;

/// One thing that goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Act {
    KillWorker,
    KillTwoWorkers,
    KillMaster,
    /// SIGSTOP for 1 to 13 s.
    StopWorker,
    /// SIGSTOP for 1 to 5 s.
    StopMaster,
    LeaveWorker,
    LeaveMaster,
    /// No room on the disk of the spool for 4 s.
    FullDisk,
    /// The wall clock of the master is wrong for 4 s: by an hour, a day or four years, ahead or back.
    ClockJump,
    /// One bit of a record, deck or snapshot; then the master is killed.
    FlipInFile,
    /// 300 connections that say nothing, to the master and its page.
    IdleSockets,
    Garbage,
    /// A job that fails.
    Poison,
    /// A job that wants nine workers.
    Crowd,
    Cancel,
    /// A worker with a certificate of another CA.
    WrongCertificate,
    /// A worker whose arithmetic is wrong.
    WrongArithmetic,
}

impl Act {
    const ALL: [Self; 17] = [
        Self::KillWorker,
        Self::KillTwoWorkers,
        Self::KillMaster,
        Self::StopWorker,
        Self::StopMaster,
        Self::LeaveWorker,
        Self::LeaveMaster,
        Self::FullDisk,
        Self::ClockJump,
        Self::FlipInFile,
        Self::IdleSockets,
        Self::Garbage,
        Self::Poison,
        Self::Crowd,
        Self::Cancel,
        Self::WrongCertificate,
        Self::WrongArithmetic,
    ];

    /// For the report.
    pub const fn name(self) -> &'static str {
        match self {
            Self::KillWorker => "kill -9 of a worker",
            Self::KillTwoWorkers => "kill -9 of two workers",
            Self::KillMaster => "kill -9 of the master",
            Self::StopWorker => "SIGSTOP of a worker, 1 to 13 s",
            Self::StopMaster => "SIGSTOP of the master, 1 to 5 s",
            Self::LeaveWorker => "SIGTERM to a worker",
            Self::LeaveMaster => "SIGTERM to the master",
            Self::FullDisk => "full disk of the spool, 4 s",
            Self::ClockJump => "the master's wall clock jumps, and back after 4 s",
            Self::FlipInFile => "a bit of a record, deck or snapshot flips; kill -9 of the master",
            Self::IdleSockets => "300 callers that say nothing",
            Self::Garbage => "garbage at both ports",
            Self::Poison => "a job that fails",
            Self::Crowd => "a job that wants nine workers",
            Self::Cancel => "a job is cancelled",
            Self::WrongCertificate => "a worker with a certificate of another CA",
            Self::WrongArithmetic => "a worker that errs by one unit in the last place",
        }
    }
}

impl Weekend {
    /// Does one act that is drawn.
    pub(super) fn act(&mut self) {
        let act = Act::ALL[self.draws.below(Act::ALL.len() as u64) as usize];
        if self.perform(act) {
            *self.acts.entry(act).or_default() += 1;
        }
    }

    /// Gives whether it was possible.
    fn perform(&mut self, act: Act) -> bool {
        let number = self.draws.below(1 << 20);
        match act {
            Act::KillWorker => self.crew.kill(number),
            Act::KillTwoWorkers => {
                self.crew.kill(number);
                self.crew.kill(number + 2);
            }
            Act::KillMaster => {
                self.cluster.master.kill();
                self.revive();
            }
            Act::StopWorker => self.crew.stop(number, Duration::from_secs(1 + number % 13)),
            Act::StopMaster => {
                self.cluster.master.signal("STOP");
                std::thread::sleep(Duration::from_secs(1 + number % 5));
                self.cluster.master.signal("CONT");
            }
            Act::LeaveWorker => self.crew.signal(number, "TERM"),
            Act::LeaveMaster => {
                self.cluster.master.signal("TERM");
                let code = self.cluster.master.wait().code();
                if code != Some(0) {
                    self.seen.wrong.push(format!("a master told to leave ended with {code:?}"));
                }
                self.revive();
            }
            Act::FullDisk => return self.fill_disk(),
            Act::ClockJump => return self.jump_clock(number),
            Act::FlipInFile => return self.flip_in_file(),
            Act::IdleSockets => self.idle_sockets(),
            Act::Garbage => {
                for address in self.addresses() {
                    // It hangs up in the middle of it.
                    let _ =
                        TcpStream::connect(address).and_then(|mut stream| stream.write_all(&[0x5a; 4096]));
                }
            }
            Act::Poison => return self.submit(POISON, &[]),
            Act::Crowd => return self.submit(CROWD, &["--min-workers", "9"]),
            Act::Cancel => {
                let open = self.jobs.iter().filter(|(_, state)| !super::is_over(state));
                let open: Vec<u64> = open.map(|(job, _)| *job).collect();
                if open.is_empty() {
                    return false;
                }
                self.cancel(open[number as usize % open.len()]);
            }
            Act::WrongCertificate => {
                let certs = self.cluster.folder().join("others/worker");
                let told = self.crew.call_with_certificate_of(&self.cluster, certs);
                if !told.contains("another CA") && !told.contains("no master at") {
                    self.seen.wrong.push(format!("a certificate of another CA: {told}"));
                }
            }
            Act::WrongArithmetic => self.crew.invite_wrong(&self.cluster, Duration::from_secs(8)),
        }
        true
    }

    /// Fills what is left of the spool's disk.
    fn fill_disk(&mut self) -> bool {
        if self.disk.is_none() || self.full_until.is_some() {
            return false;
        }
        self.full_until = Some(Instant::now() + Duration::from_secs(4));
        let Ok(mut file) = fs::File::create(self.ballast()) else { return true };
        let block = vec![0; 1 << 16];
        // Until there is no room.
        while file.write_all(&block).is_ok() {}
        true
    }

    /// Sets the master's wall clock wrong, under which certificates are not yet valid or have expired.
    fn jump_clock(&mut self, number: u64) -> bool {
        let Some(clock) = self.clock.as_ref().filter(|_| self.wrong_until.is_none()) else { return false };
        let seconds = JUMPS[number as usize % JUMPS.len()];
        if let Err(error) = fs::write(clock.path().join(JUMP), seconds.to_string()) {
            self.seen.wrong.push(format!("the clock: {error}"));
        }
        self.wrong_until = Some(Instant::now() + Duration::from_secs(4));
        true
    }

    /// Flips a bit of one file of the queue, which the next master has to read.
    fn flip_in_file(&mut self) -> bool {
        let mut files = Vec::new();
        list(&self.cluster.folder().join("spool/queue"), &mut files);
        if files.is_empty() || self.full_until.is_some() {
            return false;
        }
        let path = &files[self.draws.below(files.len() as u64) as usize];
        self.cluster.master.kill();
        if let Ok(mut bytes) = fs::read(path)
            && !bytes.is_empty()
        {
            let at = self.draws.below(bytes.len() as u64) as usize;
            bytes[at] ^= 1 << self.draws.below(8);
            if let Err(error) = fs::write(path, bytes) {
                self.seen.wrong.push(format!("{}: {error}", path.display()));
            }
        }
        self.revive();
        true
    }

    fn idle_sockets(&self) {
        let addresses = self.addresses();
        let calls =
            (0..IDLE).filter_map(|number| TcpStream::connect(&addresses[number % addresses.len()]).ok());
        let idle: Vec<TcpStream> = calls.collect();
        std::thread::spawn(move || {
            std::thread::sleep(Duration::from_secs(5));
            drop(idle);
        });
    }

    /// Of the master and of its page.
    fn addresses(&self) -> Vec<String> {
        let text = self.cluster.master.text();
        let page =
            text.lines().find_map(|line| line.split("page: ").nth(1)?.split("//").nth(1)?.split('/').next());
        [Some(self.cluster.address.as_str()), page].into_iter().flatten().map(str::to_owned).collect()
    }
}

/// Files below a folder, by name.
fn list(folder: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() { list(&path, files) } else { files.push(path) }
    }
}
