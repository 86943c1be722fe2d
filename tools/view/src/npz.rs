//! Writes a recording as `.npz`: arrays that `numpy.load` reads by name.
//!
//! | array | type and shape | content |
//! |---|---|---|
//! | `positions` | f32 (frames, bodies, 3) | centres of mass, m |
//! | `rotations` | f32 (frames, bodies, 4) | quaternions x, y, z, w |
//! | `times` | f32 (frames) | simulated time, s |
//! | `steps` | u32 (frames) | steps taken before, 0 at the start |
//! | `kinds` | u32 (bodies) | row of the next three arrays |
//! | `geometries` | u32 (kinds) | 0 box, 1 sphere, 2 capsule, 3 cylinder, 4 convex hull |
//! | `half_extents` | f32 (kinds, 3) | half the size along x, y and z, m; a round axis is y |
//! | `hull_kinds` | u32 (corners) | kind of each corner of the hulls |
//! | `hull_points` | f32 (corners, 3) | corners of the hulls, m |
//!
//! The ground, body 0, has no row: it is the plane y = 0.
//!
//! The archive stores its files without compression, as `numpy.savez` does. Source: APPNOTE.TXT of
//! PKWARE 6.3.10, sections 4.3.7, 4.3.12 and 4.3.16.

use std::io;

use scene::Geometry;
use step_folder::npy::{self, Element};

use crate::error::TooLarge;
use crate::recording::Recording;

/// Version 2.0 of the format, which stored files need.
const VERSION: u16 = 20;
/// 1 January 1980, the first date of the format: files of equal content are equal.
const DATE: u16 = 1 << 5 | 1;

/// The file of a recording.
///
/// # Errors
/// [`TooLarge`]: an array or the archive has 4 GiB or more.
pub fn bytes(recording: &Recording) -> Result<Vec<u8>, TooLarge> {
    let (frames, bodies) = (recording.frames(), recording.bodies());
    let count = frames.len();
    let poses = || frames.iter().flat_map(|frame| &frame.poses);
    let geometries = recording.geometries();
    let kinds = geometries.len();
    let hulls: Vec<(usize, [f32; 3])> = geometries
        .iter()
        .enumerate()
        .flat_map(|(kind, geometry)| {
            let points: &[[f32; 3]] = match geometry {
                Geometry::Hull { points } => points,
                _ => &[],
            };
            points.iter().map(move |point| (kind, *point))
        })
        .collect();

    let mut archive = Archive::default();
    archive.array("positions", &[count, bodies, 3], poses().flat_map(|pose| pose.position))?;
    archive.array("rotations", &[count, bodies, 4], poses().flat_map(|pose| pose.orientation))?;
    archive.array("times", &[count], frames.iter().map(|frame| frame.time))?;
    archive.array("steps", &[count], frames.iter().map(|frame| frame.step))?;
    archive.array("kinds", &[bodies], recording.kinds().iter().map(|kind| number(*kind)))?;
    archive.array("geometries", &[kinds], geometries.iter().map(code))?;
    archive.array("half_extents", &[kinds, 3], geometries.iter().flat_map(half_extents))?;
    archive.array("hull_kinds", &[hulls.len()], hulls.iter().map(|(kind, _)| number(*kind)))?;
    archive.array("hull_points", &[hulls.len(), 3], hulls.iter().flat_map(|(_, point)| *point))?;
    archive.finish()
}

/// An index as an element; a table of shapes is far shorter.
fn number(index: usize) -> u32 {
    u32::try_from(index).unwrap_or(u32::MAX)
}

/// The number that stands for a geometry.
fn code(geometry: &Geometry) -> u32 {
    match geometry {
        Geometry::Box { .. } => 0,
        Geometry::Sphere { .. } => 1,
        Geometry::Capsule { .. } => 2,
        Geometry::Cylinder { .. } => 3,
        Geometry::Hull { .. } => 4,
    }
}

/// Half the size of a geometry along its axes, m.
fn half_extents(geometry: &Geometry) -> [f32; 3] {
    match *geometry {
        Geometry::Box { half_extents } => half_extents,
        Geometry::Sphere { radius } => [radius; 3],
        Geometry::Capsule { half_height, radius } => [radius, half_height + radius, radius],
        Geometry::Cylinder { half_height, radius } => [radius, half_height, radius],
        Geometry::Hull { points } => {
            let largest = |axis: usize| {
                let sizes = points.iter().map(|point| point[axis].abs());
                sizes.fold(0.0, |most, size| if size > most { size } else { most })
            };
            [largest(0), largest(1), largest(2)]
        }
    }
}

/// A zip archive under construction.
#[derive(Debug, Default)]
struct Archive {
    bytes: Vec<u8>,
    /// The central directory.
    directory: Vec<u8>,
    files: u16,
}

impl Archive {
    /// Adds an array.
    fn array<T: Element>(
        &mut self,
        name: &'static str,
        shape: &[usize],
        elements: impl Iterator<Item = T>,
    ) -> Result<(), TooLarge> {
        let values = shape.iter().map(|length| *length as u64).product::<u64>();
        TooLarge::check(name, 4 * values)?;
        let mut array = Vec::new();
        let written = npy::encode(&mut array, shape, elements);
        written.or_else(|_: io::Error| TooLarge::check(name, u64::MAX).map(|_| ()))?;
        self.file(name, &format!("{name}.npy"), &array)
    }

    /// Adds a file, stored.
    fn file(&mut self, what: &'static str, name: &str, content: &[u8]) -> Result<(), TooLarge> {
        let size = TooLarge::check(what, content.len() as u64)?;
        let offset = TooLarge::check("the archive", self.bytes.len() as u64)?;
        let name_length = u16::try_from(name.len()).unwrap_or(u16::MAX);
        let mut entry = Vec::new();
        // Version, flags, method "stored", time and date.
        [VERSION, 0, 0, 0, DATE].iter().for_each(|field| entry.extend(field.to_le_bytes()));
        let sum = crc32fast::hash(content);
        [sum, size, size].iter().for_each(|field| entry.extend(field.to_le_bytes()));
        // The lengths of the name and of the extra field.
        [name_length, 0].iter().for_each(|field| entry.extend(field.to_le_bytes()));

        self.bytes.extend(b"PK\x03\x04");
        self.bytes.extend(&entry);
        self.bytes.extend(name.as_bytes());
        self.bytes.extend(content);

        self.directory.extend(b"PK\x01\x02");
        self.directory.extend(VERSION.to_le_bytes());
        self.directory.extend(&entry);
        // The length of the comment, the disk, and both kinds of attributes.
        self.directory.extend([0; 10]);
        self.directory.extend(offset.to_le_bytes());
        self.directory.extend(name.as_bytes());
        self.files += 1;
        Ok(())
    }

    /// The archive with its directory.
    fn finish(self) -> Result<Vec<u8>, TooLarge> {
        let Self { mut bytes, directory, files } = self;
        let begin = TooLarge::check("the archive", bytes.len() as u64)?;
        let length = TooLarge::check("the archive's directory", directory.len() as u64)?;
        bytes.extend(&directory);
        bytes.extend(b"PK\x05\x06");
        // This disk, the directory's, and the entries on this one and in all.
        [0, 0, files, files].iter().for_each(|field| bytes.extend(field.to_le_bytes()));
        [length, begin].iter().for_each(|field| bytes.extend(field.to_le_bytes()));
        // The length of the comment.
        bytes.extend([0; 2]);
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::fixture;

    fn field(bytes: &[u8], at: usize, length: usize) -> usize {
        bytes[at..at + length].iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte))
    }

    /// The files of an archive by its directory: name and content, the sums compared.
    fn files(archive: &[u8]) -> Vec<(String, Vec<u8>)> {
        let end = archive.len() - 22;
        assert_eq!(&archive[end..end + 4], b"PK\x05\x06");
        let mut at = field(archive, end + 16, 4);
        assert_eq!(
            at + field(archive, end + 12, 4),
            end,
            "the directory ends where the end begins"
        );
        let mut files = Vec::new();
        while at < end {
            assert_eq!(&archive[at..at + 4], b"PK\x01\x02");
            let [sum, size] = [16, 24].map(|offset| field(archive, at + offset, 4));
            let (name, local) = (field(archive, at + 28, 2), field(archive, at + 42, 4));
            let text = String::from_utf8(archive[at + 46..at + 46 + name].to_vec()).expect("text");
            assert_eq!(&archive[local..local + 4], b"PK\x03\x04");
            // Both headers have the same 26 bytes from the version on.
            assert_eq!(archive[local + 4..local + 30], archive[at + 6..at + 32]);
            let begin = local + 30 + name;
            let content = archive[begin..begin + size].to_vec();
            assert_eq!(crc32fast::hash(&content) as usize, sum, "{text}");
            files.push((text, content));
            at += 46 + name;
        }
        assert_eq!(files.len(), field(archive, end + 10, 2));
        files
    }

    #[test]
    fn every_array_is_there_with_its_shape_and_values() {
        let recording = fixture(4);
        let files = files(&bytes(&recording).expect("small"));
        let array = |name: &str| {
            let name = format!("{name}.npy");
            let (_, content) = files.iter().find(|(found, _)| *found == name).expect("the array");
            let header = String::from_utf8_lossy(&content[10..128]).into_owned();
            let values: Vec<u32> = content[128..]
                .chunks(4)
                .map(|value| u32::try_from(field(value, 0, 4)).expect("32 bits"))
                .collect();
            (header, values)
        };
        let (header, positions) = array("positions");
        assert!(header.contains("'<f4'") && header.contains("(4, 18, 3)"), "{header}");
        let pose = recording.frames()[3].poses[17];
        assert_eq!(positions[positions.len() - 3..], pose.position.map(f32::to_bits));
        let (header, rotations) = array("rotations");
        assert!(header.contains("(4, 18, 4)"), "{header}");
        assert_eq!(rotations[rotations.len() - 4..], pose.orientation.map(f32::to_bits));
        assert_eq!(array("steps").1, [0, 1, 2, 3]);
        assert_eq!(array("times").1.len(), 4);
        let kinds = array("kinds").1;
        assert_eq!(kinds.len(), 18);
        let (_, codes) = array("geometries");
        for (kind, geometry) in kinds.iter().zip(recording.kinds()) {
            assert_eq!(*kind as usize, *geometry);
        }
        let corners = recording.geometries().iter().filter(|g| g.name() == "hull").count() * 12;
        assert_eq!(array("hull_points").1.len(), 3 * corners);
        assert_eq!(array("hull_kinds").1.len(), corners);
        assert_eq!(array("half_extents").1.len(), 3 * codes.len());
    }

    #[test]
    fn half_a_size_includes_the_caps() {
        let capsule = Geometry::Capsule { half_height: 0.5, radius: 0.25 };
        assert_eq!(half_extents(&capsule).map(f32::to_bits), [0.25, 0.75, 0.25].map(f32::to_bits));
        let hull = Geometry::Hull { points: &[[1.0, -2.0, 0.5], [-1.5, 0.0, 0.0]] };
        assert_eq!(half_extents(&hull).map(f32::to_bits), [1.5, 2.0, 0.5].map(f32::to_bits));
    }
}
