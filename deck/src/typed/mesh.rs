//! The mesh of a part: a block, nodes and elements of its own, or a body of a mesh.

use std::collections::BTreeMap;

use crate::{
    blocks::{Block, Shape},
    mesh_file::MeshFile,
    place::{Origin, Place, Placed},
};

/// Meshes by the name that the deck has for them; none where a file could not be read, which was reported.
pub(crate) type Meshes = BTreeMap<String, Option<Mesh>>;

/// A mesh with the places of its elements.
#[derive(Clone, Debug)]
pub(crate) struct Mesh {
    pub(crate) file: MeshFile,
    /// Of each element of each body; empty where they are not known.
    pub(crate) elements: Vec<Vec<Place>>,
}

#[derive(Clone, Debug)]
pub(crate) struct PartMesh {
    pub(crate) at: Place,
    /// What it is called in messages.
    pub(crate) title: String,
    pub(crate) source: Source,
}

/// Where nodes and elements come from.
#[derive(Clone, Debug)]
pub(crate) enum Source {
    Shape(Shape),
    Explicit(Box<Explicit>),
    /// A body of a mesh, by its name or number; without one that of the part's name, or the only one.
    Body {
        mesh: Placed<String>,
        body: Option<Placed<String>>,
        /// Factor on the positions of its nodes; 1 where there is none.
        scale: Option<Placed<f64>>,
        /// Where it asks for nodes on the edges of tetrahedra of four, for all parts of the file.
        composite: Option<Origin>,
    },
}

/// Nodes and elements of a part's own. Numbers of each are different.
#[derive(Clone, Debug)]
pub(crate) struct Explicit {
    pub(crate) block: Block,
    pub(crate) numbers: Numbers,
}

/// The user's numbers of nodes and elements, and where they stand.
#[derive(Clone, Debug, Default)]
pub(crate) struct Numbers {
    pub(crate) nodes: Vec<u32>,
    pub(crate) elements: Vec<u32>,
    pub(crate) node_places: Places,
    pub(crate) element_places: Places,
    /// The mesh they come from, whose parts share nodes.
    pub(crate) mesh: Option<String>,
}

/// Places of a list.
#[derive(Clone, Debug)]
pub(crate) enum Places {
    All(Place),
    Each(Vec<Place>),
}

impl Default for Places {
    fn default() -> Self {
        Self::Each(Vec::new())
    }
}

impl Places {
    /// The place of an entry.
    pub(crate) fn of(&self, index: usize) -> Place {
        match self {
            Self::All(place) => *place,
            Self::Each(list) => list[index],
        }
    }
}
