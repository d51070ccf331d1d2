//! Whether the people whose machine this is need it: what Windows shows of other programs, keyboard and mouse, and battery. It tells
//! neither logins nor temperatures without a service.

use std::time::Instant;

use windows_sys::Win32::{
    Foundation::FILETIME,
    System::{
        Power::{GetSystemPowerStatus, SYSTEM_POWER_STATUS},
        Threading::{GetCurrentProcess, GetProcessTimes, GetSystemTimes},
    },
    UI::Input::KeyboardAndMouse::{GetLastInputInfo, LASTINPUTINFO},
};

use crate::Signs;

/// Looks again and again; each look tells what happened since the one before.
pub struct Watch {
    at: Instant,
    /// What others have used of processors (s).
    used: f64,
    /// When somebody typed or moved the mouse last (ms of the system's clock).
    typed: Option<u32>,
}

impl Watch {
    /// From now on.
    #[expect(clippy::new_without_default, reason = "it looks at the machine")]
    pub fn new() -> Self {
        Self { at: Instant::now(), used: used_by_others().unwrap_or(0.0), typed: typed() }
    }

    /// What shows since the last look.
    pub fn look(&mut self) -> Signs {
        let seconds = self.at.elapsed().as_secs_f64();
        let before = std::mem::replace(self, Self::new());
        Signs {
            others: (self.used - before.used).max(0.0) / seconds.max(0.01),
            typed: self.typed != before.typed,
            logged_in: false,
            on_battery: is_on_battery(),
            hot: None,
        }
    }
}

fn seconds(time: FILETIME) -> f64 {
    1e-7 * (u64::from(time.dwHighDateTime) << 32 | u64::from(time.dwLowDateTime)) as f64
}

/// What other programs have used of all processors so far (s).
fn used_by_others() -> Option<f64> {
    let [mut idle, mut kernel, mut user, mut created, mut ended, mut own_kernel, mut own_user] =
        [FILETIME::default(); 7];
    // SAFETY: the three times are ours.
    let of_all = unsafe { GetSystemTimes(&raw mut idle, &raw mut kernel, &raw mut user) };
    // SAFETY: the handle of this process is always good, and the four times are ours.
    let own = unsafe {
        GetProcessTimes(
            GetCurrentProcess(),
            &raw mut created,
            &raw mut ended,
            &raw mut own_kernel,
            &raw mut own_user,
        )
    };
    // Time in the system counts idle time as well.
    let all = seconds(kernel) + seconds(user) - seconds(idle);
    (of_all != 0 && own != 0).then(|| all - seconds(own_kernel) - seconds(own_user))
}

/// When somebody of this session typed or moved the mouse last; none for a service, whose session has neither.
fn typed() -> Option<u32> {
    let mut last = LASTINPUTINFO { cbSize: size_of::<LASTINPUTINFO>() as u32, dwTime: 0 };
    // SAFETY: the structure says how long it is.
    let done = unsafe { GetLastInputInfo(&raw mut last) };
    (done != 0).then_some(last.dwTime)
}

fn is_on_battery() -> bool {
    let mut status = SYSTEM_POWER_STATUS::default();
    // SAFETY: the structure is ours.
    let done = unsafe { GetSystemPowerStatus(&raw mut status) };
    // 0 is offline, 255 unknown.
    done != 0 && status.ACLineStatus == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_look_has_numbers() {
        let mut watch = Watch::new();
        std::thread::sleep(std::time::Duration::from_millis(50));
        let others = watch.look().others;
        assert!((0.0..1e4).contains(&others), "{others}");
    }
}
