//! Maps a region of a UIO node, and accesses the registers in it.
//!
//! Source: Linux `Documentation/driver-api/uio-howto.rst`, `drivers/uio/uio_pdrv_genirq.c`.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::device_tree::region_lengths;
use super::lock::LockedFile;
use super::mapped::Mapping;
use super::system::page_bytes;
use crate::platform::{PlatformError, RegisterWindow, Result, UioMap, UioNode};

/// A mapped region of registers.
///
/// Each access is one aligned 32-bit load or store, in program order with the others of the region.
/// A region has one window at a time, and a store needs `&mut self`: no two threads meet at a
/// register. The caller answers for the effect of a store on the device: an engine that gets the
/// address of foreign memory writes there.
#[derive(Debug)]
pub struct UioWindow {
    mapping: Mapping,
    name: String,
    address: u64,
    /// Released after the region is unmapped.
    _claim: Claim,
}

impl UioWindow {
    /// Maps a region of a node whose device file is locked.
    pub(crate) fn new(
        lock: &Arc<LockedFile>,
        node: &UioNode,
        map: &UioMap,
        tree: &Path,
        claims: &Claims,
    ) -> Result<Self> {
        let Some(claim) = claims.claim(map.index) else {
            let (node, map) = (node.name.clone(), map.name.clone());
            return Err(PlatformError::MappedAlready { node, map });
        };
        let name = format!("{:?} of {}", map.name, node.device);
        let page = page_bytes(lock.path())?;
        let bytes = length(map, &name, tree, page)?;
        let large = |_| PlatformError::TooLarge { region: name.clone(), bytes };
        let mapping = Mapping::new(
            lock,
            u64::from(map.index) * page,
            usize::try_from(map.offset).map_err(large)?,
            usize::try_from(bytes).map_err(large)?,
        )?;
        let address = map.address.checked_add(map.offset);
        let address = address.ok_or(PlatformError::TooLarge { region: name.clone(), bytes })?;
        Ok(Self { mapping, name, address, _claim: claim })
    }

    /// Physical address of the region.
    #[must_use]
    pub fn address(&self) -> u64 {
        self.address
    }

    /// Length of the region, bytes, by the device tree; for a device without a node in the device
    /// tree, by the kernel.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.mapping.bytes() as u64
    }

    /// Reads the register at byte `at`.
    ///
    /// # Errors
    /// [`PlatformError::OutOfRegion`] if `at` is not a multiple of 4 inside the region.
    pub fn read32(&self, at: u32) -> Result<u32, PlatformError> {
        Ok(self.mapping.load_word(self.checked(at)?))
    }

    /// Writes the register at byte `at`.
    ///
    /// Earlier stores to memory are visible to the device before the register changes.
    ///
    /// # Errors
    /// [`PlatformError::OutOfRegion`] if `at` is not a multiple of 4 inside the region.
    pub fn write32(&mut self, at: u32, value: u32) -> Result<(), PlatformError> {
        let at = self.checked(at)?;
        crate::platform::release_to_device();
        self.mapping.store_word(at, value);
        Ok(())
    }

    fn checked(&self, at: u32) -> Result<usize> {
        if at.is_multiple_of(4) && u64::from(at) + 4 <= self.bytes() {
            return Ok(at as usize);
        }
        Err(PlatformError::OutOfRegion {
            region: self.name.clone(),
            at: u64::from(at),
            bytes: 4,
            region_bytes: self.bytes(),
        })
    }

    /// The mapping, for callers with their own checks.
    pub(crate) fn into_mapping(self) -> Mapping {
        self.mapping
    }
}

/// A window of the open accelerator, which is its only user.
#[derive(Debug)]
struct Owned(UioWindow);

impl RegisterWindow for Owned {
    fn bytes(&self) -> u64 {
        RegisterWindow::bytes(&self.0.mapping)
    }

    fn read32(&self, at: u32) -> u32 {
        RegisterWindow::read32(&self.0.mapping, at)
    }

    fn write32(&self, at: u32, value: u32) {
        RegisterWindow::write32(&self.0.mapping, at, value);
    }
}

impl From<UioWindow> for Box<dyn RegisterWindow> {
    fn from(window: UioWindow) -> Self {
        Box::new(Owned(window))
    }
}

/// Length of a region: exact by the device tree, else by the kernel, which counts whole pages from
/// the start of the first page.
fn length(map: &UioMap, name: &str, tree: &Path, page: u64) -> Result<u64> {
    let kernel = map.bytes.saturating_sub(map.offset);
    let bytes = match region_lengths(tree)? {
        None => kernel,
        Some(lengths) => {
            let found = usize::try_from(map.index).ok().and_then(|at| lengths.get(at)).copied();
            let fits = |bytes: &u64| kernel.checked_sub(*bytes).is_some_and(|rest| rest < page);
            found.filter(fits).ok_or_else(|| PlatformError::RegionLength {
                region: name.to_owned(),
                kernel,
                found,
            })?
        }
    };
    if bytes < 4 {
        let region = name.to_owned();
        return Err(PlatformError::ShortRegion { region, expected: 4, found: bytes });
    }
    Ok(bytes)
}

/// The numbers of the maps of an open node that are mapped.
#[derive(Debug, Clone, Default)]
pub(crate) struct Claims(Arc<Mutex<BTreeSet<u32>>>);

impl Claims {
    fn numbers(&self) -> MutexGuard<'_, BTreeSet<u32>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The right to map that number; `None` if it is taken.
    fn claim(&self, number: u32) -> Option<Claim> {
        self.numbers().insert(number).then(|| Claim { claims: self.clone(), number })
    }
}

/// The right to one map, until this is dropped.
#[derive(Debug)]
struct Claim {
    claims: Claims,
    number: u32,
}

impl Drop for Claim {
    fn drop(&mut self) {
        self.claims.numbers().remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::platform::UioDevice;
    use crate::platform::uio_fake::{accelerator, add_reg};

    #[test]
    fn a_window_is_the_map_at_its_number_of_pages() {
        let (_root, system) = accelerator();
        let page = usize::try_from(page_bytes(&system.dev).expect("a size")).expect("fits");
        let path = system.dev.join("uio3");
        let mut file = fs::read(&path).expect("read");
        file[4 * page..4 * page + 4].copy_from_slice(&[0x31, 0x53, 0x47, 0x50]);
        fs::write(&path, &file).expect("written");
        let device = UioDevice::open_in(&system, "pgs").expect("opened");
        let mut control = device.window("control").expect("mapped");
        assert_eq!((control.address(), control.bytes()), (0xA004_0000, 0x1000));
        assert_eq!(control.read32(0).expect("inside"), 0x5047_5331);
        control.write32(0xFFC, 0x0403_0201).expect("inside");
        let after = fs::read(&path).expect("read");
        assert_eq!(after[4 * page + 0xFFC..4 * page + 0x1000], [1, 2, 3, 4]);
        for at in [2, 0x1000, 0xFFE, u32::MAX - 3] {
            control.read32(at).expect_err("outside, or not aligned");
            let error = control.write32(at, 0).expect_err("outside, or not aligned").to_string();
            assert!(error.contains("\"control\" of uio3"), "{error}");
        }
    }

    #[test]
    fn a_region_has_one_window_at_a_time() {
        let (_root, system) = accelerator();
        let device = UioDevice::open_in(&system, "pgs").expect("opened");
        let control = device.window("control").expect("mapped");
        device.window("dma0").expect("another region");
        let error = device.window("control").expect_err("a second window");
        assert!(
            matches!(&error, PlatformError::MappedAlready { map, .. } if map == "control"),
            "{error}"
        );
        drop(control);
        let control = device.window("control").expect("the first is gone");
        // A window outlives its device, and keeps the node.
        drop(device);
        let error = UioDevice::open_in(&system, "pgs").expect_err("there is a window");
        assert!(matches!(error, PlatformError::Busy { .. }), "{error}");
        drop(control);
        UioDevice::open_in(&system, "pgs").expect("nobody has it");
    }

    #[test]
    fn a_region_ends_where_the_device_tree_says_and_not_with_its_page() {
        let (_root, system) = accelerator();
        let page = page_bytes(&system.dev).expect("a size");
        let window = |map: &str, regions: &[(u64, u64)]| {
            add_reg(&system, 3, regions);
            let map = UioDevice::open_in(&system, "pgs").expect("opened").window(map)?;
            Ok((map.address(), map.bytes()))
        };
        // The kernel's lengths: four times 0x1_0000, and 0x1000.
        let mut regions = [(0xA000_0000, 0x1_0000); 5];
        regions[4] = (0xA004_0000, 0xFF0);
        let control = window("control", &regions).expect("less than a page less");
        assert_eq!(control, (0xA004_0000, 0xFF0));
        regions[1].1 = 0x1_0000 - page + 4;
        assert_eq!(window("dma1", &regions).expect("the same").1, 0x1_0000 - page + 4);

        regions[2].1 = 0x1_0000 - page;
        regions[3].1 = 0x1_0004;
        for map in ["dma2", "dma3"] {
            let error = window(map, &regions).expect_err("not the pages of this region");
            assert!(matches!(error, PlatformError::RegionLength { found: Some(_), .. }), "{error}");
        }
        let error = window("control", &regions[..4]).expect_err("not in the tree");
        assert!(error.to_string().contains("`reg` in the device tree nothing"), "{error}");
        regions[4].1 = 2;
        let error = window("control", &regions).expect_err("less than a register");
        assert!(matches!(error, PlatformError::ShortRegion { found: 2, .. }), "{error}");
    }

    #[test]
    fn a_region_that_begins_inside_its_page_ends_with_the_pages() {
        let (_root, system) = accelerator();
        let map = system.uio.join("uio3/maps/map0");
        fs::write(map.join("offset"), "0x40\n").expect("written");
        let device = UioDevice::open_in(&system, "pgs").expect("opened");
        let mut window = device.window("dma0").expect("mapped");
        assert_eq!((window.address(), window.bytes()), (0xA000_0040, 0xFFC0));
        window.write32(0, 7).expect("inside");
        assert_eq!(fs::read(system.dev.join("uio3")).expect("read")[0x40], 7);
        drop((window, device));
        fs::write(map.join("size"), "0x40\n").expect("written");
        let empty = UioDevice::open_in(&system, "pgs").expect("opened").window("dma0");
        assert!(matches!(empty, Err(PlatformError::ShortRegion { .. })));
    }
}
