//! What a run is put on: hosts, what work costs on them, and how the program itself goes about it.

use mechanics::{cycle::Load, lanes::Width};
use protocol::options::{Balance, JobOptions, Route, SortBy};

use super::{
    network::Network,
    timeline::{Kind, Phases},
};
use crate::{
    balance::{self, Dealing},
    options::SessionOptions,
};

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
    /// What the master deals out work by, on this network: relative to an element.
    pub fn relative(&self, network: &Network) -> balance::Costs {
        let of = |seconds: f64| if self.element > 0.0 { seconds / self.element } else { 0.0 };
        balance::Costs {
            node: of(self.node),
            pair: of(self.pair),
            message: of(network.message),
            travel: of(network.latency),
            byte: of(8.0 / network.rate),
            copy: of(network.byte),
        }
    }

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
            Kind::Transfer | Kind::WorkerState | Kind::Sort | Kind::Send | Kind::Receive => none,
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
    pub network: Network,
    /// What the master deals out work by.
    pub dealt_by: balance::Costs,
    /// What happens to hosts, by cycle.
    pub changes: Vec<Change>,
}

impl Machines {
    /// Whether hosts come and go.
    pub fn come_and_go(&self) -> bool {
        self.changes.iter().any(|change| !matches!(change.what, What::Speed(_)))
    }

    /// Whether a host is there only from a later cycle on.
    pub fn comes_later(&self, host: usize) -> bool {
        self.changes.iter().any(|change| change.host == host && change.what == What::Join)
    }
}

/// Something happens to a host when its worker starts a cycle; if it is not there, when the first host's worker does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Host, from 0.
    pub host: usize,
    pub cycle: u64,
    /// What happens.
    pub what: What,
}

/// What happens to a host.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum What {
    /// It has another relative speed from then on.
    Speed(f64),
    /// Its worker dies and its connections close: the master hears of it after the latency of the network.
    Die,
    /// It stands still for so long (s), as a stopped process does. Silent for longer than [`SILENCE`] it is given up; when it
    /// goes on, it dials again and joins anew.
    Stop(f64),
    Join,
}

/// After so long without a byte the master gives a host up (s).
pub const SILENCE: f64 = 10.0;

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
    /// Sorts beside those that are due: a measurement needs some, and new plans, in a short run.
    pub sort_every: Option<u64>,
    /// Who sorts.
    pub sort_by: SortBy,
}

impl Scheme {
    /// What the master's session goes by on these machines.
    pub fn options(&self, dealt_by: balance::Costs) -> SessionOptions {
        SessionOptions {
            asked: JobOptions {
                route: Some(self.route),
                balance: self.balance,
                lanes: self.lanes.map(|width| width.to_string()),
                sort_every: self.sort_every,
                sort_by: self.sort_by,
                no_output: true,
                ..JobOptions::default()
            },
            dealing: self.dealing,
            costs: dealt_by,
            ..SessionOptions::default()
        }
    }

    /// What Bolide does, on a route.
    pub fn bolide(route: Route) -> Self {
        Self {
            route,
            dealing: Dealing::Owners,
            overlap: true,
            balance: Balance::Given,
            lanes: None,
            sort_every: None,
            sort_by: SortBy::Auto,
        }
    }

    /// The control: a star without overlap, units dealt by weight alone.
    pub fn control() -> Self {
        Self {
            route: Route::Master,
            dealing: Dealing::Weights,
            overlap: false,
            balance: Balance::Given,
            lanes: None,
            sort_every: None,
            sort_by: SortBy::Auto,
        }
    }
}
