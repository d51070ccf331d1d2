//! Blocks of cards become a problem: this knows every keyword. What is read and cannot be honoured is a fault at its line;
//! what changes nothing here goes into one warning.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    beam,
    blast::Blasts,
    cards::{Block, Lines},
    condition::Conditions,
    contact::ContactCard,
    damping, define, discrete, erosion, explosive,
    fields::{Context, TENS},
    inertia, joint, material, mesh, moving,
    problem::{Problem, UnitsCard},
    property,
    rigid::RigidCards,
    stress, transmit,
};
use crate::{log::Log, place::Place};

/// Keywords of several sections, each with a heading of its own where the keyword ends in `_TITLE`; and the cards of a
/// section.
const HEADED: [(&str, usize); 11] = [
    ("SECTION_SOLID", 1),
    ("SECTION_BEAM", 2),
    ("SECTION_DISCRETE", 2),
    ("HOURGLASS", 1),
    ("DEFINE_BOX", 1),
    ("DEFINE_VECTOR", 1),
    ("DEFINE_COORDINATE_SYSTEM", 2),
    ("DEFINE_COORDINATE_NODES", 1),
    ("DEFINE_COORDINATE_VECTOR", 1),
    ("CONSTRAINED_NODAL_RIGID_BODY", 1),
    ("CONSTRAINED_NODAL_RIGID_BODY_SPC", 2),
];

/// Reads all blocks.
pub(super) fn read(lines: &mut Lines<'_>, log: &Log<'_>) -> Problem {
    let mut problem = Problem::default();
    let mut blocks = std::mem::take(&mut lines.blocks);
    let context = Context { log, parameters: &lines.parameters, block: 0 };
    // Coordinate systems may name nodes, whatever stands first.
    let (mut later, mut materials) = (Vec::new(), Vec::new());
    blocks.iter().filter(|block| block.keyword.starts_with("DEFINE_VECTOR")).for_each(|block| {
        define::read_vectors(&mut problem, block, &context.of(block));
    });
    for block in &mut blocks {
        if log.is_given_up() {
            break;
        }
        block.trim();
        if block.keyword.starts_with("DEFINE_COORDINATE_NODES") {
            later.push(block);
        } else if is_material(&block.keyword) {
            materials.push(block);
        } else {
            keyword(&mut problem, block, &context);
        }
    }
    read_materials(&mut problem, materials, &context);
    for block in later {
        keyword(&mut problem, block, &context);
    }
    check_eroded(&problem, log);
    problem.check_theory(log);
    problem
}

/// Reports materials that `*MAT_ADD_EROSION` names and no card defines.
fn check_eroded(problem: &Problem, log: &Log<'_>) {
    let is_known = |id: &u32| {
        problem.materials.contains_key(id)
            || problem.springs.contains_key(id)
            || problem.refused_materials.contains(id)
            || problem.unused_materials.contains(id)
    };
    for material in problem.eroded.iter().filter(|material| !is_known(&material.value) && !log.is_given_up())
    {
        log.fault_of(material.origin, "a material of the deck", "add the *MAT, or correct the number");
    }
}

/// Whether a keyword belongs to a mesh alone.
fn is_of_mesh(word: &str) -> bool {
    const WORDS: [&str; 11] = [
        "KEYWORD",
        "KEYWORD_ID",
        "COMMENT",
        "TITLE",
        "NODE",
        "ELEMENT_SOLID",
        "ELEMENT_SHELL",
        "ELEMENT_SHELL_THICKNESS",
        "ELEMENT_BEAM",
        "ELEMENT_DISCRETE",
        "PART",
    ];
    WORDS.contains(&word)
        || ["SET_NODE", "SET_PART", "SET_SEGMENT", "DEFINE_BOX"].iter().any(|stem| word.starts_with(stem))
}

/// Reads the blocks of a mesh alone; a warning names the others.
pub(super) fn read_mesh(lines: &mut Lines<'_>, log: &Log<'_>) -> Problem {
    let mut left_out: BTreeMap<String, Place> = BTreeMap::new();
    lines.blocks.retain(|block| {
        let is = is_of_mesh(&block.keyword);
        if !is {
            left_out.entry(format!("*{}", block.keyword)).or_insert(block.at);
        }
        is
    });
    if let Some(first) = left_out.values().min() {
        let names = left_out.iter().map(|(name, at)| format!("{name} ({})", log.line(*at, *first)));
        log.warn(*first, format!("left out, as only the mesh is taken over: {}", first_of(30, names)));
    }
    read(lines, log)
}

/// The first `most` names in a row, and how many more there are.
fn first_of(most: usize, names: impl ExactSizeIterator<Item = String>) -> String {
    let more = names.len().saturating_sub(most);
    let mut listed: Vec<String> = names.take(most).collect();
    if more > 0 {
        listed.push(format!("{more} more"));
    }
    listed.join(", ")
}

/// Takes the headings of `_TITLE` out of a block.
fn take_headings(block: &mut Block<'_>) {
    let headed = !block.keyword.starts_with("CONTACT") && !block.keyword.starts_with("RIGIDWALL");
    if !headed || !block.take("_TITLE") || block.cards.is_empty() {
        return;
    }
    if block.keyword == "SECTION_SHELL" {
        // A composite has cards of angles behind its two, which are counted as its section is read.
        block.is_headed = true;
        return;
    }
    match HEADED.iter().find(|(word, _)| *word == block.keyword) {
        Some((_, cards)) => {
            let mut n = 0;
            block.cards.retain(|_| {
                n += 1;
                (n - 1) % (cards + 1) != 0
            });
        }
        None => {
            block.cards.remove(0);
        }
    }
}

/// Reads a block, all of it: a card that nobody reads is a fault, unless the keyword has one already.
fn keyword(problem: &mut Problem, block: &mut Block<'_>, context: &Context<'_>) {
    let (context, faults) = (&context.of(block), context.log.count());
    read_keyword(problem, block, context);
    if context.log.count() == faults {
        block.check_all_is_read(context.log);
    }
}

fn read_keyword(problem: &mut Problem, block: &mut Block<'_>, context: &Context<'_>) {
    let whole = block.keyword.clone();
    take_headings(block);
    let log = context.log;
    match block.keyword.as_str() {
        "KEYWORD" | "KEYWORD_ID" | "COMMENT" => block.leave_all(),
        "TITLE" => {
            block.leave_all();
            // That of the deck itself goes before those of its includes.
            let own = block.at.file() == 0;
            if own || problem.title.is_none() {
                problem.title = Some(block.card(0).text.trim().to_string());
            }
        }
        "NODE" => mesh::read_nodes(problem, block, context),
        "ELEMENT_SOLID" => mesh::read_solids(problem, block, context),
        "ELEMENT_SHELL" => mesh::read_shells(problem, block, context, false),
        "ELEMENT_BEAM" => mesh::read_beams(problem, block, context, false),
        "ELEMENT_BEAM_ORIENTATION" => mesh::read_beams(problem, block, context, true),
        "ELEMENT_DISCRETE" => discrete::read_elements(problem, block, context),
        "ELEMENT_SHELL_THICKNESS" => mesh::read_shells(problem, block, context, true),
        "PART" => property::read_parts(problem, block, context, false),
        "PART_CONTACT" => property::read_parts(problem, block, context, true),
        "PART_COMPOSITE" => property::read_composite(problem, block, context),
        "PART_INERTIA" => inertia::read(problem, block, context),
        "SECTION_SOLID" => property::read_solid_sections(problem, block, context),
        "SECTION_SHELL" => property::read_shell_sections(problem, block, context),
        "SECTION_BEAM" => beam::read_sections(problem, block, context),
        "SECTION_DISCRETE" => discrete::read_sections(problem, block, context),
        "HOURGLASS" => property::read_hourglass(problem, block, context),
        "DEFINE_CURVE" => define::read_curve(problem, block, context),
        "DEFINE_VECTOR" => {}
        "DEFINE_BOX" => define::read_box(problem, block, context),
        "DEFINE_COORDINATE_SYSTEM" | "DEFINE_COORDINATE_NODES" | "DEFINE_COORDINATE_VECTOR" => {
            define::read_systems(problem, block, context);
        }
        "DAMPING_GLOBAL" => damping::read(problem, block, context),
        "BOUNDARY_NON_REFLECTING" => transmit::read(problem, block, context),
        "INITIAL_DETONATION" => explosive::read_detonations(problem, block, context),
        // Lines that other programs draw.
        "ELEMENT_PLOTEL" => block.ignore(log),
        "CONTROL_UNITS" => {
            let card = block.card(0);
            let f = context.fields(card, block.width, &TENS);
            let words = [0, 1, 2].map(|i| f.words(i).to_ascii_lowercase());
            problem.units = Some(UnitsCard { at: card.at, words });
        }
        "MAT_ADD_EROSION" | "MAT_000" => {
            let (material, limits) = erosion::read(block, context);
            let id = material.value;
            problem.eroded.push(material);
            problem.erosions.entry(id).or_default().merge(limits);
        }
        word if stress::knows(word) => stress::read(problem, block, context),
        word if stress::is_of_strain(word) => block.ignore(log),
        word if RigidCards::knows(word) => problem.rigid.read(block, &problem.vectors, context),
        word if joint::knows(word) => joint::read(&mut problem.joints, block, context),
        word if word.starts_with("SET_") => problem.sets.read(block, context),
        word if word.starts_with("EOS_") => read_eos(problem, block, context),
        word if word.starts_with("CONTACT_FORCE_TRANSDUCER") => {
            problem.transducers.extend(ContactCard::read_transducer(block, context));
        }
        word if word.starts_with("CONTACT_") => problem.contacts.extend(ContactCard::read(block, context)),
        word if word.starts_with("CONTROL_") => problem.control.read(block, context),
        word if word.starts_with("DATABASE_") => problem.control.read_database(block, context),
        "LOAD_MOVING_PRESSURE" => moving::read(&mut problem.nozzles, block, context),
        word if Blasts::knows(word) => problem.blasts.read(block, context),
        word if Conditions::knows(word) => problem.conditions.read(block, &problem.vectors, context),
        word if word.starts_with("DEFINE_") => define::read_other(problem, block, context),
        _ => {
            log.fault(
                block.at,
                format!("*{}", log.quote(&whole)),
                "a keyword of the table in deck/README.md",
                "take it out, or say it otherwise; leaving it out would change what is computed",
            );
        }
    }
}

fn is_material(word: &str) -> bool {
    word.starts_with("MAT_") && !word.starts_with("MAT_ADD_EROSION") && !word.starts_with("MAT_000")
}

/// Reads the `*MAT_` keywords of materials that parts have, once all parts are known. Of others nothing depends on what they say.
fn read_materials(problem: &mut Problem, blocks: Vec<&mut Block<'_>>, context: &Context<'_>) {
    let of_parts: BTreeSet<u32> = problem.parts.values().map(|part| part.material.value).collect();
    let mut unused = Vec::new();
    for block in blocks {
        if context.log.is_given_up() {
            return;
        }
        take_headings(block);
        let context = &context.of(block);
        let head = block.card(0);
        let id = context.fields(head, block.width, &TENS).id(0);
        if of_parts.contains(&id) || of_parts.is_empty() {
            let faults = context.log.count();
            read_material(problem, block, context, id);
            if context.log.count() == faults {
                block.check_all_is_read(context.log);
            }
        } else {
            check_unused(block, context);
            problem.unused_materials.insert(id);
            unused.push((block.at, format!("*{} {id}", context.log.quote(&block.keyword))));
        }
    }
    if let Some((first, _)) = unused.first() {
        let names = unused.iter().map(|(_, name)| name.clone());
        context.log.warn(*first, format!("materials that no part has are left out: {}", first_of(10, names)));
    }
}

/// Reports further cards of a material that no part has: a part may have the one that they would be. What its own cards say is of no interest.
fn check_unused(block: &Block<'_>, context: &Context<'_>) {
    let quiet = context.log.quiet();
    let unheard = Context { log: &quiet, parameters: context.parameters, block: context.block };
    if discrete::knows_material(&block.keyword) {
        discrete::read_material(block, &unheard);
    } else {
        material::read(block, &unheard);
    }
    if quiet.count() == 0 {
        block.check_all_is_read(context.log);
    }
}

/// Reads a `*MAT_` keyword.
fn read_material(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>, id: u32) {
    let head = block.card(0);
    let f = context.fields(head, block.width, &TENS);
    let taken = problem.materials.get(&id).map(|first| first.at);
    let taken = taken.or(problem.springs.get(&id).map(|first| first.at));
    if discrete::knows_material(&block.keyword) {
        match discrete::read_material(block, context) {
            Some(card) => drop(problem.springs.insert(id, card)),
            None => drop(problem.refused_materials.insert(id)),
        }
    } else {
        match material::read(block, context) {
            Some(card) => drop(problem.materials.insert(id, card)),
            None => drop(problem.refused_materials.insert(id)),
        }
    }
    if let Some(first) = taken {
        let line = context.log.line(first, head.at);
        f.fault(0, format!("a number other than {id}, which {line} has"), "renumber one");
    }
}

/// Reads an `*EOS_` keyword.
fn read_eos(problem: &mut Problem, block: &Block<'_>, context: &Context<'_>) {
    let id = problem.number("*EOS", &context.fields(block.card(0), block.width, &TENS), context);
    match material::read_eos(block, context) {
        Some(eos) => {
            problem.equations.insert(id, eos);
        }
        None => {
            problem.refused_equations.insert(id);
        }
    }
}
