//! Everything that reads what comes from outside.

use std::sync::Arc;

use master::{
    event::{Action, Event, WorkerSpec},
    job::Job,
    snapshot,
};
use protocol::{
    codec,
    frame::{CHUNK, Frame, HEADER_LEN, Header, Kind, decode_header, encode_header},
    handshake::{self, Hello, Policy, Role, Server},
    options::JobOptions,
    order::Inbox,
    request::{JOINING_LIMIT, Joined, Joining, Reply, Request},
    token::Token,
    wire::{self, Packed},
};
use worker::{
    compute::Machine,
    session::{self, Session},
};

use super::{
    damage,
    said::{DECK, Said, job},
};
use crate::{
    seeds::Draws,
    solve::{Workers, model, solve, without_states},
};

/// Something that reads what comes from outside.
pub trait Target {
    fn name(&self) -> &'static str;
    /// Takes a damaged input; whether it was taken for a good one. A panic is a finding.
    fn attack(&mut self, draws: &mut Draws) -> bool;
}

/// Every target, with its corpus.
///
/// # Panics
/// If the corpus cannot be made: the run that it is taken from fails.
pub fn all() -> Vec<Box<dyn Target>> {
    let said = Arc::new(Said::record());
    vec![
        Box::new(HeaderBytes),
        Box::new(Frames),
        Box::new(Greeting),
        Box::new(Messages(Arc::clone(&said))),
        Box::new(Requests),
        Box::new(Tokens),
        Box::new(Decks),
        Box::new(KeywordDecks),
        Box::new(MeshFiles::new()),
        Box::new(Snapshots::new()),
        Box::new(WorkerSession(Arc::clone(&said))),
        Box::new(JobSession(said)),
    ]
}

fn one<'a, T>(of: &'a [T], draws: &mut Draws) -> &'a T {
    &of[draws.below(of.len() as u64) as usize]
}

struct HeaderBytes;

impl Target for HeaderBytes {
    fn name(&self) -> &'static str {
        "frame header"
    }

    fn attack(&mut self, draws: &mut Draws) -> bool {
        let kind = *one(&Kind::ALL, draws);
        let header =
            Header { length: draws.below(1 << 20) as u32, cycle: draws.below(99), ..Header::new(kind) };
        let mut bytes = encode_header(&header).to_vec();
        damage(&mut bytes, draws);
        bytes.resize(HEADER_LEN, 0);
        let Ok(head) = <[u8; HEADER_LEN]>::try_from(bytes) else { return false };
        match decode_header(&head) {
            Ok(header) => {
                assert!(header.length <= header.kind.limit(), "{header:?}");
                assert_eq!(encode_header(&header), head, "what is read is what was written");
                true
            }
            Err(_) => false,
        }
    }
}

/// Frames of one connection, one after another.
struct Frames;

impl Target for Frames {
    fn name(&self) -> &'static str {
        "frames in order"
    }

    fn attack(&mut self, draws: &mut Draws) -> bool {
        let limit = 1 << 20;
        let mut inbox = Inbox::new(7, limit);
        for number in 0..1 + draws.below(12) {
            let kind =
                *one(&[Kind::Control, Kind::Bulk, Kind::Bulk, Kind::Cycle, Kind::Bye, Kind::Hello], draws);
            let total = draws.below(3 * CHUNK as u64);
            let mut payload = Vec::new();
            payload.extend_from_slice(&draws.below(4).to_le_bytes());
            payload.extend_from_slice(&total.to_le_bytes());
            payload.resize(16 + total.min(CHUNK as u64) as usize, 1);
            damage(&mut payload, draws);
            let sequence = if draws.below(3) > 0 { number as u32 } else { draws.below(4) as u32 };
            let header = Header { incarnation: 7, sequence, ..Header::new(kind) };
            if inbox.accept(Frame::new(header, payload)).is_err() {
                return false;
            }
            while inbox.take().is_some() {}
        }
        true
    }
}

struct Greeting;

impl Target for Greeting {
    fn name(&self) -> &'static str {
        "greeting"
    }

    fn attack(&mut self, draws: &mut Draws) -> bool {
        let role = *one(&[Role::Worker, Role::Client, Role::Peer, Role::Newcomer], draws);
        let mut hello = Hello::new(role, "pc-1", 1.5, 2, "avx2", draws.below(1 << 40));
        hello.token = (draws.below(2) == 0).then(|| "secret".into());
        hello.proof = (draws.below(2) == 0).then(|| "0123456789abcdef".into());
        let Ok(mut bytes) = codec::encode(&hello) else { return false };
        damage(&mut bytes, draws);
        let kind = if draws.below(10) == 0 { *one(&Kind::ALL, draws) } else { Kind::Hello };
        let frame = Frame::new(Header::new(kind), bytes);
        let _ = handshake::reason(&frame);
        let policy = Policy { roles: vec![Role::Worker, Role::Newcomer], ..Policy::default() };
        match Server::new(policy).apply(&frame) {
            Ok(handshake::Verdict::Good(hello)) => {
                assert_eq!(hello.check(), Ok(()), "{hello:?}");
                true
            }
            Ok(handshake::Verdict::Bad { .. }) | Err(_) => false,
        }
    }
}

/// Messages of a run, by themselves.
struct Messages(Arc<Said>);

impl Target for Messages {
    fn name(&self) -> &'static str {
        "messages"
    }

    fn attack(&mut self, draws: &mut Draws) -> bool {
        let (_, packed) = match draws.below(2) {
            0 => one(&self.0.to_worker, draws),
            _ => one(&self.0.to_master, draws),
        };
        let mut bytes = packed.bytes.clone();
        damage(&mut bytes, draws);
        let worker = wire::unpack_to_worker(packed.kind, &bytes).is_ok();
        let master = wire::unpack_to_master(packed.kind, &bytes).is_ok();
        let peer = wire::unpack_to_peer(packed.kind, &bytes).is_ok();
        worker || master || peer
    }
}

struct Requests;

impl Target for Requests {
    fn name(&self) -> &'static str {
        "requests"
    }

    fn attack(&mut self, draws: &mut Draws) -> bool {
        let name = "a.toml".to_owned();
        let mut bytes = match draws.below(5) {
            0 => codec::encode(&Request::File { job: 3, name, offset: 70 }),
            1 => codec::encode(&Request::Watch { job: Some(1) }),
            2 => codec::encode(&Reply::Files(vec![(name, 12)])),
            3 => codec::encode(&Joining { request: vec![48; 90] }),
            _ => codec::encode(&Joined { certificate: "PEM".into(), ca: "PEM".into() }),
        }
        .unwrap_or_default();
        damage(&mut bytes, draws);
        let limit = JOINING_LIMIT as usize;
        let request = codec::decode::<Request>(&bytes, limit);
        let reply = codec::decode::<Reply>(&bytes, limit);
        let joining = codec::decode::<Joining>(&bytes, limit);
        request.is_ok() || reply.is_ok() || joining.is_ok() || codec::decode::<Joined>(&bytes, limit).is_ok()
    }
}

struct Tokens;

impl Target for Tokens {
    fn name(&self) -> &'static str {
        "token"
    }

    fn attack(&mut self, draws: &mut Draws) -> bool {
        let bytes = [0; 16].map(|_: u8| draws.below(256) as u8);
        let token = Token { pin: bytes, secret: bytes.map(|b: u8| b.rotate_left(3)) };
        let mut text = token.to_string().into_bytes();
        damage(&mut text, draws);
        match String::from_utf8_lossy(&text).parse::<Token>() {
            Ok(read) => {
                assert_eq!(read.to_string(), String::from_utf8_lossy(&text).trim(), "read as it was written");
                true
            }
            Err(error) => {
                assert!(error.to_string().len() < 300, "{error}");
                false
            }
        }
    }
}

struct Decks;

impl Target for Decks {
    fn name(&self) -> &'static str {
        "deck"
    }

    fn attack(&mut self, draws: &mut Draws) -> bool {
        let mut bytes = DECK.as_bytes().to_vec();
        damage(&mut bytes, draws);
        // What asks for millions of elements may be good, and is not what is looked for here.
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let digits = text.split(|c: char| !c.is_ascii_digit()).map(str::len).max();
        digits <= Some(4) && deck::read(&text, "deck").is_ok()
    }
}

/// A keyword deck of two solids, with parameters, a curve, sets and an offset block of data.
const KEYWORDS: &str = "*KEYWORD
*TITLE
one on another
*PARAMETER
R  speed      -50.0
*CONTROL_TERMINATION
      0.01
*PART
upper
         1         1         1
lower
         2         1         1
*SECTION_SOLID
         1         1
*MAT_PLASTIC_KINEMATIC
         1 7.850E-06     210.0       0.3       0.6       1.5       1.0
*CONTACT_AUTOMATIC_SINGLE_SURFACE
         0
*NODE
       1             0.0             0.0             0.0
       2             1.0             0.0             0.0
       3             1.0             1.0             0.0
       4             0.0             1.0             0.0
       5             0.0             0.0             1.0
       6             1.0             0.0             1.0
       7             1.0             1.0             1.0
       8             0.0             1.0             1.0
      11             0.2             0.2             1.3
      12             0.9             0.2             1.3
      13             0.9             0.9             1.3
      14             0.2             0.9             1.3
      15             0.2             0.2             2.0
      16             0.9             0.2             2.0
      17             0.9             0.9             2.0
      18             0.2             0.9             2.0
*ELEMENT_SOLID
       1       2       1       2       3       4       5       6       7       8
       2       1      11      12      13      14      15      16      17      18
*SET_PART_LIST
         1
         1
*INITIAL_VELOCITY_GENERATION
         1         1       0.0       0.0       0.0    &speed
*END
";

struct KeywordDecks;

impl Target for KeywordDecks {
    fn name(&self) -> &'static str {
        "keyword deck"
    }

    fn attack(&mut self, draws: &mut Draws) -> bool {
        let mut bytes = KEYWORDS.as_bytes().to_vec();
        if draws.below(4) == 0 {
            // Lines out of place: cards without their keyword, keywords without their cards.
            let lines: Vec<&str> = KEYWORDS.lines().collect();
            let (from, to) = (one(&lines, draws), draws.below(lines.len() as u64) as usize);
            let mut mixed: Vec<&str> = lines.clone();
            mixed.insert(to, from);
            if draws.below(2) == 0 {
                mixed.remove(draws.below(mixed.len() as u64) as usize);
            }
            bytes = mixed.join("\n").into_bytes();
        }
        damage(&mut bytes, draws);
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let read = deck::read_whole(&text, "deck.k");
        // Both ways to the model refuse the same decks.
        assert_eq!(deck::convert(&text, "deck.k", "deck.mesh").is_ok(), read.is_ok(), "{text}");
        read.is_ok()
    }
}

/// Mesh files, and bundles of a deck with its mesh.
struct MeshFiles {
    mesh: String,
    bundle: String,
}

impl MeshFiles {
    fn new() -> Self {
        let converted = deck::convert(KEYWORDS, "deck.k", "deck.mesh");
        let deck::Converted { deck, mesh, .. } =
            converted.unwrap_or_else(|faults| panic!("the corpus: {faults:?}"));
        let (long, wide) = (deck.len(), mesh.len());
        let bundle =
            format!("#bolide-bundle 1\nfile {long} deck.toml\n{deck}\nfile {wide} deck.mesh\n{mesh}\n");
        assert!(
            deck::read(&bundle, "bundle").is_ok(),
            "the corpus: {:?}",
            deck::read(&bundle, "bundle").err()
        );
        Self { mesh, bundle }
    }
}

impl Target for MeshFiles {
    fn name(&self) -> &'static str {
        "mesh and bundle"
    }

    fn attack(&mut self, draws: &mut Draws) -> bool {
        let bundled = draws.below(2) == 0;
        let mut bytes = if bundled { self.bundle.clone() } else { self.mesh.clone() }.into_bytes();
        damage(&mut bytes, draws);
        let text = String::from_utf8_lossy(&bytes);
        match bundled {
            true => deck::read(&text, "bundle").is_ok(),
            false => deck::mesh_file::parse(&text, "mesh").is_ok(),
        }
    }
}

/// Snapshots whose checksum is right and whose body is not.
struct Snapshots {
    model: Arc<deck::Model>,
    file: Vec<u8>,
    folder: tempfile::TempDir,
}

impl Snapshots {
    /// Bytes before the first chunk's sum: magic, length, cycle.
    const HEAD: usize = 24;
    /// Bytes of a sum.
    const SUM: usize = 32;

    fn new() -> Self {
        let options = without_states(JobOptions { snapshot_at: Some(4), ..JobOptions::default() });
        let solved = solve(model(DECK), Workers { options, ..Workers::of(1) });
        let solved = solved.unwrap_or_else(|e| panic!("the corpus: {e}"));
        let folder = tempfile::tempdir().unwrap_or_else(|e| panic!("the corpus: {e}"));
        let path = folder.path().join("snapshot");
        let stored = solved.snapshot.unwrap_or_else(|| panic!("the corpus: no snapshot"));
        snapshot::write(&path, &stored).unwrap_or_else(|e| panic!("the corpus: {e}"));
        let file = std::fs::read(&path).unwrap_or_else(|e| panic!("the corpus: {e}"));
        Self { model: Arc::new(model(DECK)), file, folder }
    }
}

impl Target for Snapshots {
    fn name(&self) -> &'static str {
        "snapshot"
    }

    fn attack(&mut self, draws: &mut Draws) -> bool {
        let mut bytes = self.file.clone();
        if draws.below(4) == 0 {
            damage(&mut bytes, draws);
        } else {
            let mut body = bytes.split_off(Self::HEAD + Self::SUM);
            body.truncate(body.len() - Self::SUM);
            damage(&mut body, draws);
            bytes[8..16].copy_from_slice(&(body.len() as u64).to_le_bytes());
            if draws.below(8) == 0 {
                bytes[16 + draws.below(8) as usize] ^= 1 << draws.below(8);
            }
            bytes.truncate(Self::HEAD);
            let mut sums = blake3::Hasher::new();
            sums.update(&bytes);
            for chunk in body.chunks(snapshot::file::CHUNK) {
                let sum = blake3::hash(chunk);
                sums.update(sum.as_bytes());
                bytes.extend_from_slice(sum.as_bytes());
                bytes.extend_from_slice(chunk);
            }
            bytes.extend_from_slice(sums.finalize().as_bytes());
        }
        let path = self.folder.path().join("damaged");
        if std::fs::write(&path, bytes).is_err() {
            return false;
        }
        let Ok(stored) = snapshot::read(&path) else { return false };
        let specs = [WorkerSpec::new("host", 1.0, 1)];
        Job::new(Arc::clone(&self.model), &specs, without_states(JobOptions::default()), Some(stored)).is_ok()
    }
}

/// A worker's session that hears damaged messages among good ones. Nothing is computed: outcomes are as good as random.
struct WorkerSession(Arc<Said>);

impl Target for WorkerSession {
    fn name(&self) -> &'static str {
        "worker's session"
    }

    fn attack(&mut self, draws: &mut Draws) -> bool {
        let said: Vec<&Packed> = self.0.to_worker.iter().filter(|(w, _)| *w == 0).map(|(_, p)| p).collect();
        let (mut session, mut machine) = (Session::new(), Machine::new());
        let bad_at = draws.below(said.len() as u64) as usize;
        let mut taken = false;
        for (number, packed) in said.iter().enumerate() {
            let mut bytes = packed.bytes.clone();
            if number == bad_at {
                damage(&mut bytes, draws);
            }
            let Ok(message) = wire::unpack_to_worker(packed.kind, &bytes) else { return false };
            taken |= number == bad_at;
            // The good beginning is computed; after damage what is computed is no matter.
            let computes = number < bad_at;
            let mut steps: std::collections::VecDeque<_> =
                session.apply(session::Event::Message(message)).into();
            for _ in 0..64 {
                let Some(step) = steps.pop_front() else { break };
                let session::Action::Compute(task) = step else { continue };
                let outcome = if computes { machine.run(task) } else { some_outcome(draws) };
                steps.extend(session.apply(session::Event::Done(outcome)));
            }
        }
        taken
    }
}

fn some_outcome(draws: &mut Draws) -> session::Outcome {
    use session::Outcome::{Computed, Failed, Forces, Integrated, Loaded, Sampled, Transferred};
    let numbers = |draws: &mut Draws| vec![1.0; draws.below(30) as usize];
    match draws.below(7) {
        0 => Loaded { vote: None, lanes: "scalar".into() },
        1 => Transferred(numbers(draws)),
        2 => Computed,
        3 => Forces { partials: numbers(draws), gathered: numbers(draws) },
        4 => Integrated(Box::new(mechanics::vote::Vote::empty(2))),
        5 => Sampled([3; 16]),
        _ => Failed("it failed".into()),
    }
}

/// The job's session, whose workers say damaged things among good ones, too late, twice, or in each other's name.
struct JobSession(Arc<Said>);

impl Target for JobSession {
    fn name(&self) -> &'static str {
        "job's session"
    }

    fn attack(&mut self, draws: &mut Draws) -> bool {
        let (mut job, first) = job(&self.0.model);
        let mut sorts = Vec::new();
        let mut keep = |actions: Vec<Action>| {
            sorts.extend(actions.into_iter().filter_map(|action| match action {
                Action::Sort(bench, x) => Some(bench.sort(&x)),
                _ => None,
            }));
            sorts.pop()
        };
        keep(first);
        let said = &self.0.to_master;
        let bad_at = draws.below(said.len() as u64) as usize;
        let mut taken = false;
        for (number, (worker, packed)) in said.iter().enumerate() {
            let mut worker = *worker;
            let mut bytes = packed.bytes.clone();
            let mut epoch = 0;
            if number == bad_at {
                match draws.below(8) {
                    0 => worker = draws.below(4) as usize,
                    1 => epoch = draws.below(3) as u32,
                    2 => {
                        keep(job.apply(Event::Lost(worker, "gone".into())));
                    }
                    _ => damage(&mut bytes, draws),
                }
            }
            let Ok(message) = wire::unpack_to_master(packed.kind, &bytes) else { return taken };
            taken |= number == bad_at;
            let mut sorted = keep(job.apply(Event::Message(worker, epoch, message)));
            while let Some(sort) = sorted.take() {
                sorted = keep(job.apply(Event::Sorted(Box::new(sort))));
            }
            if job.is_over() {
                break;
            }
        }
        taken
    }
}
