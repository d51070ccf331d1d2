//! What the keywords of a deck say, before it is put into our words: by the numbers that the deck gives.
//!
//! One function reads one keyword; [`Problem::read`] knows them all. What is read and cannot be honoured is a
//! fault at its line; what changes nothing here goes into one warning.

use std::collections::{BTreeMap, HashMap};

use super::{
    cards::{Block, Lines},
    condition::Conditions,
    contact::ContactCard,
    control::ControlCards,
    erosion::Limits,
    fields::{Context, EIGHTS, TENS},
    log::{Log, Place},
    material::{EosCard, MaterialCard},
    rigid::RigidCards,
    set::Sets,
};

/// A node.
pub(super) struct Node {
    pub(super) id: u32,
    pub(super) x: [f64; 3],
    /// Translations that are held: 1 x, 2 y, 3 z, 4 xy, 5 yz, 6 zx, 7 all; and rotations.
    pub(super) held: [u8; 2],
    pub(super) at: Place,
}

/// A solid element.
pub(super) struct Solid {
    pub(super) id: u32,
    pub(super) part: u32,
    pub(super) nodes: [u32; 8],
    pub(super) at: Place,
}

/// A shell element.
pub(super) struct Shell {
    pub(super) id: u32,
    pub(super) part: u32,
    pub(super) nodes: [u32; 4],
    /// Of its own, the mean of its corners.
    pub(super) thickness: Option<f64>,
    pub(super) at: Place,
}

/// `*PART`.
pub(super) struct PartCard {
    pub(super) at: Place,
    pub(super) title: String,
    pub(super) section: u32,
    pub(super) material: u32,
    pub(super) eos: u32,
    pub(super) hourglass: u32,
}

/// `*SECTION_`.
#[derive(Clone, Copy)]
pub(super) enum Section {
    Solid,
    Shell(ShellSection),
}

/// `*SECTION_SHELL`.
#[derive(Clone, Copy)]
pub(super) struct ShellSection {
    /// Mean of its corners; 0 where elements give theirs.
    pub(super) thickness: f64,
    /// Points through it.
    pub(super) points: u32,
    /// Whether they are Lobatto's, else Gauss's.
    pub(super) lobatto: bool,
}

/// `*HOURGLASS`.
#[derive(Clone, Copy)]
pub(super) struct Hourglass {
    pub(super) at: Place,
    pub(super) kind: i64,
    pub(super) coefficient: f64,
}

/// `*DEFINE_CURVE`, scaled and offset.
pub(super) struct CurveCard {
    pub(super) points: Vec<[f64; 2]>,
}

/// A deck by its numbers.
#[derive(Default)]
pub(super) struct Problem {
    pub(super) title: Option<String>,
    pub(super) nodes: Vec<Node>,
    /// Index of each node by its number.
    pub(super) node_index: HashMap<u32, u32>,
    pub(super) solids: Vec<Solid>,
    pub(super) shells: Vec<Shell>,
    pub(super) parts: BTreeMap<u32, PartCard>,
    pub(super) sections: BTreeMap<u32, (Place, Section)>,
    pub(super) materials: BTreeMap<u32, MaterialCard>,
    pub(super) equations: BTreeMap<u32, EosCard>,
    /// What `*MAT_ADD_EROSION` says of each material.
    pub(super) erosions: BTreeMap<u32, Limits>,
    pub(super) hourglasses: BTreeMap<u32, Hourglass>,
    pub(super) sets: Sets,
    pub(super) curves: BTreeMap<u32, CurveCard>,
    /// Corners of each box.
    pub(super) boxes: BTreeMap<u32, [[f64; 3]; 2]>,
    /// Directions of x, y, z of each coordinate system.
    pub(super) systems: BTreeMap<u32, [[f64; 3]; 3]>,
    pub(super) conditions: Conditions,
    pub(super) rigid: RigidCards,
    pub(super) contacts: Vec<ContactCard>,
    /// Contacts whose forces the history is to hold.
    pub(super) transducers: Vec<ContactCard>,
    pub(super) control: ControlCards,
}

impl Problem {
    /// Reads all blocks.
    pub(super) fn read(lines: &mut Lines<'_>, log: &Log) -> Self {
        let mut problem = Self::default();
        let mut blocks = std::mem::take(&mut lines.blocks);
        let context = Context { log, parameters: &lines.parameters };
        // Coordinate systems may name nodes, whatever stands first.
        let mut later = Vec::new();
        for block in &mut blocks {
            while block.cards.last().is_some_and(|card| card.text.trim().is_empty()) {
                block.cards.pop();
            }
            if block.keyword.starts_with("DEFINE_COORDINATE_NODES") {
                later.push(block);
            } else {
                problem.keyword(block, &context);
            }
        }
        for block in later {
            problem.keyword(block, &context);
        }
        problem
    }

    /// Reads one keyword.
    fn keyword(&mut self, block: &mut Block<'_>, context: &Context<'_>) {
        let whole = block.keyword.clone();
        let headed = !whole.starts_with("CONTACT") && !whole.starts_with("RIGIDWALL");
        if headed && block.take("_TITLE") && !block.cards.is_empty() {
            block.cards.remove(0);
        }
        let log = context.log;
        match block.keyword.as_str() {
            "KEYWORD" | "COMMENT" => {}
            "TITLE" => self.title = Some(block.card(0).text.trim().to_string()),
            "NODE" => self.read_nodes(block, context),
            "ELEMENT_SOLID" => self.read_solids(block, context),
            "ELEMENT_SHELL" => self.read_shells(block, context, false),
            "ELEMENT_SHELL_THICKNESS" => self.read_shells(block, context, true),
            "PART" => self.read_parts(block, context, false),
            "PART_CONTACT" => self.read_parts(block, context, true),
            "SECTION_SOLID" => self.read_solid_sections(block, context),
            "SECTION_SHELL" => self.read_shell_sections(block, context),
            "HOURGLASS" => self.read_hourglass(block, context),
            "DEFINE_CURVE" => self.read_curve(block, context),
            "DEFINE_BOX" => {
                for card in &block.cards {
                    let f = context.fields(card, block.width, &TENS);
                    let bounds = [0, 1].map(|end| [1, 3, 5].map(|i| f.real(i + end, 0.0)));
                    self.boxes.insert(f.id(0), bounds);
                }
            }
            "DEFINE_COORDINATE_SYSTEM" | "DEFINE_COORDINATE_NODES" | "DEFINE_COORDINATE_VECTOR" => {
                self.read_system(block, context);
            }
            word if RigidCards::knows(word) => self.rigid.read(block, context),
            word if word.starts_with("SET_") => self.sets.read(block, context),
            word if word.starts_with("MAT_") => self.read_material(block, context),
            word if word.starts_with("EOS_") => self.read_eos(block, context),
            word if word.starts_with("CONTACT_FORCE_TRANSDUCER") => {
                self.transducers.extend(ContactCard::read_transducer(block, context));
            }
            word if word.starts_with("CONTACT_") => {
                if let Some(card) = ContactCard::read(block, context) {
                    self.contacts.push(card);
                }
            }
            word if word.starts_with("CONTROL_") => self.control.read(block, context),
            word if word.starts_with("DATABASE_") => self.control.read_database(block, context),
            word if Conditions::knows(word) => self.conditions.read(block, context),
            word if word.starts_with("DEFINE_") => log.ignore(block.at, word),
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

    /// `*NODE`.
    fn read_nodes(&mut self, block: &Block<'_>, context: &Context<'_>) {
        self.nodes.reserve(block.cards.len());
        for card in &block.cards {
            let f = context.fields(card, block.width, &[8, 16, 16, 16, 8, 8]);
            if f.all_blank() {
                continue;
            }
            let id = f.id(0);
            if id == 0 {
                f.fault(0, "a node number above 0", "give the node a number");
                continue;
            }
            let held = [4, 5].map(|i| match f.integer(i) {
                code @ 0..=7 => code as u8,
                _ => {
                    f.fault(i, "a code from 0 to 7 of what is held", "correct it, or use *BOUNDARY_SPC_NODE");
                    0
                }
            });
            let next = self.nodes.len() as u32;
            if let Some(first) = self.node_index.insert(id, next) {
                let node = &self.nodes[first as usize];
                let line = node.at.line;
                if node.x != f.vector(1) {
                    let expected =
                        format!("a number other than {id}, which line {line} has with another place");
                    f.fault(0, expected, "renumber one");
                }
                self.node_index.insert(id, first);
                continue;
            }
            self.nodes.push(Node { id, x: f.vector(1), held, at: card.at });
        }
    }

    /// `*ELEMENT_SOLID`, on one line or on two.
    fn read_solids(&mut self, block: &Block<'_>, context: &Context<'_>) {
        let mut cards = block.cards.iter().filter(|card| !card.text.trim().is_empty());
        self.solids.reserve(block.cards.len());
        while let Some(card) = cards.next() {
            let f = context.fields(card, block.width, &EIGHTS);
            let (id, part) = (f.id(0), f.id(1));
            let (nodes, first) = if f.used() <= 2 {
                let Some(second) = cards.next() else {
                    f.fault(0, "a second card with eight nodes", "complete the element");
                    return;
                };
                (context.fields(second, block.width, &EIGHTS), 0)
            } else {
                (f, 2)
            };
            if first == 0 && (nodes.integer(8) != 0 || nodes.integer(9) != 0) {
                nodes.fault(
                    8,
                    "at most eight nodes",
                    "mesh with hexahedra; ten-node tetrahedra are not computed",
                );
                continue;
            }
            let mut corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| nodes.id(first + i));
            // Tetrahedra and wedges may leave the last fields blank.
            for i in 1..8 {
                if corners[i] == 0 {
                    corners[i] = corners[i - 1];
                }
            }
            self.solids.push(Solid { id, part, nodes: corners, at: card.at });
        }
    }

    /// `*ELEMENT_SHELL`, with a card of thicknesses where the keyword says so.
    fn read_shells(&mut self, block: &Block<'_>, context: &Context<'_>, thick: bool) {
        let mut cards = block.cards.iter().filter(|card| !card.text.trim().is_empty());
        while let Some(card) = cards.next() {
            let f = context.fields(card, block.width, &EIGHTS);
            let mut nodes = [2, 3, 4, 5].map(|i| f.id(i));
            if nodes[3] == 0 {
                nodes[3] = nodes[2];
            }
            if (6..10).any(|i| f.integer(i) != 0) {
                f.fault(6, "at most four nodes", "mesh with four-node shells");
                continue;
            }
            let mut thickness = None;
            if thick {
                let Some(second) = cards.next() else {
                    f.fault(0, "a second card with the thicknesses", "complete the element");
                    return;
                };
                let g = context.fields(second, block.width, &[16; 5]);
                let corners = if nodes[3] == nodes[2] { 3 } else { 4 };
                let mean = (0..corners).map(|i| g.real(i, 0.0)).sum::<f64>() / corners as f64;
                thickness = Some(mean).filter(|mean| *mean > 0.0);
            }
            self.shells.push(Shell { id: f.id(0), part: f.id(1), nodes, thickness, at: card.at });
        }
    }

    /// `*PART`: a heading and a card each.
    fn read_parts(&mut self, block: &Block<'_>, context: &Context<'_>, contact: bool) {
        let step = if contact { 3 } else { 2 };
        for cards in block.cards.chunks(step) {
            let Some(card) = cards.get(1) else {
                let (at, log) = (cards[0].at, context.log);
                log.fault(
                    at,
                    log.quote(&cards[0].text),
                    "a card with the part's numbers",
                    "complete the part",
                );
                return;
            };
            let f = context.fields(card, block.width, &TENS);
            let part = PartCard {
                at: card.at,
                title: cards[0].text.trim().to_string(),
                section: f.id(1),
                material: f.id(2),
                eos: f.id(3),
                hourglass: f.id(4),
            };
            if f.integer(6) != 0 {
                f.fault(6, "no adaptive mesh", "leave ADPOPT blank");
            }
            if f.integer(5) != 0 {
                f.fault(5, "no part of its own for gravity", "leave GRAV blank");
            }
            if contact {
                context.log.warn(
                    card.at,
                    "*PART_CONTACT: its third card is not used; contact takes its friction from *CONTACT",
                );
            }
            let id = f.id(0);
            if let Some(first) = self.parts.insert(id, part) {
                f.fault(
                    0,
                    format!("a part number other than {id}, which line {} has", first.at.line),
                    "renumber one",
                );
            }
        }
    }

    fn read_solid_sections(&mut self, block: &Block<'_>, context: &Context<'_>) {
        for card in block.cards.iter().filter(|card| !card.text.trim().is_empty()) {
            let f = context.fields(card, block.width, &TENS);
            match f.integer(1) {
                0 | 1 => {}
                form @ (-2 | -1 | 2 | 3 | 10 | 13 | 15) => context.log.warn(
                    card.at,
                    format!(
                        "ELFORM {form}: solids are computed with one point and hourglass control, as ELFORM 1"
                    ),
                ),
                _ => f.fault(1, "ELFORM 1", "take the Lagrangian solid of one point"),
            }
            self.sections.insert(f.id(0), (card.at, Section::Solid));
        }
    }

    fn read_shell_sections(&mut self, block: &Block<'_>, context: &Context<'_>) {
        let mut cards = block.cards.iter();
        while let Some(card) = cards.next() {
            let f = context.fields(card, block.width, &TENS);
            match f.integer(1) {
                0 | 2 => {}
                form @ (-16 | 1 | 3 | 4 | 6..=8 | 10 | 11 | 16..=18 | 20 | 21 | 25..=27) => context.log.warn(
                    card.at,
                    format!(
                        "ELFORM {form}: shells are computed with one point and hourglass control, as ELFORM 2 with \
                         warping"
                    ),
                ),
                _ => f.fault(1, "ELFORM 2", "take the shell of Belytschko, Lin and Tsay"),
            }
            let (points, rule) = (f.integer(3), f.real(5, 0.0));
            if rule < 0.0 {
                f.fault(5, "QR 0, 1 or 2", "take a rule of points that is built in");
            }
            let lobatto = rule == 1.0;
            if rule > 1.0 {
                context.log.warn(card.at, "QR: points through the thickness are those of Gauss");
            }
            let asked = if points == 0 { 2 } else { points };
            let points = asked.clamp(if lobatto { 3 } else { 1 }, 5);
            if points != asked {
                context.log.warn(card.at, format!("NIP {asked}: {points} points through the thickness"));
            }
            if f.integer(6) != 0 {
                f.fault(6, "one material through the thickness", "leave ICOMP blank");
            }
            let second = cards.next();
            let thickness = second.map_or(0.0, |second| {
                let g = context.fields(second, block.width, &TENS);
                if g.real(4, 0.0) != 0.0 {
                    g.fault(4, "nodes in the middle of the thickness", "leave NLOC blank");
                }
                let corners = [0, 1, 2, 3].map(|i| g.real(i, 0.0));
                let all = corners[1..].iter().all(|t| *t > 0.0);
                if all { corners.iter().sum::<f64>() / 4.0 } else { corners[0] }
            });
            let section = ShellSection { thickness, points: points as u32, lobatto };
            self.sections.insert(f.id(0), (card.at, Section::Shell(section)));
        }
    }

    fn read_hourglass(&mut self, block: &Block<'_>, context: &Context<'_>) {
        for card in block.cards.iter().filter(|card| !card.text.trim().is_empty()) {
            let f = context.fields(card, block.width, &TENS);
            let read = Hourglass { at: card.at, kind: f.integer(1), coefficient: f.real(2, 0.0) };
            self.hourglasses.insert(f.id(0), read);
        }
    }

    fn read_curve(&mut self, block: &Block<'_>, context: &Context<'_>) {
        let head = block.card(0);
        let f = context.fields(&head, block.width, &TENS);
        if f.integer(1) == 1 {
            f.fault(1, "SIDR 0 or 2", "give a curve that acts in the run itself");
        }
        let or_one = |x: f64| if x == 0.0 { 1.0 } else { x };
        let (sa, so) = (or_one(f.real(2, 0.0)), or_one(f.real(3, 0.0)));
        let (oa, oo) = (f.real(4, 0.0), f.real(5, 0.0));
        let mut points: Vec<[f64; 2]> = Vec::new();
        for card in block.cards.iter().skip(1).filter(|card| !card.text.trim().is_empty()) {
            let p = context.fields(card, block.width, &[20, 20]);
            let point = [sa * (p.real(0, 0.0) + oa), so * (p.real(1, 0.0) + oo)];
            if points.last().is_some_and(|last| last[0] >= point[0]) {
                p.fault(0, "an abscissa above that of the point before", "put the points in order");
                continue;
            }
            points.push(point);
        }
        if points.is_empty() {
            f.fault(0, "a curve with points", "give it at least one");
        }
        self.curves.insert(f.id(0), CurveCard { points });
    }

    /// The three directions of a system: x from the origin, the xy plane through a third point.
    fn read_system(&mut self, block: &Block<'_>, context: &Context<'_>) {
        let head = block.card(0);
        let f = context.fields(&head, block.width, &TENS);
        let (x, plane) = match block.keyword.as_str() {
            "DEFINE_COORDINATE_SYSTEM" => {
                let second = block.card(1);
                let g = context.fields(&second, block.width, &TENS);
                if f.integer(7) != 0 {
                    f.fault(7, "no system inside a system", "give points in global coordinates");
                }
                let origin = f.vector(1);
                (minus(f.vector(4), origin), minus(g.vector(0), origin))
            }
            "DEFINE_COORDINATE_VECTOR" => (f.vector(1), f.vector(4)),
            _ => {
                let nodes = [1, 2, 3].map(|i| {
                    let node = self.node_index.get(&f.id(i)).map(|n| self.nodes[*n as usize].x);
                    if node.is_none() {
                        f.fault(i, "a node of the deck", "name one");
                    }
                    node.unwrap_or_default()
                });
                if f.integer(4) != 0 {
                    f.fault(4, "a system that stands", "leave FLAG at 0");
                }
                (minus(nodes[1], nodes[0]), minus(nodes[2], nodes[0]))
            }
        };
        let z = cross(x, plane);
        let directions = [x, cross(z, x), z].map(unit);
        match directions {
            [Some(x), Some(y), Some(z)] => {
                self.systems.insert(f.id(0), [x, y, z]);
            }
            _ => f.fault(0, "three points that are not on a line", "move one"),
        }
    }

    /// The place of a node.
    pub(super) fn position(&self, id: u32) -> Option<[f64; 3]> {
        self.node_index.get(&id).map(|n| self.nodes[*n as usize].x)
    }
}

pub(super) use crate::geometry::{cross, sub as minus};

/// The direction of a vector; none where it has no length.
pub(super) fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let long = crate::geometry::norm(v);
    (long > 0.0 && long.is_finite()).then(|| v.map(|c| c / long))
}
