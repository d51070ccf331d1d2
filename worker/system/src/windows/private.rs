//! Files that are their owner's alone: keys, tokens, and what a master keeps.
//!
//! A file has a list of who may do what. A closed one names its owner alone, and takes over nothing from its
//! folder; the administrators of the machine can take it over all the same.

use std::{
    fs::{self, File, OpenOptions},
    io,
    os::windows::{ffi::OsStrExt, fs::OpenOptionsExt},
    path::Path,
    ptr,
};

use windows_sys::Win32::{
    Foundation::{ERROR_SUCCESS, GENERIC_ALL, GENERIC_READ, LocalFree},
    Security::{
        ACCESS_ALLOWED_ACE, ACL,
        Authorization::{
            ConvertStringSecurityDescriptorToSecurityDescriptorW, GetNamedSecurityInfoW, SDDL_REVISION_1,
            SE_FILE_OBJECT, SetNamedSecurityInfoW,
        },
        DACL_SECURITY_INFORMATION, GetAce, GetSecurityDescriptorDacl, OWNER_SECURITY_INFORMATION,
        PROTECTED_DACL_SECURITY_INFORMATION, PSECURITY_DESCRIPTOR,
    },
    Storage::FileSystem::FILE_READ_DATA,
    System::SystemServices::{ACCESS_ALLOWED_ACE_TYPE, ACCESS_DENIED_ACE_TYPE},
};

use super::identity;
use crate::Readers;

/// What a folder hands on to the files and folders in it.
const HANDED_ON: &str = "OICI";

/// Has what this process makes in `folder`, which is made if there is none, be its user's alone.
///
/// # Errors
/// If the folder cannot be made or is not this user's.
pub fn from_now_on(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    close(folder)
}

/// Closes a folder, and what is made in it from now on.
///
/// # Errors
/// If it is not this user's.
pub fn close(folder: &Path) -> io::Result<()> {
    allow_owner_only(folder, HANDED_ON)
}

/// Opens a file as `options` say. One for its owner is closed before anybody else can open it.
///
/// # Errors
/// As for [`OpenOptions::open`].
pub fn open(options: &OpenOptions, path: &Path, readers: Readers) -> io::Result<File> {
    match readers {
        Readers::All => options.open(path),
        Readers::Owner => {
            // Shared with nobody until the value is dropped.
            let file = options.clone().share_mode(0).open(path)?;
            allow_owner_only(path, "")?;
            Ok(file)
        }
    }
}

/// Lets a user, written as `S-1-...`, and the administrators of the machine do all with a file, or with a folder and what is made in it
/// from now on; and nobody else.
pub(super) fn give(path: &Path, user: &str) -> io::Result<()> {
    let handed_on = if path.is_dir() { HANDED_ON } else { "" };
    let [system, administrators] = identity::ADMINISTRATORS;
    allow(path, &[user, administrators, system], handed_on)
}

/// Whose a file or folder is, written as `S-1-...`: he can change who may do what with it.
pub(super) fn owner(path: &Path) -> io::Result<String> {
    let path = wide(path)?;
    let mut descriptor = Descriptor(ptr::null_mut());
    let mut owner = ptr::null_mut();
    // SAFETY: the path ends in a zero; the name lies in the descriptor, which is ours to free and lives to the end of this function.
    unsafe {
        let result = GetNamedSecurityInfoW(
            path.as_ptr(),
            SE_FILE_OBJECT,
            OWNER_SECURITY_INFORMATION,
            &raw mut owner,
            ptr::null_mut(),
            ptr::null_mut(),
            ptr::null_mut(),
            &raw mut descriptor.0,
        );
        if result != ERROR_SUCCESS {
            return Err(io::Error::from_raw_os_error(result as i32));
        }
        identity::written(owner)
    }
}

/// Who else can read a file, and the command that ends that; nothing where nobody can.
///
/// # Errors
/// If it cannot be looked at.
pub fn open_to_others(path: &Path) -> io::Result<Option<String>> {
    let own = identity::own()?;
    let allowed =
        |user: &str| user == own || user == identity::OWNER || identity::ADMINISTRATORS.contains(&user);
    let other = readers(path)?.into_iter().find(|user| !allowed(user));
    let path = path.display();
    Ok(other.map(|user| {
        format!(
            "can be read by {user}, must be its owner's alone; run icacls \"{path}\" /inheritance:r /grant:r \"%USERNAME%:F\""
        )
    }))
}

/// A path as the system reads it.
fn wide(path: &Path) -> io::Result<Vec<u16>> {
    // An absolute one may be as long as it likes.
    let path = std::path::absolute(path)?;
    let text = path
        .as_os_str()
        .encode_wide()
        .map(|letter| if letter == u16::from(b'/') { u16::from(b'\\') } else { letter });
    Ok(text.chain([0]).collect())
}

/// A descriptor of the system's, which has to be freed.
struct Descriptor(PSECURITY_DESCRIPTOR);

impl Drop for Descriptor {
    fn drop(&mut self) {
        // SAFETY: it was given to us to free, once.
        unsafe {
            LocalFree(self.0);
        }
    }
}

fn allow_owner_only(path: &Path, handed_on: &str) -> io::Result<()> {
    allow(path, &[&identity::own()?], handed_on)
}

/// Replaces the list of a file or folder; `handed_on` says to whom it goes on.
fn allow(path: &Path, users: &[&str], handed_on: &str) -> io::Result<()> {
    let entries: String = users.iter().map(|user| format!("(A;{handed_on};FA;;;{user})")).collect();
    let text: Vec<u16> = format!("D:P{entries}").encode_utf16().chain([0]).collect();
    let mut descriptor = Descriptor(ptr::null_mut());
    let (mut present, mut dacl, mut default) = (0, ptr::null_mut(), 0);
    let path = wide(path)?;
    // SAFETY: both texts end in a zero; the list lies in the descriptor, which lives to the end of this function.
    unsafe {
        let done = ConvertStringSecurityDescriptorToSecurityDescriptorW(
            text.as_ptr(),
            SDDL_REVISION_1,
            &raw mut descriptor.0,
            ptr::null_mut(),
        );
        if done == 0
            || GetSecurityDescriptorDacl(descriptor.0, &raw mut present, &raw mut dacl, &raw mut default) == 0
        {
            return Err(io::Error::last_os_error());
        }
        let what = DACL_SECURITY_INFORMATION | PROTECTED_DACL_SECURITY_INFORMATION;
        let result = SetNamedSecurityInfoW(
            path.as_ptr(),
            SE_FILE_OBJECT,
            what,
            ptr::null_mut(),
            ptr::null_mut(),
            dacl,
            ptr::null(),
        );
        if result != ERROR_SUCCESS {
            return Err(io::Error::from_raw_os_error(result as i32));
        }
    }
    Ok(())
}

/// Everybody whom the list of a file lets read.
fn readers(path: &Path) -> io::Result<Vec<String>> {
    let path = wide(path)?;
    let mut descriptor = Descriptor(ptr::null_mut());
    let mut dacl: *mut ACL = ptr::null_mut();
    // SAFETY: the path ends in a zero; the list lies in the descriptor, which is ours to free.
    let result = unsafe {
        GetNamedSecurityInfoW(
            path.as_ptr(),
            SE_FILE_OBJECT,
            DACL_SECURITY_INFORMATION,
            ptr::null_mut(),
            ptr::null_mut(),
            &raw mut dacl,
            ptr::null_mut(),
            &raw mut descriptor.0,
        )
    };
    if result != ERROR_SUCCESS {
        return Err(io::Error::from_raw_os_error(result as i32));
    }
    if dacl.is_null() {
        return Ok(vec!["everybody".to_owned()]);
    }
    // SAFETY: the list lives in the descriptor.
    let n = u32::from(unsafe { (*dacl).AceCount });
    let mut readers = Vec::new();
    for i in 0..n {
        let mut entry = ptr::null_mut();
        // SAFETY: the list has an entry of this number; entries begin with their kind, and those of this kind have a name at their end.
        let (kind, mask, user) = unsafe {
            if GetAce(dacl, i, &raw mut entry) == 0 {
                return Err(io::Error::last_os_error());
            }
            let entry = entry.cast::<ACCESS_ALLOWED_ACE>();
            let kind = u32::from((*entry).Header.AceType);
            match kind {
                ACCESS_ALLOWED_ACE_TYPE => {
                    (kind, (*entry).Mask, identity::written((&raw mut (*entry).SidStart).cast())?)
                }
                _ => (kind, 0, String::new()),
            }
        };
        match kind {
            ACCESS_ALLOWED_ACE_TYPE if mask & (FILE_READ_DATA | GENERIC_READ | GENERIC_ALL) != 0 => {
                readers.push(user);
            }
            ACCESS_ALLOWED_ACE_TYPE | ACCESS_DENIED_ACE_TYPE => {}
            // Entries with conditions may let somebody in.
            other => readers.push(format!("an entry of kind {other}")),
        }
    }
    Ok(readers)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn a_file_for_its_owner_lets_nobody_else_read_and_one_for_all_does() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("key");
        let mut options = OpenOptions::new();
        options.write(true).create(true).truncate(true);
        for (content, readers) in [("new", Readers::Owner), ("again", Readers::Owner)] {
            let mut file = open(&options, &path, readers).expect("opened");
            assert!(File::open(&path).is_err(), "shared with nobody while it is written");
            file.write_all(content.as_bytes()).expect("room");
            drop(file);
            assert_eq!(open_to_others(&path).expect("it is there"), None);
            assert_eq!(fs::read_to_string(&path).expect("ours"), content);
        }
        let own = identity::own().expect("a user");
        let list = readers(&path).expect("a list");
        assert!(list == [own], "{list:?}");
        give(&path, "S-1-5-19").expect("ours");
        let [system, administrators] = identity::ADMINISTRATORS;
        assert_eq!(readers(&path).expect("a list"), ["S-1-5-19", administrators, system]);
        assert!(open_to_others(&folder.path().join("none")).is_err());
    }
}
