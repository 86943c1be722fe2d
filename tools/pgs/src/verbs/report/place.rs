//! The order of the thesis, by which the report sorts its rows and figures.

/// A key that sorts places of the thesis such as "§4.6.3, Figure 4.10": the numbers of the first section
/// or chapter.
pub(super) fn section_key(thesis: &str) -> Vec<u32> {
    let from = thesis.trim_start_matches(|letter: char| !letter.is_ascii_digit());
    let end = from.find(|letter: char| !letter.is_ascii_digit() && letter != '.');
    from[..end.unwrap_or(from.len())].split('.').map_while(|number| number.parse().ok()).collect()
}

/// Figures of the thesis that have no counterpart here, and why.
pub(super) const WITHOUT_COUNTERPART: [(&str, &str); 6] = [
    ("Figure 2.1", "the loop of a simulation: a diagram without numbers"),
    ("Figure 2.3", "the bounding box of a sphere: a drawing without numbers"),
    ("Figure 2.4", "two bounding boxes apart: a drawing without numbers"),
    ("Figure 2.5", "two bounding boxes that overlap: a drawing without numbers"),
    ("Figure 2.7", "the pipeline of Bullet, another program: a diagram without numbers"),
    ("Figure 5.3", "the blocks of the first design: a diagram; Figure 5.1 has the stages of naive"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_sort_by_section_and_not_by_letters() {
        let sorted = [
            "§2.2.3",
            "§4.4",
            "§4.4.1, Table 4.1",
            "§4.6.2, Figure 4.5",
            "§4.6.10",
            "Chapter 5",
            "§5.1.1, Figure 5.1",
            "§5.4.3, §5.4.4",
            "§10.1",
        ];
        let places: Vec<_> = sorted.iter().map(|thesis| section_key(thesis)).collect();
        assert!(places.is_sorted(), "{places:?}");
        assert_eq!(places[2], [4, 4, 1]);
    }
}
