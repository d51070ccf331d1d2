//! The part of HDF5 that results need, for writing: groups, arrays of numbers in one piece, lists of words, and attributes.
//!
//! A file is described as a tree of [`Group`]s first. [`File::of`] gives every object its place, then [`File::head`] is the
//! superblock and all object headers, [`File::words`] are the lists of words, and each array is written at its own [`File::address`],
//! in any order. Format: "HDF5
//! File Format Specification", version 3.0: superblock version 0, object headers version 1 (sections II.A, IV.A.1.a), groups
//! whose links are messages (IV.A.2.g), contiguous layout version 3 (IV.A.2.i), attributes version 3 (IV.A.2.m),
//! words in global heaps (III.E). Equal
//! descriptions give equal bytes: there are no times in the file.

/// Undefined address.
const NOWHERE: u64 = u64::MAX;

/// Bytes of the superblock with the entry of the root group.
const SUPERBLOCK: usize = 96;

/// Bytes of the prefix of an object header.
const PREFIX: usize = 16;

/// Bytes of the smallest global heap.
const HEAP: usize = 4096;

/// Most words of a heap, whose indices have 16 bits.
const WORDS_OF_HEAP: usize = 1 << 15;

/// Type of a number or word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    F64,
    I64,
    U32,
    U8,
    /// A word of so many bytes of ASCII.
    Word(u32),
    /// Words of UTF-8 of any length.
    Words,
}

impl Kind {
    /// Bytes of one.
    pub fn width(self) -> u64 {
        match self {
            Self::F64 | Self::I64 => 8,
            Self::U32 => 4,
            Self::U8 => 1,
            Self::Word(width) => u64::from(width),
            // A length, the address of a heap, an index in it.
            Self::Words => 16,
        }
    }

    /// The datatype message.
    fn message(self) -> Vec<u8> {
        let integer = |signed: u8, bytes: u32| {
            let mut message = vec![0x10, signed << 3, 0, 0];
            message.extend(bytes.to_le_bytes());
            // Offset and precision (bits).
            message.extend([0, 0]);
            message.extend((8 * bytes as u16).to_le_bytes());
            message
        };
        match self {
            Self::I64 => integer(1, 8),
            Self::U32 => integer(0, 4),
            Self::U8 => integer(0, 1),
            Self::F64 => {
                // Leading bit of the mantissa implied, sign at bit 63, exponent of 11 bits at bit 52, mantissa of 52 bits.
                let mut message = vec![0x11, 0x20, 63, 0, 8, 0, 0, 0, 0, 0, 64, 0, 52, 11, 0, 52];
                message.extend(1023u32.to_le_bytes());
                message
            }
            Self::Word(width) => {
                // Filled with zeros.
                let mut message = vec![0x13, 0x01, 0, 0];
                message.extend(width.to_le_bytes());
                message
            }
            Self::Words => {
                // Strings with a zero behind them in memory, of bytes. Called ASCII, from which alone VTK converts.
                let mut message = vec![0x19, 0x01, 0, 0, 16, 0, 0, 0];
                message.extend(integer(0, 1));
                message
            }
        }
    }
}

/// An attribute of a group or array.
#[derive(Clone, Debug)]
pub struct Attribute {
    name: &'static str,
    kind: Kind,
    shape: Vec<u64>,
    bytes: Vec<u8>,
}

impl Attribute {
    /// A word of ASCII, as a string of fixed length.
    pub fn word(name: &'static str, word: &str) -> Self {
        let bytes = word.as_bytes().to_vec();
        Self { name, kind: Kind::Word((bytes.len() as u32).max(1)), shape: Vec::new(), bytes }
    }

    /// A list of whole numbers.
    pub fn list(name: &'static str, numbers: &[i64]) -> Self {
        let bytes = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
        Self { name, kind: Kind::I64, shape: vec![numbers.len() as u64], bytes }
    }

    /// A whole number.
    pub fn number(name: &'static str, number: i64) -> Self {
        Self { shape: Vec::new(), ..Self::list(name, &[number]) }
    }

    fn message(&self) -> Vec<u8> {
        let (kind, space) = (self.kind.message(), dataspace(&self.shape));
        let mut message = vec![3, 0];
        message.extend((self.name.len() as u16 + 1).to_le_bytes());
        message.extend((kind.len() as u16).to_le_bytes());
        message.extend((space.len() as u16).to_le_bytes());
        // The name is ASCII.
        message.push(0);
        message.extend(self.name.as_bytes());
        message.push(0);
        message.extend(kind);
        message.extend(space);
        let size = self.kind.width() * self.shape.iter().product::<u64>();
        let mut bytes = self.bytes.clone();
        bytes.resize(size as usize, 0);
        message.extend(bytes);
        message
    }
}

/// An array, whose numbers come later, or a list of words.
#[derive(Clone, Debug)]
pub struct Array {
    pub name: String,
    pub kind: Kind,
    /// Slowest index first; no array has more dimensions than two.
    pub shape: Vec<u64>,
    pub attributes: Vec<Attribute>,
    /// Of [`Kind::Words`].
    words: Vec<String>,
}

impl Array {
    fn n_bytes(&self) -> u64 {
        self.kind.width() * self.shape.iter().product::<u64>()
    }

    /// Bytes of the numbers, or of the words with their heaps.
    fn space(&self) -> u64 {
        let heaps: usize = self.words.chunks(WORDS_OF_HEAP).map(|words| heap_of(words).len()).sum();
        self.n_bytes().next_multiple_of(8) + heaps as u64
    }

    /// The words, as they stand at this address, and their heaps behind them.
    fn words_at(&self, address: u64) -> Vec<u8> {
        let mut heaps = Vec::new();
        let mut bytes = Vec::new();
        for words in self.words.chunks(WORDS_OF_HEAP) {
            let at = address + self.n_bytes() + heaps.len() as u64;
            for (index, word) in (1u32..).zip(words) {
                bytes.extend((bytes_of(word).len() as u32).to_le_bytes());
                bytes.extend(at.to_le_bytes());
                bytes.extend(index.to_le_bytes());
            }
            heaps.extend(heap_of(words));
        }
        bytes.extend(heaps);
        bytes
    }
}

/// An empty word has a byte all the same: readers take no bytes for no word.
fn bytes_of(word: &str) -> &[u8] {
    if word.is_empty() { b"\0" } else { word.as_bytes() }
}

/// A global heap of words, whose indices count from 1.
fn heap_of(words: &[String]) -> Vec<u8> {
    let mut objects = Vec::new();
    for (index, word) in (1u16..).zip(words) {
        let bytes = bytes_of(word);
        objects.extend(index.to_le_bytes());
        // One array refers to it.
        objects.extend([1, 0, 0, 0, 0, 0]);
        objects.extend((bytes.len() as u64).to_le_bytes());
        objects.extend(bytes);
        objects.resize(objects.len().next_multiple_of(8), 0);
    }
    let size = (16 + objects.len() + 16).max(HEAP);
    let mut heap = b"GCOL\x01\0\0\0".to_vec();
    heap.extend((size as u64).to_le_bytes());
    heap.extend(objects);
    // What is left is an object of index 0, whose size counts its own head.
    let left = size - heap.len();
    heap.extend([0; 8]);
    heap.extend((left as u64).to_le_bytes());
    heap.resize(size, 0);
    heap
}

/// A group with what is in it. Names within a group differ.
#[derive(Clone, Debug, Default)]
pub struct Group {
    pub name: String,
    pub attributes: Vec<Attribute>,
    pub groups: Vec<Group>,
    pub arrays: Vec<Array>,
}

impl Group {
    /// An empty group.
    pub fn named(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }

    /// Adds an array without attributes.
    pub fn add(&mut self, name: &str, kind: Kind, shape: &[u64]) {
        self.arrays.push(Array {
            name: name.to_owned(),
            kind,
            shape: shape.to_vec(),
            attributes: Vec::new(),
            words: Vec::new(),
        });
    }

    /// Adds a list of words.
    pub fn add_words(&mut self, name: &str, words: &[String]) {
        self.add(name, Kind::Words, &[words.len() as u64]);
        self.arrays.last_mut().expect("just added").words = words.to_vec();
    }
}

/// A file whose objects have their places.
pub struct File {
    head: Vec<u8>,
    /// Path and address of each array, `/VTKHDF/Points`.
    addresses: Vec<(String, u64)>,
    /// Address and bytes of lists of words.
    words: Vec<(u64, Vec<u8>)>,
    length: u64,
}

impl File {
    /// Places the objects of a tree, the root first, then the numbers of its arrays.
    pub fn of(root: &Group) -> Self {
        let mut next = SUPERBLOCK as u64 + space_of(root);
        let (mut addresses, mut words) = (Vec::new(), Vec::new());
        place(root, "", &mut next, &mut |path, array: &Array, address| {
            if array.kind == Kind::Words {
                words.push((address, array.words_at(address)));
            }
            addresses.push((path, address));
        });
        let length = next;
        let mut head = superblock(length);
        let mut numbers = addresses.iter().map(|(_, address)| *address);
        write_group(root, &mut head, &mut numbers);
        Self { head, addresses, words, length }
    }

    /// Superblock and object headers: the first bytes of the file.
    pub fn head(&self) -> &[u8] {
        &self.head
    }

    /// Addresses and bytes of all lists of words.
    pub fn words(&self) -> &[(u64, Vec<u8>)] {
        &self.words
    }

    /// Where the numbers of an array begin.
    ///
    /// # Panics
    /// If the tree has no such array.
    pub fn address(&self, path: &str) -> u64 {
        let found = self.addresses.iter().find(|(name, _)| name == path);
        found.unwrap_or_else(|| panic!("no array {path} in the file")).1
    }

    /// Bytes of the whole file.
    pub fn length(&self) -> u64 {
        self.length
    }
}

/// Gives the arrays their places, which begin at multiples of eight.
fn place(group: &Group, path: &str, next: &mut u64, tell: &mut impl FnMut(String, &Array, u64)) {
    for array in &group.arrays {
        tell(format!("{path}/{}", array.name), array, *next);
        *next += array.space();
    }
    for inner in &group.groups {
        place(inner, &format!("{path}/{}", inner.name), next, tell);
    }
}

/// Bytes of the object headers of a group and of all that is in it.
fn space_of(group: &Group) -> u64 {
    let own = header(&group_messages(group, &[])).len();
    let arrays: usize = group.arrays.iter().map(|array| header(&array_messages(array, 0)).len()).sum();
    (own + arrays) as u64 + group.groups.iter().map(space_of).sum::<u64>()
}

/// Appends the headers of a group, of its arrays and of its groups. `numbers` gives the addresses of arrays in the order of [`place`].
fn write_group(group: &Group, head: &mut Vec<u8>, numbers: &mut impl Iterator<Item = u64>) {
    let start = head.len() as u64;
    let mut next = start + header(&group_messages(group, &[])).len() as u64;
    let mut links = Vec::new();
    for array in &group.arrays {
        links.push(next);
        next += header(&array_messages(array, 0)).len() as u64;
    }
    for inner in &group.groups {
        links.push(next);
        next += space_of(inner);
    }
    head.extend(header(&group_messages(group, &links)));
    for array in &group.arrays {
        let address = numbers.next().expect("every array has a place");
        head.extend(header(&array_messages(array, address)));
    }
    for inner in &group.groups {
        write_group(inner, head, numbers);
    }
}

fn superblock(length: u64) -> Vec<u8> {
    let mut block = b"\x89HDF\r\n\x1a\n".to_vec();
    // Versions; eight bytes for offsets and for lengths.
    block.extend([0, 0, 0, 0, 0, 8, 8, 0]);
    // Sizes of nodes of groups that have none here.
    block.extend(4u16.to_le_bytes());
    block.extend(16u16.to_le_bytes());
    block.extend([0; 4]);
    for address in [0, NOWHERE, length, NOWHERE] {
        block.extend(address.to_le_bytes());
    }
    // The root group: no name, its header, nothing cached.
    for word in [0, SUPERBLOCK as u64, 0, 0, 0] {
        block.extend(word.to_le_bytes());
    }
    block
}

/// An object header of messages, each with its type.
fn header(messages: &[(u16, Vec<u8>)]) -> Vec<u8> {
    let mut body = Vec::new();
    for (kind, message) in messages {
        let size = message.len().next_multiple_of(8);
        body.extend(kind.to_le_bytes());
        body.extend((size as u16).to_le_bytes());
        body.extend([0; 4]);
        body.extend(message);
        body.resize(body.len() + size - message.len(), 0);
    }
    let mut header = vec![1, 0];
    header.extend((messages.len() as u16).to_le_bytes());
    // One link leads here.
    header.extend(1u32.to_le_bytes());
    header.extend((body.len() as u32).to_le_bytes());
    header.resize(PREFIX, 0);
    header.extend(body);
    header
}

/// The messages of a group; without `links` those of the right length.
fn group_messages(group: &Group, links: &[u64]) -> Vec<(u16, Vec<u8>)> {
    // Links are messages of the group: no heap, no index.
    let mut info = vec![0, 0];
    info.extend(NOWHERE.to_le_bytes());
    info.extend(NOWHERE.to_le_bytes());
    let mut messages = vec![(0x02, info)];
    let names = group.arrays.iter().map(|a| &a.name).chain(group.groups.iter().map(|g| &g.name));
    for (index, name) in names.enumerate() {
        // A length of two bytes, then UTF-8, then the address of a hard link.
        let mut link = vec![1, 0b1_0001, 1];
        link.extend((name.len() as u16).to_le_bytes());
        link.extend(name.as_bytes());
        link.extend(links.get(index).copied().unwrap_or(NOWHERE).to_le_bytes());
        messages.push((0x06, link));
    }
    messages.extend(group.attributes.iter().map(|attribute| (0x0c, attribute.message())));
    messages
}

fn array_messages(array: &Array, address: u64) -> Vec<(u16, Vec<u8>)> {
    let size = array.n_bytes();
    let mut layout = vec![3, 1];
    layout.extend((if size == 0 { NOWHERE } else { address }).to_le_bytes());
    layout.extend(size.to_le_bytes());
    let mut messages = vec![
        (0x01, dataspace(&array.shape)),
        (0x03, array.kind.message()),
        // No fill value: everything is written.
        (0x05, vec![2, 2, 2, 0]),
        (0x08, layout),
    ];
    messages.extend(array.attributes.iter().map(|attribute| (0x0c, attribute.message())));
    messages
}

/// The dataspace message; of no dimension for a single value.
fn dataspace(shape: &[u64]) -> Vec<u8> {
    let mut message = vec![1, shape.len() as u8, 0, 0, 0, 0, 0, 0];
    message.extend(shape.iter().flat_map(|n| n.to_le_bytes()));
    message
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree() -> Group {
        let mut inner = Group::named("Steps");
        inner.attributes.push(Attribute::number("NSteps", 2));
        inner.add("Values", Kind::F64, &[2]);
        let mut root = Group::default();
        root.add("empty", Kind::U8, &[0]);
        root.add("ids", Kind::U32, &[3]);
        root.groups.push(inner);
        root
    }

    #[test]
    fn objects_follow_each_other_and_arrays_begin_at_multiples_of_eight() {
        let file = File::of(&tree());
        let head = file.head().len() as u64;
        assert_eq!(head % 8, 0);
        assert_eq!(
            [file.address("/empty"), file.address("/ids"), file.address("/Steps/Values")],
            [head, head, head + 16]
        );
        assert_eq!(file.length(), head + 32);
    }

    #[test]
    fn links_lead_to_headers_and_the_root_is_behind_the_superblock() {
        let file = File::of(&tree());
        let head = file.head();
        assert_eq!(&head[..8], b"\x89HDF\r\n\x1a\n");
        assert_eq!(head[64..72], 96u64.to_le_bytes());
        for name in ["empty", "ids", "Steps"] {
            let at = head.windows(name.len()).position(|bytes| bytes == name.as_bytes()).expect("a link");
            let address = &head[at + name.len()..at + name.len() + 8];
            let address = u64::from_le_bytes(address.try_into().expect("eight bytes")) as usize;
            assert_eq!(head[address..address + 2], [1, 0], "{name}: an object header of version 1");
        }
    }
}
