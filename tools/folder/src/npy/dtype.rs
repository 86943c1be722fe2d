//! Advises how to convert an array whose elements have another type.

/// The type of Python objects, which a file stores pickled.
pub(super) const OBJECT: &str = "|O";

/// The expression that converts an array of type `found`, as a header names it.
pub(super) fn advice(found: &str, expected: &str) -> String {
    let convert = format!("save a.astype({expected:?})");
    if found.starts_with('[') {
        return format!(
            "these are records of named fields (a structured dtype); with numpy.lib.recfunctions, \
             save structured_to_unstructured(a).astype({expected:?})"
        );
    }
    if found == OBJECT {
        return format!(
            "these are Python objects, which are pickled; give np.array(a, dtype={expected:?}), \
             with rows of one length"
        );
    }
    let mut characters = found.chars();
    let (order, kind) = (characters.next(), characters.next());
    let what = match kind {
        Some('b') => "these are booleans",
        Some('c') => return format!("these are complex numbers; save a.real.astype({expected:?})"),
        Some('m' | 'M') => "these are times",
        Some('S' | 'U') => "this is text",
        Some('V') => return format!("these are bytes of no type; save a.view({expected:?})"),
        _ if order == Some('>') => "these are big-endian",
        _ => return convert,
    };
    format!("{what}; {convert}")
}

#[cfg(test)]
mod tests {
    use super::advice;

    #[test]
    fn each_type_has_advice_of_its_own() {
        for (found, said) in [
            ("<f8", "save a.astype(\"<f4\")"),
            ("<i8", "save a.astype(\"<f4\")"),
            (">f4", "these are big-endian; save a.astype(\"<f4\")"),
            ("|b1", "these are booleans; save a.astype(\"<f4\")"),
            ("<c8", "these are complex numbers; save a.real.astype(\"<f4\")"),
            ("<M8[ns]", "these are times; save a.astype(\"<f4\")"),
            ("<U5", "this is text; save a.astype(\"<f4\")"),
            ("|V12", "these are bytes of no type; save a.view(\"<f4\")"),
            ("", "save a.astype(\"<f4\")"),
        ] {
            assert_eq!(advice(found, "<f4"), said, "{found}");
        }
        assert!(advice("|O", "<u4").contains("pickled; give np.array(a, dtype=\"<u4\")"));
        let structured = advice("[('x', '<f4')]", "<f4");
        assert!(structured.contains("structured dtype"), "{structured}");
    }
}
