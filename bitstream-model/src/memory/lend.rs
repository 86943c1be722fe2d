//! Borrows beats of several buffers at once, to read and to write.

use super::{Content, DeviceAccess, Memory, Source, granted_range};
use crate::cast::index;
use pgs_interface::record::{BEAT_BYTES, Beat};

/// Borrowed beats of several buffers: for reads, and for writes.
pub(crate) type Lent<'a, const N: usize> = ([&'a [Beat]; N], [&'a mut [Beat]; N]);

impl Memory {
    /// Borrows beats for the device, each with its place and number: `reads` to read, `writes` to
    /// write. `None` if the device may not do one of these accesses, if two writes overlap, or if
    /// the memory is external, or the fence matters. The addresses are multiples of a beat.
    pub(crate) fn lend<const N: usize>(
        &mut self,
        reads: [(Source, usize); N],
        writes: [(u64, usize); N],
    ) -> Option<Lent<'_, N>> {
        if self.external.is_some() || self.guard_is_used {
            return None;
        }
        let mut views: [&[Beat]; N] = [&[]; N];
        let mut places: [&mut [Beat]; N] = std::array::from_fn(|_| Default::default());
        let mut in_order: [usize; N] = std::array::from_fn(|k| k);
        in_order.sort_unstable_by_key(|k| writes[*k].0);
        for (start, region) in &mut self.regions {
            let (start, end) = (*start, *start + region.bytes);
            let within = |address: u64| (start..end).contains(&address);
            match &mut region.content {
                Content::Device(beats, DeviceAccess::Read, granted) => {
                    for (view, (from, count)) in views.iter_mut().zip(reads) {
                        if count > 0 && within(from.address) && from.grant == region.grant {
                            *view = &beats
                                [granted_range(beats, *granted, from.address - start, count)?];
                        }
                    }
                }
                Content::Device(beats, DeviceAccess::Write, granted) => {
                    let granted = beats.len().min(*granted);
                    let (mut rest, mut at) = (&mut beats[..granted], start);
                    for k in in_order {
                        let (address, count) = writes[k];
                        if count > 0 && within(address) {
                            let skipped = index(address.checked_sub(at)? / BEAT_BYTES as u64);
                            let behind = rest.split_at_mut_checked(skipped)?.1;
                            (places[k], rest) = behind.split_at_mut_checked(count)?;
                            at = address + (count * BEAT_BYTES) as u64;
                        }
                    }
                }
                Content::Cpu | Content::Words(_) => {}
            }
        }
        let lent = (0..N).all(|k| views[k].len() == reads[k].1 && places[k].len() == writes[k].1);
        lent.then_some((views, places))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::quirks::Coherency;

    /// A buffer of 8 beats, numbered from `first` on, with `granted` beats for the device.
    fn buffer(memory: &mut Memory, first: u32, access: DeviceAccess, granted: usize) -> u64 {
        let (address, _) = memory.allocate(8).expect("fits");
        let beats: Vec<Beat> = (first..first + 8).map(|number| Beat([number; 4])).collect();
        memory.hand_over(address, beats.into(), granted, access).expect("the CPU owns it");
        address
    }

    #[test]
    fn several_buffers_are_lent_at_once_and_parts_of_one() {
        let mut memory = Memory::new(40, Coherency::Coherent);
        let read = buffer(&mut memory, 0, DeviceAccess::Read, 8);
        let one = buffer(&mut memory, 100, DeviceAccess::Write, 8);
        let other = buffer(&mut memory, 200, DeviceAccess::Write, 8);
        let source = memory.source(read, 8).expect("granted").expect("inside");
        let numbers = |beats: &[Beat]| beats.iter().map(|beat| beat.0[0]).collect::<Vec<_>>();
        let reads = [(source.further(1), 2), (source, 3), (source.further(8), 0)];
        let writes = [(one + 16 * 5, 3), (other, 1), (one + 16, 2)];
        let (views, places) = memory.lend(reads, writes).expect("all is granted");
        assert_eq!(views.map(numbers), [vec![1, 2], vec![0, 1, 2], vec![]]);
        assert_eq!(
            places.map(|beats| numbers(beats)),
            [vec![105, 106, 107], vec![200], vec![101, 102]]
        );
    }

    #[test]
    fn beats_that_the_device_may_not_access_are_not_lent() {
        let mut memory = Memory::new(40, Coherency::Coherent);
        let read = buffer(&mut memory, 0, DeviceAccess::Read, 8);
        let write = buffer(&mut memory, 100, DeviceAccess::Write, 6);
        let source = memory.source(read, 8).expect("granted").expect("inside");
        let none = (0, 0);
        let mut lends = |from, writes| memory.lend([from, (source, 0)], writes).is_some();
        assert!(lends((source, 8), [(write, 6), none]));
        assert!(!lends((source.further(1), 8), [(write, 6), none]), "past the end");
        assert!(!lends((source, 8), [(write, 7), none]), "past the granted beats");
        assert!(!lends((source, 8), [(write, 2), (write + 16, 2)]), "twice");
        assert!(!lends((source, 8), [(read, 1), none]), "to be read only");
        assert!(!lends((source, 8), [(write + 16 * 8, 1), none]), "in no buffer");
        memory.take_back(read).expect("it is there");
        memory
            .hand_over(read, vec![Beat::default(); 8].into(), 8, DeviceAccess::Read)
            .expect("granted");
        let old = memory.lend([(source, 8), (source, 0)], [(write, 6), none]);
        assert!(old.is_none(), "of an earlier hand-over");
    }
}
