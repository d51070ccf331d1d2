//! HOURS: when a host may work, as people write it: `Mon-Fri 18:00-08:00, Sat-Sun`.

use std::{fmt, str::FromStr};

const DAYS: [&str; 7] = ["Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun"];
/// Minutes of a day and of a week.
const DAY: u32 = 24 * 60;
const WEEK: u32 = 7 * DAY;

/// Hours of a week, at the time of day where the host stands. Times that pass midnight belong to the day on which they begin.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hours {
    /// As it was written.
    text: String,
    /// First minute of the week and length, in minutes.
    spans: Vec<(u32, u32)>,
}

impl Hours {
    /// Whether a minute of the week, which begins on Monday, is within them.
    pub fn contain(&self, minute: u32) -> bool {
        self.spans.iter().any(|&(first, length)| (minute + WEEK - first) % WEEK < length)
    }
}

impl fmt::Display for Hours {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Hours {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut spans = Vec::new();
        for part in text.split(',').map(str::trim) {
            let fault = || {
                format!(
                    "hours {part:?}: expected days, a time, or both, as in \"Mon-Fri 18:00-08:00, Sat-Sun\""
                )
            };
            let (mut days, mut time) = ((0, 6), (0, DAY));
            let (mut has_days, mut has_time) = (false, false);
            for word in part.split_whitespace() {
                let begins_with_digit = word.starts_with(|c: char| c.is_ascii_digit());
                if begins_with_digit && !has_time {
                    (time, has_time) = (clock_times(word).ok_or_else(fault)?, true);
                } else if !begins_with_digit && !has_days && !has_time {
                    (days, has_days) = (days_of(word).ok_or_else(fault)?, true);
                } else {
                    return Err(fault());
                }
            }
            if !has_days && !has_time {
                return Err(fault());
            }
            let (first, last) = days;
            let n = (last + 7 - first) % 7 + 1;
            spans.extend((0..n).map(|i| ((first + i) % 7 * DAY + time.0, time.1)));
        }
        Ok(Self { text: text.trim().to_owned(), spans })
    }
}

/// First and last day, from 0.
fn days_of(word: &str) -> Option<(u32, u32)> {
    let day = |name: &str| {
        DAYS.iter().position(|day| day.eq_ignore_ascii_case(name)).and_then(|n| u32::try_from(n).ok())
    };
    match word.split_once('-') {
        Some((first, last)) => Some((day(first)?, day(last)?)),
        None => day(word).map(|day| (day, day)),
    }
}

/// First minute of the day and length; an end at or before the beginning is of the next day.
fn clock_times(word: &str) -> Option<(u32, u32)> {
    let minute = |text: &str| {
        let (hour, minute) = text.split_once(':')?;
        let number = |text: &str| text.parse::<u32>().ok().filter(|_| text.len() <= 2);
        let (hour, minute) = (number(hour)?, number(minute)?);
        (minute < 60 && 60 * hour + minute <= DAY).then_some(60 * hour + minute)
    };
    let (from, to) = word.split_once('-')?;
    let (from, to) = (minute(from)?, minute(to)?);
    Some((from, if to > from { to - from } else { to + DAY - from }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hours of the week, in order, within `text`.
    fn of(text: &str) -> Vec<u32> {
        let hours: Hours = text.parse().expect(text);
        (0..7 * 24).filter(|hour| hours.contain(60 * hour)).collect()
    }

    #[test]
    fn days_and_times_are_read_also_past_midnight_and_past_sunday() {
        assert_eq!(of("Sat"), (120..144).collect::<Vec<_>>());
        assert_eq!(of("Sun-mon"), (0..24).chain(144..168).collect::<Vec<_>>());
        assert_eq!(of("Mon 9:00-12:00"), [9, 10, 11]);
        assert_eq!(of("Sun 22:00-02:00"), [0, 1, 166, 167]);
        assert_eq!(of("23:00-24:00"), (0..7).map(|day| 24 * day + 23).collect::<Vec<_>>());
        assert_eq!(of("Mon-Fri 18:00-08:00, Sat-Sun").len(), 5 * 14 + 48 - 8, "Saturday morning once");
        assert_eq!(of("Wed 00:00-00:00").len(), 24);
        let late: Hours = "Mon 18:30-19:00".parse().expect("hours");
        assert_eq!(
            [60 * 18 + 29, 60 * 18 + 30, 60 * 19 - 1, 60 * 19].map(|m| late.contain(m)),
            [false, true, true, false]
        );
    }

    #[test]
    fn what_is_no_hours_is_refused_with_its_words() {
        for text in [
            "",
            "Mon-Fri,",
            "Mo",
            "18:00",
            "18-20",
            "25:00-26:00",
            "9:60-10:00",
            "Mon Tue",
            "9:00-10:00 Mon",
            "Mon 1:00-2:00 3:00-4:00",
        ] {
            let fault = text.parse::<Hours>().expect_err(text);
            assert!(fault.starts_with("hours \""), "{fault}");
        }
    }
}
