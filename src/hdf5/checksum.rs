//! The checksum of HDF5's metadata: lookup3 of Bob Jenkins, with 0 as the initial value.

/// The checksum of some bytes.
pub(super) fn lookup3(bytes: &[u8]) -> u32 {
    let start = 0xdead_beef_u32.wrapping_add(bytes.len() as u32);
    let mut state = [start; 3];
    // The last block is mixed in another way, also if it is whole.
    let last = bytes.len().saturating_sub(1) / BLOCK * BLOCK;
    let (blocks, rest) = bytes.split_at(last);
    for block in blocks.chunks_exact(BLOCK) {
        add(&mut state, block);
        mix(&mut state);
    }
    if !rest.is_empty() {
        let mut block = [0; BLOCK];
        block[..rest.len()].copy_from_slice(rest);
        add(&mut state, &block);
        last_mix(&mut state);
    }
    state[2]
}

/// Bytes that are taken in at once.
const BLOCK: usize = 12;

fn add(state: &mut [u32; 3], block: &[u8]) {
    for (word, bytes) in state.iter_mut().zip(block.chunks_exact(4)) {
        let value = bytes.iter().rev().fold(0, |value, &b| value << 8 | u32::from(b));
        *word = word.wrapping_add(value);
    }
}

fn mix([a, b, c]: &mut [u32; 3]) {
    fn step(a: &mut u32, b: &mut u32, c: &mut u32, bits: u32) {
        *a = a.wrapping_sub(*c) ^ c.rotate_left(bits);
        *c = c.wrapping_add(*b);
    }
    step(a, b, c, 4);
    step(b, c, a, 6);
    step(c, a, b, 8);
    step(a, b, c, 16);
    step(b, c, a, 19);
    step(c, a, b, 4);
}

fn last_mix([a, b, c]: &mut [u32; 3]) {
    fn step(a: &mut u32, b: u32, bits: u32) {
        *a = (*a ^ b).wrapping_sub(b.rotate_left(bits));
    }
    step(c, *b, 14);
    step(a, *c, 11);
    step(b, *a, 25);
    step(c, *b, 16);
    step(a, *c, 4);
    step(b, *a, 14);
    step(c, *b, 24);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of the text that the algorithm's source gives as an example, and of nothing.
    #[test]
    fn known_checksums() {
        assert_eq!(lookup3(b""), 0xdead_beef);
        assert_eq!(lookup3(b"Four score and seven years ago"), 0x1777_0551);
    }
}
