//! Colours collisions so that no two collisions of one colour share a moving body, and orders them
//! by colour.
//!
//! Each collision takes the lowest colour that neither body has. A round searches 64 colours; a
//! collision without a free colour waits for a further round.

use zynq_pgs::order::OrderInput;

/// Orders the collisions of an input that was checked by colour; also the number of colours.
pub(crate) fn order(input: &OrderInput<'_>) -> (Vec<u32>, usize) {
    let (mut order, mut colours) = (Vec::with_capacity(input.pairs.len()), 0);
    let mut todo: Vec<u32> = input.taking_part().map(|(index, _)| index).collect();
    let mut later = Vec::new();
    while !todo.is_empty() {
        let mut had = vec![0_u64; input.moving.len()];
        let mut by_colour: [Vec<u32>; 64] = std::array::from_fn(|_| Vec::new());
        for index in &todo {
            let [a, b] = input.pairs[*index as usize].map(|body| body as usize);
            let free = !(had[a] | had[b]);
            if free == 0 {
                later.push(*index);
                continue;
            }
            let colour = free.trailing_zeros();
            for body in [a, b] {
                had[body] |= u64::from(input.moving[body]) << colour;
            }
            by_colour[colour as usize].push(*index);
        }
        for colour in by_colour.iter().filter(|colour| !colour.is_empty()) {
            order.extend(colour);
            colours += 1;
        }
        todo.clear();
        std::mem::swap(&mut todo, &mut later);
    }
    (order, colours)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_has_as_many_colours_as_points() {
        let pairs: Vec<[u32; 2]> = (1..=150).map(|body| [0, body]).collect();
        let moving = [true; 151];
        let input = OrderInput { pairs: &pairs, moving: &moving };
        let (found, colours) = order(&input);
        assert_eq!((found.len(), colours), (150, 150));
        let still = OrderInput { moving: &[[false].as_slice(), &moving[1..]].concat(), ..input };
        assert_eq!(order(&still).1, 1);
    }
}
