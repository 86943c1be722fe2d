//! Bitstreams and overlays of made-up content, for the tests of loading.

/// Everything before the first write: bus width, sync word, and one NOP.
pub(crate) const HEAD: &[u32] = &[!0, !0, 0xBB, 0x1122_0044, !0, !0, 0xAA99_5566, 0x2000_0000];
/// Frames in a packet of type 2, to the register FDRI.
pub(crate) const BODY: &[u32] = &{
    let mut words = [0x1234_5678; 66];
    (words[0], words[1]) = (0x3000_4000, 0x5000_0000 | 64);
    words
};
/// The command DESYNC, and padding.
pub(crate) const DESYNCED: &[u32] = &[0x3000_8001, 13, 0x2000_0000, 0x2000_0000];

/// A packet of type 1 that writes a register.
pub(crate) fn write(register: u32, data: &[u32]) -> Vec<u32> {
    let count = u32::try_from(data.len()).expect("few");
    [&[1 << 29 | 2 << 27 | register << 13 | count], data].concat()
}

/// The write of an IDCODE.
pub(crate) fn chip(idcode: u32) -> Vec<u32> {
    write(12, &[idcode])
}

/// Words without a pattern: the first is no packet.
pub(crate) fn noise(words: u32) -> Vec<u32> {
    (1..=words).map(|k| k.wrapping_mul(0x9E37_79B9) | 7 << 29).collect()
}

/// The bytes of a bitstream, as bootgen swaps them.
pub(crate) fn bytes(words: &[&[u32]]) -> Vec<u8> {
    words.concat().iter().flat_map(|word| word.to_le_bytes()).collect()
}

/// A whole bitstream for the XCZU9EG, which may ask for a rate of the PL clock 0.
pub(crate) fn bitstream(clock_mhz: Option<u32>) -> Vec<u8> {
    let user = clock_mhz.map_or_else(Vec::new, |mhz| write(13, &[0x5047_0000 | mhz]));
    bytes(&[HEAD, &chip(0x0473_8093), &user, BODY, DESYNCED])
}

/// A property of a device tree: name and value.
pub(crate) type Property<'a> = (&'a str, &'a [u8]);

/// A node of a device tree: name, properties, children.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node<'a>(
    pub(crate) &'a str,
    pub(crate) &'a [Property<'a>],
    pub(crate) &'a [Node<'a>],
);

impl<'a> Node<'a> {
    /// The root of an overlay with one fragment, which adds this to the node that it is for.
    pub(crate) fn overlay(self) -> Vec<u8> {
        let fragment =
            Node("fragment@0", &[("target", &[0xFF; 4])], &[Node("__overlay__", self.1, self.2)]);
        tree(Node("", &[], &[fragment]))
    }
}

/// A compiled device tree with this root.
pub(crate) fn tree(root: Node<'_>) -> Vec<u8> {
    let (mut nodes, mut names) = (Vec::new(), Vec::new());
    add(root, &mut nodes, &mut names);
    nodes.extend(9_u32.to_be_bytes());
    let length = |bytes: usize| u32::try_from(bytes).expect("small");
    let strings = 56 + length(nodes.len());
    let total = strings + length(names.len());
    let head = [0xD00D_FEED, total, 56, strings, 40, 17, 16, 0, length(names.len())];
    let head = head.into_iter().chain([length(nodes.len()), 0, 0, 0, 0]);
    head.flat_map(u32::to_be_bytes).chain(nodes).chain(names).collect()
}

fn add(Node(name, properties, children): Node<'_>, nodes: &mut Vec<u8>, names: &mut Vec<u8>) {
    let padded = |nodes: &mut Vec<u8>| nodes.resize(nodes.len().next_multiple_of(4), 0);
    let word = |nodes: &mut Vec<u8>, word: usize| {
        nodes.extend(u32::try_from(word).expect("small").to_be_bytes());
    };
    word(nodes, 1);
    nodes.extend(name.as_bytes().iter().chain(&[0]));
    padded(nodes);
    for (name, value) in properties {
        for number in [3, value.len(), names.len()] {
            word(nodes, number);
        }
        nodes.extend(*value);
        padded(nodes);
        names.extend(name.as_bytes().iter().chain(&[0]));
    }
    for child in children {
        add(*child, nodes, names);
    }
    word(nodes, 2);
}

/// An overlay for the accelerator, which may set the PL clock 0 and name a bitstream to load.
pub(crate) fn overlay(clock_hz: Option<u32>, firmware: Option<&str>) -> Vec<u8> {
    let rate = clock_hz.unwrap_or_default().to_be_bytes();
    let clock = [0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0, 71];
    let clocked = [("assigned-clocks", &clock[..]), ("assigned-clock-rates", &rate[..])];
    let nodes = [Node("pgs-clock", &clocked, &[]), Node("pgs@a0000000", &[("reg", &[0; 16])], &[])];
    let nodes = if clock_hz.is_some() { &nodes[..] } else { &nodes[1..] };
    let name = firmware.map(|name| format!("{name}\0")).unwrap_or_default();
    let region = [("firmware-name", name.as_bytes())];
    Node("", if firmware.is_some() { &region[..] } else { &[] }, nodes).overlay()
}
