//! QUALITY: how far the numbers of a run that is over can be trusted, by measures with limits that are written here.
//!
//! A measure is *good*, asks for a *look*, or is *bad*; the verdict of a run is that of its worst measure. The limits are those of good
//! practice with explicit codes: they say where to look, and a run beyond one may still be right for its purpose.

use deck::model::Model;
use mechanics::{mesh::Part, state::GlobalState};
use serde::{Deserialize, Serialize};

use crate::{
    event::Outcome,
    results::summary::{DeadGauge, NamedPart},
    run_totals::RunTotals,
};

/// How a measure, or a whole run, is judged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Grade {
    #[default]
    Good,
    /// Something to look at before the numbers are used.
    Look,
    Bad,
}

impl Grade {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Look => "look",
            Self::Bad => "bad",
        }
    }

    /// Good up to the first limit, bad above the second.
    fn of(value: f64, look: f64, bad: f64) -> Self {
        if value > bad || value.is_nan() {
            Self::Bad
        } else if value > look {
            Self::Look
        } else {
            Self::Good
        }
    }
}

/// One thing that was measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measure {
    /// `energy error`, `hourglass energy of "plate"`.
    pub name: String,
    /// A share, a count or an angle in degrees, as `words` says.
    pub value: f64,
    /// Above it a look is asked for.
    pub limit: f64,
    pub grade: Grade,
    /// The value with its unit and what it is compared with.
    pub words: String,
    /// What to do; empty where it is good.
    pub advice: String,
}

/// The verdict on a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// That of the worst measure.
    pub grade: Grade,
    /// What says something about this run, the worst first.
    pub measures: Vec<Measure>,
}

impl Quality {
    /// Of measures in any order.
    fn of(mut measures: Vec<Measure>) -> Self {
        measures.sort_by_key(|measure| std::cmp::Reverse(measure.grade));
        Self { grade: measures.first().map_or(Grade::Good, |measure| measure.grade), measures }
    }

    /// Those that are not good.
    pub fn doubts(&self) -> impl Iterator<Item = &Measure> {
        self.measures.iter().filter(|measure| measure.grade != Grade::Good)
    }

    /// The verdict in a line: `good, by 5 measures`, `look at 2 of 5 measures`.
    pub fn words(&self) -> String {
        let n = self.measures.len();
        let measures = if n == 1 { "measure" } else { "measures" };
        match (self.grade, self.doubts().count()) {
            (Grade::Good, _) => format!("good, by {n} {measures}"),
            (Grade::Look, doubts) => format!("look at {doubts} of {n} {measures}"),
            (Grade::Bad, doubts) => format!("bad, {doubts} of {n} {measures} are doubtful"),
        }
    }
}

/// Relative energy error of the run.
const ENERGY: [f64; 2] = [0.01, 0.05];
/// The same of one body.
const BODY_ENERGY: [f64; 2] = [0.05, 0.2];
/// Hourglass energy over internal energy, of the run and of a part.
const HOURGLASS: [f64; 2] = [0.05, 0.2];
const PART_HOURGLASS: [f64; 2] = [0.1, 0.5];
/// Share of the energy of the whole run below which that of a part is nothing to tell.
const NEGLIGIBLE: f64 = 0.01;
/// Depth of contact (gaps): from the first on its springs harden, at 0.9 a run ends.
const DEPTH: [f64; 2] = [0.6, 0.85];
/// Share of the energy that left with eroded elements.
const ERODED: [f64; 2] = [0.1, 0.3];
/// Share of internal energy of a part that artificial viscosity put in, and share of the energy of the run below which that tells nothing: in elastic waves it
/// is all that heats.
const VISCOSITY: f64 = 0.5;
const HEATED: f64 = 0.05;
/// Share of the elements of a part that are four-node tetrahedra.
const LOCKS: f64 = 0.1;
/// Angle by which neighbouring shells have turned against each other (degrees), and the share of edges that may have turned further.
const FOLD: f64 = 45.0;
const FOLDED: f64 = 0.01;
/// Strain beyond which a part is taken for one that has yielded, and the fewest elements across one that bends.
const YIELDED: f64 = 0.01;
const ACROSS: u32 = 3;

/// Judges a run.
pub fn judge(model: &Model, parts: &[NamedPart], outcome: &Outcome, dead: &[DeadGauge]) -> Quality {
    let totals = &outcome.run_totals;
    let mut measures = vec![energy(totals)];
    measures.extend(body_energy(model, totals));
    measures.extend(hourglass(totals, parts));
    if totals.worst_penetration > 0.0 {
        measures.push(depth(totals.worst_penetration));
    }
    measures.extend(eroded(totals));
    measures.extend(viscosity(totals, parts));
    measures.extend(gauges(model, dead));
    for (index, part) in model.mesh.parts.iter().enumerate() {
        measures.extend(locks(part));
        if let Some(state) = &outcome.state {
            measures.extend(across(model, index, state));
            measures.extend(folds(model, index, state));
        }
    }
    if !outcome.runaways.is_empty() {
        let n = outcome.runaways.len();
        measures.push(Measure {
            name: "fragments that gained energy".to_owned(),
            value: n as f64,
            grade: Grade::Bad,
            words: format!("{n}, of which nothing pushed any"),
            advice: "see the warnings for their names and what to do".to_owned(),
            ..Measure::default()
        });
    }
    Quality::of(measures)
}

/// A measure that is a share.
fn share(name: String, value: f64, [look, bad]: [f64; 2], of: &str, advice: &str) -> Measure {
    let grade = Grade::of(value, look, bad);
    let advice = if grade == Grade::Good { String::new() } else { advice.to_owned() };
    Measure {
        name,
        value,
        limit: look,
        grade,
        words: format!("{} {of}, good up to {}", percent(value), percent(look)),
        advice,
    }
}

fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    let digits = if percent.abs() < 0.1 {
        3
    } else if percent.abs() < 10.0 {
        1
    } else {
        0
    };
    format!("{percent:.digits$} %")
}

fn energy(totals: &RunTotals) -> Measure {
    share(
        "energy error".to_owned(),
        totals.last.error.abs(),
        ENERGY,
        "of the greatest energy",
        "see which body gained or lost it; a finer mesh or a smaller `safety_factor` of [control] should make it less",
    )
}

fn body_energy(model: &Model, totals: &RunTotals) -> Option<Measure> {
    let bodies = totals.bodies();
    if bodies.len() < 2 {
        return None;
    }
    let worst = bodies.into_iter().max_by(|a, b| a.error.abs().total_cmp(&b.error.abs()))?;
    let names: Vec<&str> = worst.parts.iter().map(|&p| model.mesh.parts[p].name.as_str()).take(3).collect();
    Some(share(
        format!("energy error of {}", names.join(", ")),
        worst.error.abs(),
        BODY_ENERGY,
        "of its own energy",
        "small bodies beside large ones show here first; refine this one, or look whether erosion left it in shreds",
    ))
}

fn hourglass(totals: &RunTotals, parts: &[NamedPart]) -> Vec<Measure> {
    let internal: f64 = parts.iter().map(|part| part.internal.max(0.0)).sum();
    let all = internal + totals.eroded.max(0.0);
    if all <= 0.0 || totals.hourglass <= 0.0 {
        return Vec::new();
    }
    let advice =
        "refine where it bends or is struck: bolide run DECK --refine 2 shows whether the answer stays";
    let mut measures = vec![share(
        "hourglass energy".to_owned(),
        totals.hourglass / all,
        HOURGLASS,
        "of the internal energy",
        advice,
    )];
    for part in parts.iter().filter(|part| part.hourglass > NEGLIGIBLE * totals.scale()) {
        let own = part.internal_of_all();
        let value = if own > 0.0 { part.hourglass / own } else { f64::INFINITY };
        if value > PART_HOURGLASS[0] && value.is_finite() {
            let name = format!("hourglass energy of {}", part.name);
            measures.push(share(name, value, PART_HOURGLASS, "of its internal energy", advice));
        }
    }
    measures
}

fn depth(gaps: f64) -> Measure {
    let [look, bad] = DEPTH;
    let grade = Grade::of(gaps, look, bad);
    let advice = match grade {
        Grade::Good => "",
        _ => {
            "bodies pressed deep into the gap: refine where they meet, or give [contact] a larger `stiffness`"
        }
    };
    Measure {
        name: "worst depth of contact".to_owned(),
        value: gaps,
        limit: look,
        grade,
        words: format!("{gaps:.2} gaps, good up to {look}; a run ends at 0.9"),
        advice: advice.to_owned(),
    }
}

fn eroded(totals: &RunTotals) -> Option<Measure> {
    let (scale, gone) = (totals.scale(), totals.eroded);
    (totals.eroded_elements > 0 && scale > 0.0).then(|| {
        share(
            "eroded energy".to_owned(),
            gone.abs() / scale,
            ERODED,
            "of the energy of the run",
            "what erodes bears nothing any more: see how the answer depends on the erosion strain and on the mesh",
        )
    })
}

fn viscosity(totals: &RunTotals, parts: &[NamedPart]) -> Vec<Measure> {
    let tells = |part: &&NamedPart| {
        part.viscosity > HEATED * totals.scale() && part.viscosity > VISCOSITY * part.internal_of_all()
    };
    let measure = |part: &NamedPart| {
        let value = part.viscosity / part.internal_of_all().max(f64::MIN_POSITIVE);
        share(
            format!("shock viscosity of {}", part.name),
            value.min(1e3),
            [VISCOSITY, f64::INFINITY],
            "of its internal energy",
            "a strong shock that has passed leaves its heat so, at any mesh; else waves are steeper than cells can carry: peaks that stay with a finer mesh tell which",
        )
    };
    parts.iter().filter(tells).map(measure).collect()
}

fn gauges(model: &Model, dead: &[DeadGauge]) -> Option<Measure> {
    let n = model.output.gauges.len() + model.output.element_gauges.len();
    if n == 0 || !model.setup.erosion.is_on() {
        return None;
    }
    let names: Vec<&str> = dead.iter().map(|gauge| gauge.name.as_str()).take(3).collect();
    let grade = if dead.is_empty() { Grade::Good } else { Grade::Look };
    Some(Measure {
        name: "gauges that lost their last element".to_owned(),
        value: dead.len() as f64,
        limit: 0.0,
        grade,
        words: format!("{} of {n}", dead.len()),
        advice: if dead.is_empty() {
            String::new()
        } else {
            format!("end their curves there: {}", names.join(", "))
        },
    })
}

/// Four-node tetrahedra of a part.
fn locks(part: &Part) -> Option<Measure> {
    if part.n_corners() != 8 {
        return None;
    }
    let is_tetrahedron = |e: &usize| {
        let mut corners = part.corners(*e);
        corners.sort_unstable();
        1 + corners.windows(2).filter(|pair| pair[0] != pair[1]).count() == 4
    };
    let n = part.n_elements();
    let count = (0..n).filter(is_tetrahedron).count();
    (count > 0).then(|| {
        share(
            format!("four-node tetrahedra of {}", part.name),
            count as f64 / n.max(1) as f64,
            [LOCKS, f64::INFINITY],
            "of its elements",
            "they are too stiff where they bend or yield: give its mesh tetrahedra = \"composite\"",
        )
    })
}

/// Elements across the thinnest way of a grid that has yielded.
fn across(model: &Model, index: usize, state: &GlobalState) -> Option<Measure> {
    let part = &model.mesh.parts[index];
    let mechanics::mesh::Topology::Structured { cells } = part.topology else { return None };
    let thinnest = cells.into_iter().min()?;
    let first = model.mesh.element_offsets()[index];
    let strains = &state.elements[mechanics::state::field::PLASTIC_STRAIN];
    let yielded = (first..first + part.n_elements()).any(|e| strains[e] > YIELDED);
    (yielded && thinnest < ACROSS).then(|| Measure {
        name: format!("elements across {}", part.name),
        value: f64::from(thinnest),
        limit: f64::from(ACROSS),
        grade: Grade::Look,
        words: format!(
            "{thinnest} across its thinnest way, and it has yielded; {ACROSS} or more bend as they should"
        ),
        advice: "use more elements there, or shells".to_owned(),
    })
}

/// How far neighbouring shells of a part have turned against each other.
fn folds(model: &Model, index: usize, state: &GlobalState) -> Option<Measure> {
    let part = &model.mesh.parts[index];
    part.section()?;
    let first = model.mesh.element_offsets()[index];
    let mut edges: Vec<([u32; 2], usize)> = Vec::with_capacity(4 * part.n_elements());
    for e in (0..part.n_elements()).filter(|e| !state.is_eroded(first + e)) {
        let [a, b, c, d, ..] = part.corners(e);
        let around = [[a, b], [b, c], [c, d], [d, a]].into_iter().filter(|[p, q]| p != q);
        edges.extend(around.map(|[p, q]| ([p.min(q), p.max(q)], e)));
    }
    edges.sort_unstable();
    let normal = |x: &[[f64; 3]], e: usize| {
        let [a, b, c, d, ..] = part.corners(e);
        crate::picture::skin::normal(x, [a, b, c, d])
    };
    let angle = |x: &[[f64; 3]], e: usize, f: usize| {
        let (m, n) = (normal(x, e), normal(x, f));
        let cosine: f64 = (0..3).map(|a| m[a] * n[a]).sum();
        degrees_of(cosine)
    };
    let pairs: Vec<f64> = edges
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|same| match *same {
            [(_, e), (_, f)] => Some((angle(&state.x, e, f) - angle(&model.mesh.positions, e, f)).abs()),
            _ => None,
        })
        .collect();
    let sharp = pairs.iter().filter(|turned| **turned > FOLD).count();
    let most = pairs.iter().copied().fold(0.0, f64::max);
    (!pairs.is_empty() && most > 1.0).then(|| {
        let value = sharp as f64 / pairs.len() as f64;
        share(
            format!("sharp folds of {}", part.name),
            value,
            [FOLDED, f64::INFINITY],
            &format!("of its edges turned by more than {FOLD} degrees, the sharpest by {most:.0}"),
            "the folds are as sharp as its elements are large: refine it until their length stays",
        )
    })
}

/// An angle in degrees by its cosine.
#[expect(clippy::disallowed_methods, reason = "an angle to be told, which no digest holds")]
fn degrees_of(cosine: f64) -> f64 {
    cosine.clamp(-1.0, 1.0).acos().to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_measure_is_graded_by_two_limits_and_a_run_by_its_worst() {
        let of = |value| share("m".to_owned(), value, [0.05, 0.2], "of it", "do");
        assert_eq!([0.0, 0.05, 0.06, 0.2, 0.3, f64::NAN].map(|v| of(v).grade), {
            use Grade::{Bad, Good, Look};
            [Good, Good, Look, Look, Bad, Bad]
        });
        assert!(of(0.01).advice.is_empty() && of(0.1).advice == "do");
        let quality = Quality::of(vec![of(0.0), of(0.1), of(0.01)]);
        assert_eq!((quality.grade, quality.words().as_str()), (Grade::Look, "look at 1 of 3 measures"));
        assert_eq!(quality.measures[0].value, 0.1, "the worst comes first");
        assert_eq!(Quality::of(vec![of(0.0)]).words(), "good, by 1 measure");
        assert_eq!(Quality::of(vec![of(0.5), of(0.1)]).words(), "bad, 2 of 2 measures are doubtful");
    }

    #[test]
    fn shares_are_told_in_percent_with_as_many_digits_as_matter() {
        assert_eq!([0.00012, 0.012, 0.5].map(percent), ["0.012 %", "1.2 %", "50 %"]);
    }

    #[test]
    fn what_has_eroded_of_a_part_counts_with_its_own_internal_energy_and_with_no_other_s() {
        let deck = "title = \"block\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n[[part]]\nname = \"block\"\nmaterial = \"LEAD\"\n\
            box = { origin = [0, 0, 0], size = [1, 1, 1], cells = [1, 1, 1] }\n";
        let model = deck::read(deck, "block.toml").expect("no fault");
        let state = mechanics::initial::state(&model.mesh, &model.setup, &model.velocity, &model.constraint);
        let mut totals = RunTotals::at_start(&model, &state.expect("volumes above 0"));
        (totals.greatest_kinetic, totals.hourglass, totals.eroded) = (100.0, 12.0, 60.0);
        let part = |name: &str, eroded_energy: f64| NamedPart {
            name: name.to_owned(),
            internal: 20.0,
            hourglass: 6.0,
            viscosity: 30.0,
            eroded_elements: 1,
            eroded_energy,
            ..NamedPart::default()
        };
        let parts = [part("worn", 60.0), part("scratched", 0.0)];
        let told = |measures: Vec<Measure>| {
            let of_parts = measures.into_iter().filter(|measure| measure.name.contains(" of "));
            of_parts.map(|measure| (measure.name, measure.value)).collect::<Vec<_>>()
        };
        let only = |name: &str, value: f64| vec![(name.to_owned(), value)];
        assert_eq!(told(hourglass(&totals, &parts)), only("hourglass energy of scratched", 0.3));
        assert_eq!(told(viscosity(&totals, &parts)), only("shock viscosity of scratched", 1.5));
    }

    #[test]
    fn tetrahedra_of_four_nodes_are_told_and_hexahedra_and_wedges_are_not() {
        use mechanics::{element::hourglass::Hourglass, mesh::Topology};
        let part = |hexahedra: Vec<[u32; 8]>| Part {
            name: "p".to_owned(),
            material: 0,
            topology: Topology::Explicit { hexahedra },
            nodes: (0..8).collect(),
            element_ids: Vec::new(),
            hourglass: Hourglass::default(),
        };
        let (whole, wedge) = ([0, 1, 2, 3, 4, 5, 6, 7], [0, 1, 2, 2, 4, 5, 6, 6]);
        assert_eq!(locks(&part(vec![whole, wedge])), None);
        let found = locks(&part(vec![whole, [0, 1, 2, 2, 4, 4, 4, 4]])).expect("one of two");
        assert_eq!((found.value, found.grade), (0.5, Grade::Look));
    }

    #[test]
    fn shells_that_have_turned_against_each_other_are_told_and_flat_ones_are_not() {
        let deck = "title = \"sheet\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n[[part]]\nname = \"sheet\"\nmaterial = \"LEAD\"\n\
            shell = { thickness = 0.01 }\nplate = { origin = [0, 0, 0], side_i = [4, 0, 0], side_j = [0, 1, 0], cells = [4, 1] }\n";
        let model = deck::read(deck, "sheet.toml").expect("no fault");
        let state = mechanics::initial::state(&model.mesh, &model.setup, &model.velocity, &model.constraint);
        let mut state = state.expect("volumes above 0");
        assert_eq!(folds(&model, 0, &state), None);
        // The half beyond the middle stands up.
        state.x.iter_mut().filter(|x| x[0] > 2.0).for_each(|x| *x = [2.0, x[1], x[0] - 2.0]);
        let found = folds(&model, 0, &state).expect("a fold");
        assert_eq!((found.value, found.grade), (1.0 / 3.0, Grade::Look));
        assert!(found.words.contains("the sharpest by 90"), "{}", found.words);
    }
}
