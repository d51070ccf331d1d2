//! TAR: archives of plain files, as POSIX has them (ustar, IEEE Std 1003.1, section pax): a header of 512 bytes, the file, zeros up to
//! the next 512 bytes; at the end twice 512 zeros.

use std::io;

const BLOCK: usize = 512;
/// Most bytes of a name, and of a file: eleven octal digits.
const NAME: usize = 100;
const MOST: u64 = 1 << 33;

/// What stands before a file.
///
/// # Errors
/// If its name or the file is too long for such an archive.
pub fn header(name: &str, bytes: u64) -> io::Result<Vec<u8>> {
    if name.len() > NAME || bytes >= MOST {
        let why = format!(
            "{name}: {bytes} bytes, and a name of {} bytes; an archive takes less than {MOST} and at most {NAME}",
            name.len()
        );
        return Err(io::Error::new(io::ErrorKind::InvalidInput, why));
    }
    let mut block = vec![0; BLOCK];
    let mut put = |at: usize, text: &str| block[at..at + text.len()].copy_from_slice(text.as_bytes());
    put(0, name);
    put(100, "0000644\0");
    put(108, "0000000\0");
    put(116, "0000000\0");
    put(124, &format!("{bytes:011o}\0"));
    put(136, "00000000000\0");
    // The sum is taken with blanks in its own place.
    put(148, "        ");
    put(156, "0");
    put(257, "ustar\0");
    put(263, "00");
    let sum: u32 = block.iter().map(|&byte| u32::from(byte)).sum();
    block[148..156].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
    Ok(block)
}

/// What stands behind a file of so many bytes.
pub fn padding(bytes: u64) -> Vec<u8> {
    let over = (bytes % BLOCK as u64) as usize;
    vec![0; if over > 0 { BLOCK - over } else { 0 }]
}

/// The end of an archive.
pub fn end() -> Vec<u8> {
    vec![0; 2 * BLOCK]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tar_lists_and_unpacks_what_was_packed() {
        let folder = tempfile::tempdir().expect("room");
        let mut archive = Vec::new();
        let files =
            [("job-1/a.csv", vec![b'x'; 700]), ("job-1/b.csv", Vec::new()), ("job-1/c", vec![7; 512])];
        for (name, text) in &files {
            archive.extend(header(name, text.len() as u64).expect("short"));
            archive.extend(text);
            archive.extend(padding(text.len() as u64));
        }
        archive.extend(end());
        assert_eq!(archive.len() % BLOCK, 0);
        let path = folder.path().join("all.tar");
        std::fs::write(&path, archive).expect("room");
        let status =
            std::process::Command::new("tar").arg("-xf").arg(&path).arg("-C").arg(folder.path()).status();
        // A machine without tar has nothing to compare with.
        let Ok(status) = status else { return println!("skipped: no tar on this machine") };
        assert!(status.success());
        for (name, text) in files {
            assert_eq!(std::fs::read(folder.path().join(name)).expect("unpacked"), text, "{name}");
        }
        header(&"n".repeat(101), 1).expect_err("a long name");
        header("n", MOST).expect_err("a large file");
    }
}
