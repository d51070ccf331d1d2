//! The service manager's list of services.

use std::{io, ptr};

use windows_sys::{
    Win32::{
        Foundation::{
            ERROR_ACCESS_DENIED, ERROR_INVALID_LEVEL, ERROR_INVALID_SERVICE_ACCOUNT,
            ERROR_SERVICE_CANNOT_ACCEPT_CTRL, ERROR_SERVICE_DOES_NOT_EXIST, ERROR_SERVICE_EXISTS,
            ERROR_SERVICE_MARKED_FOR_DELETE, ERROR_SERVICE_NOT_ACTIVE,
        },
        Security::LookupAccountNameW,
        Storage::FileSystem::DELETE,
        System::Services::{
            ChangeServiceConfig2W, CloseServiceHandle, ControlService, CreateServiceW, DeleteService,
            OpenSCManagerW, OpenServiceW, QUERY_SERVICE_CONFIGW, QueryServiceConfigW, QueryServiceStatus,
            SC_ACTION, SC_ACTION_RESTART, SC_HANDLE, SC_MANAGER_CONNECT, SC_MANAGER_CREATE_SERVICE,
            SERVICE_ALL_ACCESS, SERVICE_AUTO_START, SERVICE_CONFIG, SERVICE_CONFIG_DESCRIPTION,
            SERVICE_CONFIG_FAILURE_ACTIONS, SERVICE_CONFIG_FAILURE_ACTIONS_FLAG,
            SERVICE_CONFIG_PRESHUTDOWN_INFO, SERVICE_CONTROL_STOP, SERVICE_DESCRIPTIONW,
            SERVICE_ERROR_NORMAL, SERVICE_FAILURE_ACTIONS_FLAG, SERVICE_FAILURE_ACTIONSW,
            SERVICE_PRESHUTDOWN_INFO, SERVICE_QUERY_CONFIG, SERVICE_QUERY_STATUS, SERVICE_STATUS,
            SERVICE_STOP, SERVICE_STOPPED, SERVICE_WIN32_OWN_PROCESS,
        },
    },
    core::PWSTR,
};

use super::identity;
use crate::Service;

/// After these times (ms) a service that has failed is started again, and after the last of them each time from then on.
const PAUSES: [u32; 3] = [10_000, 10_000, 60_000];
/// After a time without failures (s) the first of the pauses comes next.
const FORGIVEN: u32 = 3_600;
/// How long a machine that is shut down waits for a service (ms): a worker or a master takes 60 s.
const SHUTDOWN_LIMIT: u32 = 90_000;
/// Most bytes that the manager tells of one service.
const CONFIG_LIMIT: usize = 8192;

/// Accounts that every Windows has, whatever their names are in its language.
const KNOWN: [(&str, &str, &str); 3] = [
    ("LocalService", r"NT AUTHORITY\LocalService", "S-1-5-19"),
    ("NetworkService", r"NT AUTHORITY\NetworkService", "S-1-5-20"),
    ("LocalSystem", "LocalSystem", "S-1-5-18"),
];

fn known(account: &str) -> Option<(&'static str, &'static str)> {
    let name = account.rsplit_once('\\').map_or(account, |(domain, name)| {
        if domain.eq_ignore_ascii_case("NT AUTHORITY") { name } else { account }
    });
    let found = KNOWN.iter().find(|(short, ..)| short.eq_ignore_ascii_case(&name.replace(' ', "")));
    found.map(|(_, full, user)| (*full, *user))
}

/// A text as the system reads it.
pub fn wide(text: &str) -> Result<Vec<u16>, String> {
    if text.contains('\0') {
        return Err(format!("{text:?}: a name has no zero letters"));
    }
    Ok(text.encode_utf16().chain([0]).collect())
}

/// The user that an account is, as lists of access name it.
pub fn user_of(account: &str) -> Result<String, String> {
    if let Some((_, user)) = known(account) {
        return Ok(user.to_owned());
    }
    // A dot stands for this machine, which is looked at first.
    let name = wide(account.strip_prefix(r".\").unwrap_or(account))?;
    let (mut user, mut domain) = ([0_u64; 16], [0_u16; 256]);
    let (mut bytes, mut letters, mut kind) = (size_of_val(&user) as u32, domain.len() as u32, 0);
    // SAFETY: the name ends in a zero; both buffers have the room that is told and are aligned for what is written; what `written`
    // gets is a name that the system has just written.
    let written = unsafe {
        let done = LookupAccountNameW(
            ptr::null(),
            name.as_ptr(),
            user.as_mut_ptr().cast(),
            &raw mut bytes,
            domain.as_mut_ptr(),
            &raw mut letters,
            &raw mut kind,
        );
        if done == 0 { Err(io::Error::last_os_error()) } else { identity::written(user.as_mut_ptr().cast()) }
    };
    written.map_err(|e| format!("account {account}: {e}"))
}

/// A handle of the manager's.
struct Handle(SC_HANDLE);

impl Handle {
    /// Takes what a call gave.
    fn new(given: SC_HANDLE) -> io::Result<Self> {
        if given.is_null() { Err(io::Error::last_os_error()) } else { Ok(Self(given)) }
    }
}

impl Drop for Handle {
    fn drop(&mut self) {
        // SAFETY: it was given to us to close, once.
        unsafe {
            CloseServiceHandle(self.0);
        }
    }
}

fn checked(done: i32) -> io::Result<()> {
    if done == 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

/// A service in the list.
pub struct Entry {
    name: String,
    handle: Handle,
}

impl Entry {
    /// Adds one that starts with the machine by this command line.
    ///
    /// # Errors
    /// Why not, as a sentence.
    pub fn create(service: &Service, command_line: &str) -> Result<Self, String> {
        let fault = |e: io::Error| explain(&service.name, &service.account, &e);
        let (name, title) = (wide(&service.name)?, wide(&service.title)?);
        let line = wide(command_line)?;
        let account = wide(known(&service.account).map_or(&*service.account, |(full, _)| full))?;
        let password = service.password.as_deref().map(wide).transpose()?;
        let manager = manager(SC_MANAGER_CONNECT | SC_MANAGER_CREATE_SERVICE).map_err(fault)?;
        // SAFETY: all texts end in a zero and live to the end of the call; what is null may be.
        let handle = Handle::new(unsafe {
            CreateServiceW(
                manager.0,
                name.as_ptr(),
                title.as_ptr(),
                SERVICE_ALL_ACCESS,
                SERVICE_WIN32_OWN_PROCESS,
                SERVICE_AUTO_START,
                SERVICE_ERROR_NORMAL,
                line.as_ptr(),
                ptr::null(),
                ptr::null_mut(),
                ptr::null(),
                account.as_ptr(),
                password.as_ref().map_or(ptr::null(), |password| password.as_ptr()),
            )
        });
        Ok(Self { name: service.name.clone(), handle: handle.map_err(fault)? })
    }

    /// Finds one, to remove it.
    ///
    /// # Errors
    /// If there is none, or this user may not.
    pub fn open(name: &str) -> Result<Self, String> {
        let fault = |e: io::Error| explain(name, "", &e);
        let text = wide(name)?;
        let manager = manager(SC_MANAGER_CONNECT).map_err(fault)?;
        let rights = DELETE | SERVICE_STOP | SERVICE_QUERY_STATUS | SERVICE_QUERY_CONFIG;
        // SAFETY: the name ends in a zero.
        let handle = Handle::new(unsafe { OpenServiceW(manager.0, text.as_ptr(), rights) });
        Ok(Self { name: name.to_owned(), handle: handle.map_err(fault)? })
    }

    /// Tells the manager what it is for, when to start it again and how long to wait for it. False if this system starts again only
    /// what crashes.
    ///
    /// # Errors
    /// If the manager refuses.
    pub fn describe(&self, description: &str) -> Result<bool, String> {
        let mut text = wide(description)?;
        let description = SERVICE_DESCRIPTIONW { lpDescription: text.as_mut_ptr() };
        let mut actions = PAUSES.map(|pause| SC_ACTION { Type: SC_ACTION_RESTART, Delay: pause });
        let failures = SERVICE_FAILURE_ACTIONSW {
            dwResetPeriod: FORGIVEN,
            cActions: actions.len() as u32,
            lpsaActions: actions.as_mut_ptr(),
            ..Default::default()
        };
        let shutdown = SERVICE_PRESHUTDOWN_INFO { dwPreshutdownTimeout: SHUTDOWN_LIMIT };
        let errors_too = SERVICE_FAILURE_ACTIONS_FLAG { fFailureActionsOnNonCrashFailures: 1 };
        // SAFETY: each kind stands beside a value of its type, and what these point to lives to the end of this function.
        unsafe {
            self.change(SERVICE_CONFIG_DESCRIPTION, &description)
                .and_then(|()| self.change(SERVICE_CONFIG_FAILURE_ACTIONS, &failures))
                .and_then(|()| self.change(SERVICE_CONFIG_PRESHUTDOWN_INFO, &shutdown))
                .map_err(|e| self.explain(&e))?;
            match self.change(SERVICE_CONFIG_FAILURE_ACTIONS_FLAG, &errors_too) {
                Ok(()) => Ok(true),
                Err(e) if e.raw_os_error() == Some(ERROR_INVALID_LEVEL as i32) => Ok(false),
                Err(e) => Err(self.explain(&e)),
            }
        }
    }

    /// # Safety
    /// `value` must be of the type that this kind has.
    unsafe fn change<T>(&self, kind: SERVICE_CONFIG, value: &T) -> io::Result<()> {
        // SAFETY: the handle is open, and the caller says that the value is of the kind.
        checked(unsafe { ChangeServiceConfig2W(self.handle.0, kind, ptr::from_ref(value).cast()) })
    }

    /// What the manager starts it with.
    ///
    /// # Errors
    /// If the manager does not say.
    pub fn command_line(&self) -> Result<String, String> {
        let (mut buffer, mut needed) = ([0_u64; CONFIG_LIMIT / 8], 0);
        let config: *mut QUERY_SERVICE_CONFIGW = buffer.as_mut_ptr().cast();
        // SAFETY: the buffer has the room that is told, and is aligned for what is written.
        checked(unsafe { QueryServiceConfigW(self.handle.0, config, CONFIG_LIMIT as u32, &raw mut needed) })
            .map_err(|e| self.explain(&e))?;
        // SAFETY: the manager has written it, with its texts behind it in the same buffer.
        Ok(unsafe { text((*config).lpBinaryPathName) })
    }

    /// Asks it to stop, if it runs; whether it has stopped.
    ///
    /// # Errors
    /// If the manager refuses.
    pub fn stop(&self) -> Result<bool, String> {
        let mut status = SERVICE_STATUS::default();
        // SAFETY: the handle is open and the status is ours.
        checked(unsafe { QueryServiceStatus(self.handle.0, &raw mut status) })
            .map_err(|e| self.explain(&e))?;
        if status.dwCurrentState == SERVICE_STOPPED {
            return Ok(true);
        }
        // SAFETY: the handle is open and the status is ours.
        let asked = checked(unsafe { ControlService(self.handle.0, SERVICE_CONTROL_STOP, &raw mut status) });
        match asked.map_err(|e| (e.raw_os_error().map_or(0, i32::cast_unsigned), e)) {
            // It is starting, or stopping already.
            Ok(()) | Err((ERROR_SERVICE_CANNOT_ACCEPT_CTRL | ERROR_SERVICE_NOT_ACTIVE, _)) => Ok(false),
            Err((_, e)) => Err(self.explain(&e)),
        }
    }

    /// Takes it out of the list.
    ///
    /// # Errors
    /// If the manager refuses.
    pub fn delete(&self) -> Result<(), String> {
        // SAFETY: the handle is open.
        checked(unsafe { DeleteService(self.handle.0) }).map_err(|e| self.explain(&e))
    }

    fn explain(&self, error: &io::Error) -> String {
        explain(&self.name, "", error)
    }
}

fn manager(rights: u32) -> io::Result<Handle> {
    // SAFETY: nothing stands for this machine and its only list.
    Handle::new(unsafe { OpenSCManagerW(ptr::null(), ptr::null(), rights) })
}

/// A copy of a text of the system's.
///
/// # Safety
/// It must be null or end in a zero.
unsafe fn text(from: PWSTR) -> String {
    if from.is_null() {
        return String::new();
    }
    // SAFETY: the caller says that it ends in a zero.
    unsafe {
        let mut length = 0;
        while *from.add(length) != 0 {
            length += 1;
        }
        String::from_utf16_lossy(std::slice::from_raw_parts(from, length))
    }
}

/// What to do about an error of the manager's.
fn explain(name: &str, account: &str, error: &io::Error) -> String {
    let help = match error.raw_os_error().map_or(0, i32::cast_unsigned) {
        ERROR_ACCESS_DENIED => "; run this as administrator".to_owned(),
        ERROR_SERVICE_EXISTS => {
            format!("; `bolide service remove {name}` removes it, --name NAME makes another beside it")
        }
        ERROR_SERVICE_DOES_NOT_EXIST => {
            "; `sc.exe query type= service state= all` lists what there is".to_owned()
        }
        ERROR_SERVICE_MARKED_FOR_DELETE => "; close the windows that show services, and try again".to_owned(),
        ERROR_INVALID_SERVICE_ACCOUNT => {
            format!(": {account}; users are DOMAIN\\NAME or .\\NAME, with --password-from FILE")
        }
        _ => String::new(),
    };
    format!("service {name}: {error}{help}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accounts_that_every_windows_has_are_known_in_every_language() {
        for (account, full, user) in [
            ("localservice", r"NT AUTHORITY\LocalService", "S-1-5-19"),
            (r"NT AUTHORITY\Local Service", r"NT AUTHORITY\LocalService", "S-1-5-19"),
            (r"nt authority\NetworkService", r"NT AUTHORITY\NetworkService", "S-1-5-20"),
            ("LocalSystem", "LocalSystem", "S-1-5-18"),
        ] {
            assert_eq!(known(account), Some((full, user)), "{account}");
            assert_eq!(user_of(account).as_deref(), Ok(user));
        }
        assert_eq!(known(r"LAB\LocalService"), None);
        assert!(user_of(r".\nobody of that name").unwrap_err().contains("nobody of that name"));
    }

    #[test]
    fn errors_say_what_to_do() {
        let why = |error: u32| explain("b", r"LAB\x", &io::Error::from_raw_os_error(error.cast_signed()));
        assert!(why(ERROR_ACCESS_DENIED).ends_with("; run this as administrator"));
        assert!(why(ERROR_SERVICE_EXISTS).contains("bolide service remove b"));
        assert!(why(ERROR_INVALID_SERVICE_ACCOUNT).contains(r": LAB\x; "));
        assert!(wide("a\0b").is_err());
    }
}
