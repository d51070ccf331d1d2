//! What a run is put on: hosts, what work costs on them, and how the program itself goes about it.

use mechanics::{cycle::Load, lanes::Width};
use protocol::message::Route;

use super::{
    network::Network,
    timeline::{Kind, Phases},
};
use crate::{balance::Dealing, event::Balance};

/// What work costs on a host of speed 1 (s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Costs {
    /// An element in a cycle.
    pub element: f64,
    /// Integrating a node in a cycle.
    pub node: f64,
    /// A node-face pair on the lists, in a cycle.
    pub pair: f64,
    /// A pair, once when its plan starts to act: finding it, and setting up what the plan needs.
    pub search: f64,
    /// A surface node in a sort.
    pub sort: f64,
}

impl Costs {
    /// Contact, elements and integration of a task (s).
    pub fn of(&self, task: Kind, load: &Load) -> Phases {
        let elements = |n: u64| self.element * n as f64;
        let contact = self.pair * load.pairs as f64;
        let none = Phases::default();
        match task {
            Kind::Load | Kind::Elements => Phases { border: elements(load.border + load.interior), ..none },
            Kind::Install => Phases { contact: contact + self.search * load.pairs as f64, ..none },
            Kind::Border => Phases { contact, border: elements(load.border), ..none },
            Kind::Interior => Phases { interior: elements(load.interior), ..none },
            Kind::Integrate => Phases { integrate: self.node * load.nodes as f64, ..none },
            Kind::Transfer | Kind::Image | Kind::Sort | Kind::Send | Kind::Receive => none,
        }
    }
}

/// The cluster that a run is put on.
#[derive(Clone, Debug, PartialEq)]
pub struct Machines {
    /// Relative speed of each host.
    pub speeds: Vec<f64>,
    /// What the master believes of them: the speeds by which it deals out work.
    pub believed: Vec<f64>,
    /// Costs of work.
    pub costs: Costs,
    /// The network.
    pub network: Network,
    /// Changes of speed, by cycle.
    pub changes: Vec<Change>,
}

/// A host's speed changes when its worker starts a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Host, from 0.
    pub host: usize,
    /// The cycle.
    pub cycle: u64,
    /// Relative speed from then on.
    pub speed: f64,
}

/// How the program itself goes about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scheme {
    /// Route of the partial forces.
    pub route: Route,
    /// How work units are dealt.
    pub dealing: Dealing,
    /// Whether messages leave before the interior elements are computed.
    pub overlap: bool,
    /// What speeds work is dealt out by.
    pub balance: Balance,
    /// Lane width; none for the best of this machine. It changes no figure but measured ones.
    pub lanes: Option<Width>,
}

impl Scheme {
    /// What Bolide does, on a route.
    pub fn bolide(route: Route) -> Self {
        Self { route, dealing: Dealing::Owners, overlap: true, balance: Balance::Given, lanes: None }
    }

    /// The control: a star without overlap, units dealt by weight alone.
    pub fn control() -> Self {
        Self {
            route: Route::Master,
            dealing: Dealing::Weights,
            overlap: false,
            balance: Balance::Given,
            lanes: None,
        }
    }
}
