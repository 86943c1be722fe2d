//! Takes memory for DMA from the kernel module u-dma-buf, formerly udmabuf.
//!
//! The device file is locked, and mapped twice. Buffers: cached, with maintenance by range when
//! they change hands, or write-combining. Shared words: with `O_SYNC`, which the module maps
//! uncached.
//!
//! Maintenance is one write of a number to `sync_for_device` or `sync_for_cpu`:
//!
//! ```text
//! 63            32 31           4 3       2   1   0
//! | first byte    | bytes / 16   | direction | 0 | 1 |     1 to the device, 2 from it
//! ```
//!
//! The number always carries its range: the attributes `sync_offset` and `sync_size` are shared by
//! all users of the buffer.
//!
//! The class of the older module is `udmabuf`, with the same attributes. The oldest versions take
//! no range, and refuse the number.
//!
//! Source: README and source of u-dma-buf 5 and of udmabuf 1.4.
#![allow(unsafe_code, reason = "beats in mapped memory promise that no others overlap")]

use std::fs::{self, File, OpenOptions};
use std::io::Write as _;
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pgs_interface::record::BEAT_BYTES;

use super::Caching;
use super::pool::Region;
use super::sync_mode::set_mode;
use super::volatile::MappedBeats;
use crate::platform::linux::lock::LockedFile;
use crate::platform::linux::mapped::Mapping;
use crate::platform::linux::sysfs::{read_if_present, read_number};
use crate::platform::linux::system::{open_device, require_bytes};
use crate::platform::{Access, DmaMemory, PlatformError, Result, SharedMemory, System};

/// The number carries 32 bits of length, in multiples of 16.
const BYTES_MAX: u64 = 0xFFFF_FFF0;
/// Maintenance works on whole cache lines, and the pool's pieces are whole lines.
const LINE: usize = 64;

/// An open u-dma-buf.
#[derive(Debug)]
pub(crate) struct UDmaBuf {
    name: String,
    address: u64,
    bytes: u64,
    /// The mapping for buffers.
    data: Arc<Mapping>,
    /// The mapping for shared words.
    words: Arc<Mapping>,
    /// `None` if the CPU's accesses need no maintenance.
    sync: Option<Sync>,
}

/// The two attributes that request maintenance.
#[derive(Debug)]
struct Sync {
    for_device: (PathBuf, File),
    for_cpu: (PathBuf, File),
}

impl Sync {
    fn open(buffer: &Path) -> Result<Self> {
        let open = |name| {
            let path = buffer.join(name);
            match OpenOptions::new().write(true).open(&path) {
                Ok(file) => Ok((path, file)),
                Err(source) => Err(PlatformError::NoMaintenance { path, source }),
            }
        };
        Ok(Self { for_device: open("sync_for_device")?, for_cpu: open("sync_for_cpu")? })
    }
}

/// The number that requests maintenance of a range.
fn command(at: usize, bytes: usize, access: Access) -> u64 {
    let bytes = bytes.next_multiple_of(LINE) as u64;
    let direction: u64 = match access {
        Access::Read => 1,
        Access::Write => 2,
    };
    (at as u64) << 32 | bytes | direction << 2 | 1
}

fn synchronise(
    (path, file): &(PathBuf, File),
    at: usize,
    bytes: usize,
    access: Access,
) -> Result<()> {
    // Eighteen characters, on the stack: a step allocates nothing.
    let mut text = [0; 18];
    write!(&mut text[..], "{:#018x}", command(at, bytes, access))
        .and_then(|()| file.write_all_at(&text, 0))
        .map_err(|source| PlatformError::NoMaintenance { path: path.clone(), source })
}

impl UDmaBuf {
    /// Whether there is a buffer of that name.
    pub(crate) fn exists(system: &System, name: &str) -> bool {
        directory(system, name).is_ok()
    }

    /// Maps the buffer of that name.
    pub(crate) fn open(system: &System, name: &str, caching: Caching) -> Result<Self> {
        let buffer = directory(system, name)?;
        let address = read_number(&buffer.join("phys_addr"))?;
        let bytes = read_number(&buffer.join("size"))?;
        let unusable = |reason| PlatformError::UnusableMemory {
            region: name.to_owned(),
            address,
            bytes,
            reason,
        };
        if bytes > BYTES_MAX {
            return Err(unusable("maintenance by range takes less than 4 GiB: make it smaller"));
        }
        if address % (LINE as u64) != 0 {
            return Err(unusable("it does not begin on a cache line: correct its reservation"));
        }
        let length = usize::try_from(bytes).map_err(|_| unusable("make it smaller"))?;
        let coherent = is_coherent(&buffer)?;
        // The lock comes first: the mode holds for all users of the buffer.
        let path = system.dev.join(name);
        let lock = Arc::new(LockedFile::open(&path, nix::libc::O_SYNC)?);
        set_mode(name, &buffer, caching, coherent)?;

        let words = Mapping::new(&lock, 0, 0, length).map(Arc::new)?;
        let cached = || {
            let file = open_device(&path, 0)?;
            Mapping::of_file(&lock, &file, 0, 0, length).map(Arc::new)
        };
        let (data, sync) = match caching {
            Caching::WriteCombining => (Arc::clone(&words), None),
            Caching::Cached if coherent => (cached()?, None),
            Caching::Cached => (cached()?, Some(Sync::open(&buffer)?)),
        };
        Ok(Self { name: name.to_owned(), address, bytes, data, words, sync })
    }
}

/// Whether the kernel knows that the device sees the CPU's caches.
fn is_coherent(buffer: &Path) -> Result<bool> {
    Ok(read_if_present(&buffer.join("dma_coherent"))?.is_some_and(|text| text == "1"))
}

/// The attributes of the buffer of that name.
pub(crate) fn directory(system: &System, name: &str) -> Result<PathBuf> {
    let classes = [&system.u_dma_buf, &system.udmabuf];
    let found = classes.into_iter().map(|class| class.join(name)).find(|path| path.exists());
    found.ok_or_else(|| PlatformError::NoUDmaBuf {
        wanted: name.to_owned(),
        found: u_dma_buf_names(system).join(", "),
    })
}

/// The names of all u-dma-buf buffers.
#[must_use]
pub fn u_dma_buf_names(system: &System) -> Vec<String> {
    let mut names: Vec<_> = [&system.u_dma_buf, &system.udmabuf]
        .into_iter()
        .filter_map(|class| fs::read_dir(class).ok())
        .flatten()
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// Tries whether the buffer of that name can be opened, and maintained if it is cached.
///
/// # Errors
/// [`PlatformError::NoMaintenance`] if it can be used with [`Caching::WriteCombining`] only; or
/// another error if it cannot be used.
pub fn try_u_dma_buf(system: &System, name: &str) -> Result<(), PlatformError> {
    let buffer = directory(system, name)?;
    let path = system.dev.join(name);
    let file = open_device(&path, nix::libc::O_SYNC)?;
    require_bytes(&file, &path, read_number(&buffer.join("size"))?)?;
    if is_coherent(&buffer)? {
        return Ok(());
    }
    Sync::open(&buffer).map(drop)
}

impl Region for UDmaBuf {
    fn name(&self) -> &str {
        &self.name
    }

    fn address(&self) -> u64 {
        self.address
    }

    fn bytes(&self) -> u64 {
        self.bytes
    }

    fn memory(&self, at: usize, beats: usize) -> Result<DmaMemory> {
        let mapping = Arc::clone(&self.data);
        // SAFETY: `set_mode` made sure that the mapping is normal memory. The device file is locked
        // as long as the mapping exists (`LockedFile`, held by both mappings): no other pool, of
        // this program or another, has this buffer. This one gives each piece out once until it is
        // released, after its memory was dropped, and pieces do not overlap; the shared words are
        // pieces too. The device writes a piece only between `to_device` and `to_cpu`, when the
        // pool holds the value and no slice of it exists.
        let memory = unsafe { MappedBeats::new(mapping, at, beats) };
        Ok(DmaMemory::Mapped(memory))
    }

    fn shared(&self, at: usize, words: usize) -> Result<SharedMemory> {
        if let Some(sync) = &self.sync {
            // No dirty line of an earlier use may be written back over the words.
            synchronise(&sync.for_device, at, 4 * words, Access::Read)?;
            synchronise(&sync.for_cpu, at, 4 * words, Access::Write)?;
        }
        Ok(SharedMemory::Mapped { mapping: Arc::clone(&self.words), at, words })
    }

    fn to_device(&self, at: usize, _: &DmaMemory, used: usize, access: Access) -> Result<()> {
        match &self.sync {
            Some(sync) if used > 0 => synchronise(&sync.for_device, at, used * BEAT_BYTES, access),
            _ => Ok(()),
        }
    }

    fn to_cpu(&self, at: usize, _: &mut DmaMemory, used: usize, access: Access) -> Result<()> {
        match &self.sync {
            Some(sync) if used > 0 => synchronise(&sync.for_cpu, at, used * BEAT_BYTES, access),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use pgs_interface::record::Beat;

    use super::*;
    use crate::platform::DmaMemorySource as _;
    use crate::platform::memory::pool::Pool;
    use crate::platform::uio_fake::{empty_system, write};

    /// A system with the buffer `pgs` of 64 KiB, in that mode.
    fn system(mode: &str, coherent: &str) -> (tempfile::TempDir, System) {
        let (root, system) = empty_system();
        let file = |name: &str, text: &str| write(system.u_dma_buf.join("pgs").join(name), text);
        file("phys_addr", "0x0000000070000000");
        file("size", "65536");
        file("sync_mode", mode);
        file("dma_coherent", coherent);
        file("sync_for_device", "");
        file("sync_for_cpu", "");
        write(system.dev.join("pgs"), "");
        File::create(system.dev.join("pgs")).and_then(|file| file.set_len(65536)).expect("resized");
        (root, system)
    }

    fn text_of(system: &System, name: &str) -> String {
        fs::read_to_string(system.u_dma_buf.join("pgs").join(name)).expect("read").trim().to_owned()
    }

    #[test]
    fn the_command_is_the_one_of_the_modules_readme() {
        // offset << 32 | size (multiple of 16) | direction << 2 | 1
        assert_eq!(command(0, 0x10000, Access::Read), 0x0000_0000_0001_0005);
        assert_eq!(command(0x2000, 64, Access::Write), 0x0000_2000_0000_0049);
        assert_eq!(command(0x40, 65, Access::Read) & 0xFFFF_FFF0, 128, "whole lines");
    }

    #[test]
    fn a_cached_buffer_is_maintained_by_range_when_it_changes_hands() {
        let (_root, system) = system("1", "0");
        let buffer = UDmaBuf::open(&system, "pgs", Caching::Cached).expect("mapped");
        let pool = Pool::new(Box::new(buffer));
        pool.allocate(256).expect("so that the next does not lie at the start");
        let (address, mut memory) = pool.allocate(100).expect("there is room");
        assert_eq!(address, 0x7000_1000);
        memory.beats_mut()[0] = Beat([1, 2, 3, 4]);
        pool.hand_over(address, memory, 9, Access::Read).expect("with the CPU");
        // Nine beats are 144 bytes: three lines.
        assert_eq!(text_of(&system, "sync_for_device"), "0x00001000000000c5");
        let device = fs::read(system.dev.join("pgs")).expect("read");
        assert_eq!(device[0x1000..0x1010], [1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 4, 0, 0, 0]);

        let memory = pool.take_back(address).expect("with the device");
        pool.hand_over(address, memory, 100, Access::Write).expect("with the CPU");
        assert_eq!(text_of(&system, "sync_for_device"), "0x0000100000000649");
        let memory = pool.take_back(address).expect("with the device");
        assert_eq!(text_of(&system, "sync_for_cpu"), "0x0000100000000649");
        assert_eq!(memory.beats().len(), 100);
    }

    #[test]
    fn shared_words_begin_without_a_line_of_theirs_in_a_cache() {
        let (_root, system) = system("2", "0");
        let buffer = UDmaBuf::open(&system, "pgs", Caching::Cached).expect("mapped");
        let (_, words) = Pool::new(Box::new(buffer)).allocate_shared(32).expect("there is room");
        assert_eq!(text_of(&system, "sync_for_device"), "0x0000000000000085");
        assert_eq!(text_of(&system, "sync_for_cpu"), "0x0000000000000089");
        words.store(31, 0x0403_0201);
        assert_eq!(fs::read(system.dev.join("pgs")).expect("read")[124..128], [1, 2, 3, 4]);
    }

    #[test]
    fn write_combining_and_coherent_buffers_need_no_maintenance() {
        for (mode, coherent, caching) in [
            ("2", "0", Caching::WriteCombining),
            ("3", "0", Caching::WriteCombining),
            ("6", "0", Caching::WriteCombining),
            ("0", "1", Caching::Cached),
            ("4", "1", Caching::Cached),
        ] {
            let (_root, system) = system(mode, coherent);
            let buffer = UDmaBuf::open(&system, "pgs", caching).expect("mapped");
            let pool = Pool::new(Box::new(buffer));
            let (address, memory) = pool.allocate(4).expect("there is room");
            pool.hand_over(address, memory, 4, Access::Write).expect("with the CPU");
            pool.take_back(address).expect("with the device");
            pool.allocate_shared(4).expect("there is room");
            assert_eq!(text_of(&system, "sync_for_device"), "", "{mode}");
            assert_eq!(text_of(&system, "sync_mode"), mode);
        }
    }

    #[test]
    fn a_buffer_has_one_user_and_is_left_alone_while_it_has() {
        let (_root, system) = system("2", "0");
        let open = || UDmaBuf::open(&system, "pgs", Caching::Cached);
        let buffer = open().expect("mapped");
        // A second user must not change what the first relies on.
        write(system.u_dma_buf.join("pgs/sync_mode"), "0");
        let error = open().expect_err("in use");
        assert!(matches!(&error, PlatformError::Busy { path } if path.ends_with("pgs")), "{error}");
        assert_eq!(text_of(&system, "sync_mode"), "0");
        // A piece of it keeps it, too.
        let piece = buffer.memory(0, 4).expect("inside");
        drop(buffer);
        open().expect_err("a piece is left");
        drop(piece);
        open().expect("nobody has it");
    }

    #[test]
    fn what_cannot_be_used_says_why() {
        let (_root, system) = system("1", "0");
        let open = |name: &str| UDmaBuf::open(&system, name, Caching::Cached).map(drop);
        let error = open("pgs0").expect_err("no such buffer").to_string();
        assert!(error.contains("\"pgs0\" (found: pgs)"), "{error}");
        let attribute = |name: &str, text: &str| {
            write(system.u_dma_buf.join("pgs").join(name), text);
            open("pgs").expect_err(text).to_string()
        };
        let error = attribute("size", "4294967296");
        assert!(error.contains("less than 4 GiB"), "{error}");
        let error = attribute("size", "many");
        assert!(error.contains("\"many\""), "{error}");
        attribute("size", "0");
        let error = attribute("phys_addr", "0x70000020");
        assert!(error.contains("cache line"), "{error}");
        fs::remove_file(system.u_dma_buf.join("pgs/sync_for_cpu")).expect("removed");
        write(system.u_dma_buf.join("pgs/phys_addr"), "0x70000000");
        let error = attribute("size", "65536");
        assert!(error.contains("sync_for_cpu"), "{error}");
        let error = try_u_dma_buf(&system, "pgs").expect_err("not cached");
        assert!(matches!(error, PlatformError::NoMaintenance { .. }), "{error}");
        UDmaBuf::open(&system, "pgs", Caching::WriteCombining).expect("needs no maintenance");
        write(system.u_dma_buf.join("pgs/dma_coherent"), "1");
        try_u_dma_buf(&system, "pgs").expect("needs none either");
        fs::remove_file(system.dev.join("pgs")).expect("removed");
        let error = try_u_dma_buf(&system, "pgs").expect_err("no file");
        assert!(matches!(error, PlatformError::NoDevice { .. }), "{error}");
    }

    #[test]
    fn a_buffer_of_the_module_before_its_new_name_is_the_same() {
        let (_root, system) = system("2", "0");
        fs::rename(&system.u_dma_buf, &system.udmabuf).expect("renamed");
        assert_eq!(u_dma_buf_names(&system), ["pgs"]);
        assert!(UDmaBuf::exists(&system, "pgs"));
        try_u_dma_buf(&system, "pgs").expect("usable");
        let buffer = UDmaBuf::open(&system, "pgs", Caching::Cached).expect("mapped");
        let pool = Pool::new(Box::new(buffer));
        pool.allocate_shared(32).expect("there is room");
        let command = fs::read_to_string(system.udmabuf.join("pgs/sync_for_cpu")).expect("read");
        assert_eq!(command.trim(), "0x0000000000000089");
    }
}
