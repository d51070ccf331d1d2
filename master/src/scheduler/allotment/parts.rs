//! Parts of a whole by need: everybody has as much as they want, else as much as the others.

/// What a job wants of the speeds of all workers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Want<'a> {
    /// Those of a higher one have their part before the others.
    pub(super) priority: i32,
    /// Jobs of one owner share what others have for one job.
    pub(super) owner: &'a str,
    /// What it is left in any case, and what it can use.
    pub(super) least: f64,
    pub(super) most: f64,
}

/// Halvings of the level: more than a double has digits.
const HALVINGS: usize = 128;

/// The part of each in `total`.
pub(super) fn of(wants: &[Want<'_>], total: f64) -> Vec<f64> {
    let mut parts: Vec<f64> = wants.iter().map(|want| want.least).collect();
    let mut priorities: Vec<i32> = wants.iter().map(|want| want.priority).collect();
    priorities.sort_unstable_by(|a, b| b.cmp(a));
    priorities.dedup();
    for priority in priorities {
        let (these, others): (Vec<usize>, Vec<usize>) =
            (0..wants.len()).partition(|&i| wants[i].priority == priority);
        let left = total - others.iter().map(|&i| parts[i]).sum::<f64>();
        let weights: Vec<f64> = these.iter().map(|&i| 1.0 / of_owner(wants, i)).collect();
        let at = |level: f64| -> Vec<f64> {
            let part = |(&i, weight): (&usize, &f64)| (level * weight).min(wants[i].most).max(wants[i].least);
            these.iter().zip(&weights).map(part).collect()
        };
        // At this level everybody has what they can use.
        let lightest = weights.iter().copied().fold(1.0, f64::min);
        let (mut low, mut high) = (0.0, total / lightest);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if at(middle).iter().sum::<f64>() > left { high = middle } else { low = middle }
        }
        for (i, part) in these.iter().zip(at(low)) {
            parts[*i] = part;
        }
    }
    parts
}

/// How many of its priority have its owner.
fn of_owner(wants: &[Want<'_>], i: usize) -> f64 {
    let same = |other: &&Want<'_>| other.priority == wants[i].priority && other.owner == wants[i].owner;
    wants.iter().filter(same).count() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn want(priority: i32, owner: &str, least: f64, most: f64) -> Want<'_> {
        Want { priority, owner, least, most }
    }

    fn close(found: &[f64], expected: &[f64]) {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}, not {expected:?}");
    }

    #[test]
    fn who_can_use_little_leaves_the_rest_to_the_others() {
        close(&of(&[want(0, "", 1.0, 10.0)], 8.0), &[8.0]);
        close(&of(&[want(0, "", 1.0, 10.0), want(0, "", 1.0, 10.0)], 8.0), &[4.0, 4.0]);
        close(
            &of(&[want(0, "", 1.0, 1.0), want(0, "", 1.0, 10.0), want(0, "", 1.0, 10.0)], 8.0),
            &[1.0, 3.5, 3.5],
        );
        close(&of(&[want(0, "", 1.0, 2.0), want(0, "", 1.0, 3.0)], 8.0), &[2.0, 3.0]);
        close(&of(&[want(0, "", 6.0, 6.0), want(0, "", 1.0, 10.0)], 8.0), &[6.0, 2.0]);
        assert!(of(&[], 8.0).is_empty());
    }

    #[test]
    fn owners_have_equal_parts_and_a_higher_priority_is_served_first() {
        let wants = [want(0, "anna", 1.0, 20.0), want(0, "anna", 1.0, 20.0), want(0, "ben", 1.0, 20.0)];
        close(&of(&wants, 12.0), &[3.0, 3.0, 6.0]);
        let wants = [want(0, "anna", 1.0, 20.0), want(5, "ben", 1.0, 20.0)];
        close(&of(&wants, 12.0), &[1.0, 11.0]);
        let wants = [want(0, "anna", 1.0, 20.0), want(5, "ben", 1.0, 4.0)];
        close(&of(&wants, 12.0), &[8.0, 4.0]);
    }
}
