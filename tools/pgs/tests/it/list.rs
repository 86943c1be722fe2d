//! `pgs list` recognises a board by its regions, and reports the use of each device, on systems
//! made of files.

use std::fs;
use std::path::Path;

use crate::common::{Ran, pgs};
use serde_json::Value;
use tempfile::TempDir;

/// A system of files.
struct System(TempDir);

impl System {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a directory"))
    }

    fn file(&self, path: impl AsRef<Path>, text: &str) {
        let path = self.0.path().join(path);
        fs::create_dir_all(path.parent().expect("below the root")).expect("made");
        fs::write(path, format!("{text}\n")).expect("written");
    }

    /// Adds the node `uio<number>` with these regions, and its device file.
    fn node(&self, number: u32, name: &str, regions: &[(&str, u64)]) {
        let node = Path::new("sys/class/uio").join(format!("uio{number}"));
        self.file(node.join("name"), name);
        for (map, (region, address)) in regions.iter().enumerate() {
            let map = node.join(format!("maps/map{map}"));
            let address = format!("{address:#x}");
            for (file, text) in
                [("name", *region), ("addr", &address), ("size", "0x1000"), ("offset", "0x0")]
            {
                self.file(map.join(file), text);
            }
        }
        // As long as a device: each region is a page of it.
        let device = self.0.path().join("dev").join(format!("uio{number}"));
        self.file(&device, "");
        let file = fs::File::options().write(true).open(&device).expect("there");
        file.set_len(0x1000 * regions.len() as u64).expect("a sparse file");
    }

    /// Adds a u-dma-buf of this class.
    fn buffer(&self, class: &str, name: &str, attributes: &[&str]) {
        for attribute in attributes {
            self.file(Path::new("sys/class").join(class).join(name).join(attribute), "0");
        }
        self.file(Path::new("dev").join(name), "");
    }

    fn list(&self, more: &[&str]) -> Ran {
        let mut command = pgs();
        command.env("PGS_BOARD", "auto").arg("list").arg("--system-root").arg(self.0.path());
        let ran: Ran = command.args(more).output().expect("it starts").into();
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        ran
    }

    fn document(&self) -> Value {
        self.list(&["--json"]).json()
    }
}

const REGIONS: [(&str, u64); 5] = [
    ("dma0", 0xA000_0000),
    ("dma1", 0xA001_0000),
    ("dma2", 0xA002_0000),
    ("dma3", 0xA003_0000),
    ("control", 0xA004_0000),
];

/// The line of a text that begins with `begins`.
fn line<'a>(ran: &'a Ran, begins: &str) -> &'a str {
    ran.stdout.lines().find(|line| line.starts_with(begins)).expect(begins)
}

#[test]
fn the_board_under_another_name_is_recognised_and_can_be_taken() {
    let system = System::new();
    system.node(0, "pgs@a0000000", &REGIONS);
    let ran = system.list(&[]);
    assert!(line(&ran, "would open").contains("but uio0 \"pgs@a0000000\" has its regions"));
    let text = line(&ran, "uio node    uio0");
    assert!(text.contains("--board uio:pgs@a0000000"), "{text}");
    assert!(text.contains("`linux,uio-name = \"pgs\"`"), "{text}");
    let document = system.document();
    let node = &document["uio_nodes"][0];
    assert_eq!(node["part"], "accelerator");
    assert_eq!(node["board_option"], "uio:pgs@a0000000");
    assert_eq!(node["in_logic"], true);
    assert_eq!(document["board"]["kind"], "emulated");
}

#[test]
fn each_node_says_what_it_is_and_how_it_is_used() {
    let system = System::new();
    system.node(0, "second-dma1", &REGIONS[1..2]);
    system.node(1, "lonely", &REGIONS[4..]);
    system.node(2, "nameless", &REGIONS.map(|(_, address)| ("nameless@a", address)));
    system.node(3, "pgs-memory@50000000", &[("memory", 0x5000_0000)]);
    system.node(4, "other-design", &[("ctrl", 0xB000_0000)]);
    system.node(5, "axi-pmon", &[("pmon", 0xFD0B_0000)]);
    system.node(6, "pgs-memory", &[("memory", 0x5400_0000)]);
    system.node(7, "pgs-guard", &[("guard", 0x5800_0000)]);
    let ran = system.list(&[]);
    for (number, texts) in [
        (0, ["--board uio:second", "uio-name = \"pgs-dma1\""]),
        (1, ["region of the accelerator", "uio-name = \"pgs-control\""]),
        (2, ["`reg-names`", "uio-name = \"pgs\""]),
        (3, ["--memory uio:pgs-memory@50000000", "uio-name = \"pgs-memory\""]),
        (4, ["another device", "programmable logic"]),
        (5, ["another device", "axi-pmon"]),
        (6, ["pgs-memory", "usable"]),
        (7, ["pgs-guard", "usable"]),
    ] {
        let text = line(&ran, &format!("uio node    uio{number}"));
        assert!(texts.iter().all(|expected| text.contains(expected)), "{text}");
    }
    let document = system.document();
    let parts: Vec<_> = (0..8).map(|node| document["uio_nodes"][node]["part"].clone()).collect();
    let none = Value::Null;
    let expected = ["dma1", "control", "unnamed", "memory"].map(Value::from);
    assert_eq!(parts[..4], expected);
    assert_eq!(parts[4..], [none.clone(), none.clone(), Value::from("memory"), none]);
    assert_eq!(document["uio_nodes"][3]["memory_option"], "uio:pgs-memory@50000000");
    assert_eq!(document["uio_nodes"][7]["memory_option"], Value::Null, "the guard is no memory");
}

#[test]
fn a_foreign_node_that_cannot_be_read_hides_no_board() {
    let system = System::new();
    system.node(0, "foreign", &[("registers", 0xFD0B_0000)]);
    system.file("sys/class/uio/uio0/maps/map0/size", "large");
    system.node(1, "pgs", &REGIONS);
    let ran = system.list(&[]);
    assert!(line(&ran, "would open").contains("uio (there is a UIO node named \"pgs\")"));
    assert!(line(&ran, "uio node    uio0").contains("cannot be read"), "{}", ran.stdout);
    assert!(line(&ran, "uio node    uio1").ends_with("usable"), "{}", ran.stdout);
    let document = system.document();
    assert_eq!(document["uio_error"], Value::Null);
    assert_eq!(document["unreadable_uio_nodes"][0]["name"], "foreign");
    assert_eq!(document["uio_nodes"].as_array().map(Vec::len), Some(1));
}

#[test]
fn the_device_files_of_buffers_are_tried_and_old_modules_are_known() {
    let system = System::new();
    let maintained = ["phys_addr", "size", "sync_mode", "sync_for_cpu", "sync_for_device"];
    system.buffer("u-dma-buf", "pgs", &maintained);
    system.buffer("udmabuf", "udmabuf0", &maintained);
    system.buffer("u-dma-buf", "without", &maintained[..3]);
    system.buffer("u-dma-buf", "absent", &maintained);
    fs::remove_file(system.0.path().join("dev/absent")).expect("removed");
    let ran = system.list(&[]);
    for (name, text) in [
        ("pgs", "usable"),
        ("udmabuf0", "usable"),
        ("without", "--memory u-dma-buf:without:write-combining"),
        ("absent", "there is no device file"),
    ] {
        let line = line(&ran, &format!("u-dma-buf   {name:?}"));
        assert!(line.contains(text), "{line}");
    }
    let document = system.document();
    assert_eq!(document["u_dma_bufs"].as_array().map(Vec::len), Some(4));
    let memory = |at: usize| document["u_dma_buf_states"][at]["memory_option"].clone();
    let expected = [
        Value::Null,
        Value::from("u-dma-buf:pgs"),
        Value::from("u-dma-buf:udmabuf0"),
        Value::from("u-dma-buf:without:write-combining"),
    ];
    assert_eq!([0, 1, 2, 3].map(memory), expected);
}

#[test]
fn managers_are_shown_and_the_logics_own_decides() {
    let system = System::new();
    let manager = |number: u32, name: &str, state: &str| {
        system.file(format!("sys/class/fpga_manager/fpga{number}/name"), name);
        system.file(format!("sys/class/fpga_manager/fpga{number}/state"), state);
    };
    manager(0, "Xilinx Slave SelectMap FPGA Manager", "unknown");
    manager(1, "Xilinx ZynqMP FPGA Manager", "operating");
    let ran = system.list(&[]);
    assert!(line(&ran, "fpga        fpga0").ends_with(": unknown"), "{}", ran.stdout);
    assert!(line(&ran, "fpga        fpga1").ends_with(": operating"), "{}", ran.stdout);
    assert!(!ran.stdout.contains("\nlogic "), "{}", ran.stdout);
    let ran = system.list(&["--manager", "fpga0"]);
    assert!(line(&ran, "logic").contains("JTAG"), "{}", ran.stdout);
    let document = system.document();
    assert_eq!(document["fpga_managers"][1]["state"], "operating");
    assert_eq!(document["logic_error"], Value::Null);
}
