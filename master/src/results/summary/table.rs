//! The summary as a table for a person: results first, then how they were computed.

#![expect(clippy::disallowed_methods, reason = "digits of a table")]

use std::fmt::{self, Write as _};

use super::{Energies, NamedBody, Origin, Summary, WorkUnits};
use crate::{
    incident::{Loss, Rebalance},
    results::Units,
};

/// Parts that the table names of those that eroded, and of all.
const NAMED_PARTS: usize = 4;
const LISTED_PARTS: usize = 8;

impl Summary {
    /// The summary as an aligned table for a terminal: results first, and with `all` the machinery behind them. `units` is the deck's
    /// name of them.
    pub fn table(&self, units: &str, all: bool) -> String {
        let mut table = String::new();
        // Writing into a string cannot fail.
        let _ = self.print(&mut table, Units::named(units), all);
        table
    }

    fn print(&self, out: &mut String, units: Units, all: bool) -> fmt::Result {
        writeln!(out, "{}", self.title.replace(char::is_control, " "))?;
        writeln!(
            out,
            "  run        {} elements, {} cycles to {} {} in {:.2} s on {} with {}",
            grouped(self.elements),
            grouped(self.cycles),
            significant(self.end_time),
            units.time,
            self.wall_s,
            counted(self.workers, "worker"),
            counted(self.threads, "thread"),
        )?;
        self.print_quality(out)?;
        self.print_energies(out, units)?;
        self.print_parts(out, units)?;
        writeln!(
            out,
            "  momentum   {:<10} {:>14}   what supports, walls, gravity and loads gave, or rounding",
            "change",
            percent(self.momentum_error)
        )?;
        self.print_incidents(out)?;
        if all {
            self.print_machinery(out)?;
        }
        for warning in &self.warnings {
            writeln!(out, "  warning    {}", warning.replace(char::is_control, " "))?;
        }
        let Origin { version, date, deck, machine } = &self.origin;
        if !version.is_empty() {
            writeln!(out, "  origin     bolide {version}, {date}, {deck}, on {machine}")?;
        }
        // A run that has no last state has none.
        match self.digest.is_empty() {
            true => Ok(()),
            false => writeln!(out, "  digest     {}", self.digest),
        }
    }

    /// The verdict, and what is not good with what to do about it.
    fn print_quality(&self, out: &mut String) -> fmt::Result {
        if self.quality.measures.is_empty() {
            return Ok(());
        }
        writeln!(out, "  quality    {}", self.quality.words())?;
        for measure in self.quality.doubts() {
            let name = measure.name.replace(char::is_control, " ");
            writeln!(out, "             {:<4} {name}: {}", measure.grade.name(), measure.words)?;
            writeln!(out, "                  {}", measure.advice)?;
        }
        Ok(())
    }

    fn print_energies(&self, out: &mut String, Units { mass, energy, .. }: Units) -> fmt::Result {
        let Energies { kinetic, internal, hourglass, viscosity, contact, friction, external, error, .. } =
            self.energies;
        writeln!(out, "  energy     {:<10} {:>14} {energy}", "kinetic", significant(kinetic))?;
        for (name, value) in [
            ("internal", internal),
            ("viscosity*", viscosity),
            ("hourglass", hourglass),
            ("contact", contact),
            ("friction**", friction),
            ("external", external),
        ] {
            writeln!(out, "             {name:<10} {:>14}", significant(value))?;
        }
        if self.energies.wall_loss != 0.0 {
            let lost = significant(self.energies.wall_loss);
            writeln!(
                out,
                "             {:<10} {lost:>14}   lost by nodes that struck walls, and to friction there",
                "walls"
            )?;
        }
        if self.eroded_elements > 0 {
            let eroded = self.energies.parts.iter().filter(|part| part.eroded_elements > 0);
            let parts: Vec<String> = eroded
                .map(|part| format!("{} of {}", grouped(part.eroded_elements), part.name))
                .take(NAMED_PARTS + 1)
                .collect();
            let parts = match parts.len() {
                0 => String::new(),
                n if n > NAMED_PARTS => format!(" ({}, ...)", parts[..NAMED_PARTS].join(", ")),
                _ => format!(" ({})", parts.join(", ")),
            };
            writeln!(
                out,
                "             {:<10} {:>14}   {} elements{parts}, mass {} {mass}",
                "eroded",
                significant(self.eroded_energy),
                grouped(self.eroded_elements),
                significant(self.eroded_mass)
            )?;
        }
        if let Some(broken) = self.broken_ties {
            writeln!(
                out,
                "             {:<10} {:>14}   have let go of their faces",
                "ties",
                grouped(broken)
            )?;
        }
        writeln!(
            out,
            "             {:<10} {:>14}   *part of internal, **of contact",
            "error",
            percent(error)
        )?;
        if let Some(NamedBody { parts, error, .. }) = &self.energies.worst_body {
            let mut names = parts[..parts.len().min(NAMED_PARTS)].join(", ");
            if parts.len() > NAMED_PARTS {
                names.push_str(", ...");
            }
            writeln!(out, "             {:<10} {:>14}   worst body: {names}", "of a body", percent(*error))?;
        }
        Ok(())
    }

    /// Mass, mean velocity and energies of the first parts.
    fn print_parts(&self, out: &mut String, Units { length, mass, time, energy, .. }: Units) -> fmt::Result {
        let parts = &self.energies.parts;
        let mut label = "parts";
        for part in parts.iter().take(LISTED_PARTS) {
            let name: String =
                part.name.chars().map(|c| if c.is_control() { ' ' } else { c }).take(20).collect();
            let velocity = part.momentum.map(|p| {
                let v = if part.mass > 0.0 { p / part.mass } else { 0.0 };
                // What is left of a sum that cancels is no velocity.
                label_of(v)
            });
            writeln!(
                out,
                "  {label:<10} {name}: {} {mass} at ({}) {length}/{time}, kinetic {} and internal {} {energy}",
                significant(part.mass),
                velocity.join(", "),
                significant(part.kinetic),
                significant(part.internal),
            )?;
            label = "";
        }
        if parts.len() > LISTED_PARTS {
            writeln!(out, "             and {} more in summary.json", parts.len() - LISTED_PARTS)?;
        }
        Ok(())
    }

    /// Work that was dealt out anew, and workers that were lost.
    fn print_incidents(&self, out: &mut String) -> fmt::Result {
        for Rebalance { cycle, imbalance_before, imbalance_after, .. } in &self.rebalances {
            writeln!(
                out,
                "  balance    cycle {}: dealt out anew, imbalance measured {imbalance_before:.3}, foreseen {imbalance_after:.3}",
                grouped(*cycle)
            )?;
        }
        for Loss { worker, cycle, back_to, .. } in &self.losses {
            writeln!(
                out,
                "  lost       {} in cycle {}, went on from cycle {}",
                worker.replace(char::is_control, " "),
                grouped(*cycle),
                grouped(*back_to)
            )?;
        }
        Ok(())
    }

    /// How it was computed.
    fn print_machinery(&self, out: &mut String) -> fmt::Result {
        writeln!(out, "  problem    {} elements, {} nodes", grouped(self.elements), grouped(self.nodes))?;
        writeln!(
            out,
            "  surface    {} elements, {} faces, {} nodes",
            grouped(self.surface_elements),
            grouped(self.surface_faces),
            grouped(self.surface_nodes)
        )?;
        writeln!(
            out,
            "  speed      {:.1} ns of thread time per element and cycle, {:.1} % of it in contact; imbalance {:.3}",
            self.grind_ns,
            100.0 * self.contact_share,
            self.imbalance
        )?;
        writeln!(
            out,
            "  traffic    {} bytes per cycle, {} of them at the master; {} of {} pairs relayed; {} lanes, route {}",
            grouped(self.bytes_per_cycle.round() as u64),
            grouped(self.master_bytes_per_cycle.round() as u64),
            grouped(self.relayed_pairs),
            grouped(self.relayed_pairs + self.linked_pairs),
            self.lanes,
            self.route
        )?;
        let WorkUnits {
            count,
            nodes_min,
            nodes_mean,
            nodes_max,
            faces_min,
            faces_mean,
            faces_max,
            interactions,
        } = self.work_units;
        if count > 0 {
            writeln!(
                out,
                "  contact    {} sorts; {} work units of {nodes_min}-{nodes_max} nodes (mean {nodes_mean:.1}) and \
                 {faces_min}-{faces_max} faces (mean {faces_mean:.1}), {} interactions",
                grouped(self.sorts),
                grouped(count),
                grouped(interactions)
            )?;
            writeln!(
                out,
                "             worst penetration {:.3} gap, worst travel in one cycle {:.3} gap",
                self.worst_penetration, self.worst_gap_travel
            )?;
        }
        writeln!(out, "  time step  at most {:.4} of the Courant limit", self.worst_courant)
    }
}

/// A component of a velocity: four digits, and zero for what is left of a sum that cancels.
fn label_of(v: f64) -> String {
    if v.abs() < 1e-9 {
        "0".to_owned()
    } else {
        format!("{:.3e}", v).parse::<f64>().map_or_else(|_| "-".to_owned(), |v| format!("{v}"))
    }
}

/// `1 worker`, `4 workers`.
fn counted(n: u32, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// A count with a comma every three digits.
fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Six significant digits, with an exponent outside 0.001 to 1,000,000.
pub fn significant(x: f64) -> String {
    let magnitude = x.abs();
    if x == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e6).contains(&magnitude) {
        let decimals = (5.0 - magnitude.log10().floor()).clamp(0.0, 9.0) as usize;
        format!("{x:.decimals$}")
    } else {
        format!("{x:.5e}")
    }
}

/// A relative quantity in percent, with an exponent below 0.001 %.
fn percent(x: f64) -> String {
    let x = 100.0 * x;
    if x == 0.0 || x.abs() >= 1e-3 { format!("{x:.3} %") } else { format!("{x:.2e} %") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_six_digits_at_any_size() {
        for (number, text) in [
            (0.0, "0"),
            (1.0, "1.00000"),
            (-12.345678, "-12.3457"),
            (999_999.4, "999999"),
            (1e6, "1.00000e6"),
            (0.001234567, "0.00123457"),
            (-1.5e-12, "-1.50000e-12"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(significant(number), text);
        }
    }

    #[test]
    fn warnings_have_lines_of_their_own() {
        let warnings = vec!["part \"ball\": one\u{1b}".to_owned(), "two".to_owned()];
        let digest = "0123".to_owned();
        let table = Summary { warnings, digest, ..Summary::default() }.table("SI", true);
        assert!(table.contains("\n  warning    part \"ball\": one \n  warning    two\n  digest"), "{table}");
        let table = Summary::default().table("SI", true);
        assert!(!table.contains("warning") && !table.contains("digest"), "{table}");
    }

    #[test]
    fn counts_are_grouped_by_thousands() {
        for (number, text) in [(0, "0"), (999, "999"), (1000, "1,000"), (1_234_567, "1,234,567")] {
            assert_eq!(grouped(number), text);
        }
    }
}
