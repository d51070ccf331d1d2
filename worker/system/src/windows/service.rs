//! Programs that the service manager starts with the machine: their registration, and this process as one of them.

use std::{
    fs::{self, OpenOptions},
    io,
    os::windows::io::IntoRawHandle,
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    ptr,
    sync::{Mutex, OnceLock, PoisonError},
    time::{Duration, Instant},
};

use tokio::sync::watch;
use windows_sys::Win32::{
    Foundation::{
        ERROR_CALL_NOT_IMPLEMENTED, ERROR_FAILED_SERVICE_CONTROLLER_CONNECT, ERROR_GEN_FAILURE, NO_ERROR,
    },
    System::{
        Console::{STD_ERROR_HANDLE, STD_OUTPUT_HANDLE, SetStdHandle},
        Services::{
            RegisterServiceCtrlHandlerExW, SERVICE_CONTROL_INTERROGATE, SERVICE_CONTROL_PRESHUTDOWN,
            SERVICE_CONTROL_SHUTDOWN, SERVICE_CONTROL_STOP, SERVICE_TABLE_ENTRYW,
            StartServiceCtrlDispatcherW,
        },
    },
};

use super::{
    identity,
    notice::{self, End},
    private,
    registry::{self, Entry},
};
use crate::{Body, Service, command_line};

/// The greatest log (bytes) that the next start goes on with.
const LOG_LIMIT: u64 = 16 << 20;
/// The longest that a service may take to stop before it is removed: a worker or a master takes 60 s.
const STOP_LIMIT: Duration = Duration::from_secs(100);
/// What a process ends with that broke off with a bug.
const PANICKED: u8 = 101;

/// What this process does as a service, until the manager has it begin.
static TASK: Mutex<Option<Task>> = Mutex::new(None);
/// How often this process was asked to stop, if it is a service.
static STOPS: OnceLock<watch::Sender<u32>> = OnceLock::new();

struct Task {
    name: String,
    folder: PathBuf,
    body: Body,
}

/// Where a service starts that names no folder: `C:\ProgramData\bolide\NAME`.
///
/// # Errors
/// If Windows does not say where it keeps data of programs.
pub fn folder(name: &str) -> Result<PathBuf, String> {
    match std::env::var_os("ProgramData") {
        Some(data) if !data.is_empty() => Ok(Path::new(&data).join("bolide").join(name)),
        _ => {
            Err("the environment has no ProgramData, which is where Windows keeps data of programs"
                .to_owned())
        }
    }
}

/// The log of a service in its folder.
fn log(name: &str, folder: &Path) -> PathBuf {
    folder.join(format!("{name}.log"))
}

/// Registers a service; gives lines that its user should read.
///
/// # Errors
/// Why not, as a sentence; nothing is registered then.
pub fn install(service: &Service) -> Result<Vec<String>, String> {
    let exe = std::env::current_exe().map_err(|e| format!("the path of this program: {e}"))?;
    let path = exe.to_str().ok_or_else(|| format!("{}: not Unicode", exe.display()))?;
    let line = command_line::join(path, &service.arguments)?;
    let entry = Entry::create(service, &line)?;
    let told = prepare(service, &entry, path);
    if told.is_err() {
        // The first error is the one to tell.
        let _ = entry.delete();
    }
    told
}

/// Says what happens after failures, and lets the account have its folder and secrets.
fn prepare(service: &Service, entry: &Entry, exe: &str) -> Result<Vec<String>, String> {
    let mut told = vec![format!("log: {}", log(&service.name, &service.folder).display())];
    if !entry.describe(&service.description)? {
        told.push("this system restarts services that crash, and none that end with an error".to_owned());
    }
    let user = registry::user_of(&service.account)?;
    let fault = |path: &Path| {
        let path = path.display().to_string();
        move |e: io::Error| format!("{path}: {e}")
    };
    if service.folder.is_symlink() {
        return Err(format!("{}: a link; name another folder with --folder", service.folder.display()));
    }
    fs::create_dir_all(&service.folder).map_err(fault(&service.folder))?;
    // Everybody may make folders where data of programs are kept.
    let owner = private::owner(&service.folder).map_err(fault(&service.folder))?;
    let own = identity::own().map_err(|e| format!("the user of this program: {e}"))?;
    if ![&*user, &*own].into_iter().chain(identity::ADMINISTRATORS).any(|trusted| trusted == owner) {
        let folder = service.folder.display();
        return Err(format!(
            "{folder} belongs to {owner}, who could change what the service keeps; remove it, or name another with --folder"
        ));
    }
    private::give(&service.folder, &user).map_err(fault(&service.folder))?;
    for path in service.secrets.iter().filter(|path| path.exists()) {
        private::give(path, &user).map_err(fault(path))?;
        told.push(format!("{}: for {} and administrators alone now", path.display(), service.account));
    }
    for folder in service.needs.iter().filter(|folder| folder.exists()) {
        let folder = folder.display();
        told.push(format!("it needs {folder}: run icacls \"{folder}\" /grant \"*{user}:(OI)(CI)F\" /t"));
    }
    let profile = std::env::var("USERPROFILE").ok().filter(|profile| !profile.is_empty());
    if profile.is_some_and(|profile| exe.to_lowercase().starts_with(&profile.to_lowercase())) {
        told.push(format!(
            "{exe} is in a user's profile, where {} may not read: if it does not start, move it to C:\\Program Files",
            service.account
        ));
    }
    Ok(told)
}

/// Stops a service, if it runs, and takes it out of the list.
///
/// # Errors
/// If there is none, if it is another program's, or if it does not stop.
pub fn remove(name: &str) -> Result<(), String> {
    let entry = Entry::open(name)?;
    let line = entry.command_line()?;
    if !command_line::split(&line)
        .get(1..)
        .is_some_and(|words| words.starts_with(&Service::RUN.map(String::from)))
    {
        return Err(format!(
            "service {name} is not one of Bolide, it runs {line}; `sc.exe delete` removes it"
        ));
    }
    let began = Instant::now();
    // One that is starting hears it later.
    while !entry.stop()? {
        if began.elapsed() > STOP_LIMIT {
            let seconds = STOP_LIMIT.as_secs();
            return Err(format!("service {name} has not stopped within {seconds} s; it was not removed"));
        }
        std::thread::sleep(Duration::from_millis(200));
    }
    entry.delete()
}

/// Runs as a service: does `body` when the manager says so, in `folder`, where standard output and standard error go to the log.
///
/// # Errors
/// If it was not the manager that started this process.
pub fn run(name: &str, folder: &Path, body: Body) -> Result<(), String> {
    let mut wide = registry::wide(name)?;
    *TASK.lock().unwrap_or_else(PoisonError::into_inner) =
        Some(Task { name: name.to_owned(), folder: folder.to_owned(), body });
    let table = [
        SERVICE_TABLE_ENTRYW { lpServiceName: wide.as_mut_ptr(), lpServiceProc: Some(begin) },
        SERVICE_TABLE_ENTRYW::default(),
    ];
    // SAFETY: the table and the name, which ends in a zero, live until this returns: after the service has stopped.
    if unsafe { StartServiceCtrlDispatcherW(table.as_ptr()) } != 0 {
        return Ok(());
    }
    let error = io::Error::last_os_error();
    if error.raw_os_error() == Some(ERROR_FAILED_SERVICE_CONTROLLER_CONNECT as i32) {
        return Err(format!("the service manager alone starts this: net start {name}"));
    }
    Err(format!("service {name}: {error}"))
}

/// Hears how often this process is asked to stop; none if it is no service.
pub(super) fn stops() -> Option<watch::Receiver<u32>> {
    STOPS.get().map(watch::Sender::subscribe)
}

/// The manager calls it on a thread of its own.
unsafe extern "system" fn begin(_n: u32, _arguments: *mut *mut u16) {
    let Some(Task { name, folder, body }) = TASK.lock().unwrap_or_else(PoisonError::into_inner).take() else {
        return;
    };
    STOPS.get_or_init(|| watch::channel(0).0);
    let Ok(wide) = registry::wide(&name) else { return };
    // SAFETY: the name ends in a zero; the function takes nothing of ours.
    let handle = unsafe { RegisterServiceCtrlHandlerExW(wide.as_ptr(), Some(hear), ptr::null()) };
    if handle.is_null() {
        return;
    }
    // A manager that does not listen sees that the process ends.
    let _ = notice::begin(handle);
    let end = match settle(&name, &folder) {
        Ok(()) => End::Code(catch_unwind(AssertUnwindSafe(body)).unwrap_or(PANICKED)),
        Err(error) => End::System(error.raw_os_error().map_or(ERROR_GEN_FAILURE, i32::cast_unsigned)),
    };
    notice::end(end);
}

/// The manager calls it when somebody wants something of the service.
unsafe extern "system" fn hear(
    control: u32,
    _kind: u32,
    _data: *mut std::ffi::c_void,
    _ours: *mut std::ffi::c_void,
) -> u32 {
    match control {
        SERVICE_CONTROL_STOP | SERVICE_CONTROL_SHUTDOWN | SERVICE_CONTROL_PRESHUTDOWN => {
            if notice::stop()
                && let Some(stops) = STOPS.get()
            {
                stops.send_modify(|n| *n += 1);
            }
            NO_ERROR
        }
        SERVICE_CONTROL_INTERROGATE => NO_ERROR,
        _ => ERROR_CALL_NOT_IMPLEMENTED,
    }
}

/// Goes to the folder, and has the log be standard output and standard error.
fn settle(name: &str, folder: &Path) -> io::Result<()> {
    std::env::set_current_dir(folder)?;
    let path = log(name, folder);
    if fs::metadata(&path).is_ok_and(|log| log.len() > LOG_LIMIT) {
        fs::rename(&path, path.with_extension("log.old"))?;
    }
    let file = OpenOptions::new().create(true).append(true).open(&path)?;
    for (stream, file) in [(STD_OUTPUT_HANDLE, file.try_clone()?), (STD_ERROR_HANDLE, file)] {
        // SAFETY: the handle is never closed, so it is good for as long as the process writes.
        if unsafe { SetStdHandle(stream, file.into_raw_handle()) } == 0 {
            return Err(io::Error::last_os_error());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_manager_runs_a_service_and_only_those_of_bolide_are_removed() {
        let body = || panic!("the manager did not start this test");
        let why = run("bolide-test", Path::new("."), Box::new(body)).unwrap_err();
        assert!(why.contains("net start bolide-test"), "{why}");
        assert!(stops().is_none());
        let why = remove("bolide-none").unwrap_err();
        assert!(why.contains("bolide-none"), "{why}");
        assert!(folder("b").expect("Windows says so").ends_with(r"bolide\b"));
    }
}
