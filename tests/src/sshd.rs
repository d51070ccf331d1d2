//! SSHD: a real OpenSSH server on loopback with keys of its own, for the present user alone.

use std::{
    net::TcpListener,
    path::{Path, PathBuf},
    process::Command,
};

use crate::cluster::{Process, said};

/// A server in a folder of its own, ended with this value.
pub struct Sshd {
    /// Where it listens on 127.0.0.1.
    pub port: u16,
    /// What makes ssh know the server and the key, as a file for `ssh -F`.
    pub config: PathBuf,
    process: Process,
}

/// The server's program, if this machine has one.
pub fn find() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::env::split_paths(&path).chain(["/usr/sbin".into(), "/usr/local/sbin".into()]);
    folders.map(|folder| folder.join("sshd")).find(|program| program.is_file())
}

impl Sshd {
    /// Starts it with all its files in `folder`, which is also the home of those who log in.
    ///
    /// # Panics
    /// If it does not come up.
    pub fn start(program: &Path, folder: &Path) -> Self {
        for name in ["host", "user"] {
            let made = said(
                Command::new("ssh-keygen")
                    .args(["-q", "-t", "ed25519", "-N", "", "-f"])
                    .arg(folder.join(name)),
            );
            assert_eq!(made.code, Some(0), "{made:?}");
        }
        let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("a key that was just made");
        let write = |name: &str, text: &str| {
            let path = folder.join(name);
            std::fs::write(&path, text).expect("room");
            path
        };
        write("authorized", &read("user.pub"));
        // The separation of privileges wants this folder of whoever is root.
        let _ = std::fs::create_dir_all("/run/sshd");
        let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a free port").port();
        let here = folder.display();
        let config = write(
            "sshd_config",
            &format!(
                "ListenAddress 127.0.0.1:{port}\nHostKey {here}/host\nAuthorizedKeysFile {here}/authorized\n\
                 PidFile none\nStrictModes no\nUsePAM no\nPasswordAuthentication no\nSetEnv HOME={here}\n"
            ),
        );
        let mut command = Command::new(program);
        let process = Process::start("sshd", command.args(["-D", "-e", "-f"]).arg(config));
        process.wait_for("Server listening on");
        write("known", &format!("[127.0.0.1]:{port} {}", read("host.pub")));
        let config = write(
            "ssh_config",
            &format!(
                "UserKnownHostsFile {here}/known\nGlobalKnownHostsFile none\nIdentityFile {here}/user\n\
                 IdentitiesOnly yes\nIdentityAgent none\n"
            ),
        );
        Self { port, config, process }
    }

    /// What it printed.
    pub fn text(&self) -> String {
        self.process.text()
    }
}
