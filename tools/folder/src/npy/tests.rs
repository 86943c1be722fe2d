//! Reading `.npy` files, and refusing them.

use super::*;
use proptest::prelude::*;
use zynq_pgs::interface::profile::PROFILES;

fn rows(n: usize) -> Dimensions {
    Dimensions(vec![None, Some(n)])
}

fn encoded(shape: &[usize], elements: &[f32]) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode(&mut bytes, shape, elements.iter().copied()).expect("a vector takes all bytes");
    bytes
}

fn decoded<T: Element>(bytes: &[u8], expected: &Dimensions) -> Result<(usize, Vec<T>), Problem> {
    decode(bytes, bytes.len() as u64, expected)
}

fn bits(numbers: &[f32]) -> Vec<u32> {
    numbers.iter().map(|number| number.to_bits()).collect()
}

fn with_header(header: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend([1, 0]);
    bytes.extend(u16::try_from(header.len()).expect("a short header").to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

#[test]
fn a_file_is_what_numpy_writes() {
    // The layout of the golden vectors' files: header padded with spaces to 128 bytes.
    let mut expected = b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f4', 'fortran_order': False, \
        'shape': (1, 3), }"
        .to_vec();
    expected.resize(127, b' ');
    expected.push(b'\n');
    expected.extend([0, 0, 0x80, 0x3f, 0, 0, 0, 0x80, 0, 0, 0x20, 0x40]);
    assert_eq!(encoded(&[1, 3], &[1.0, -0.0, 2.5]), expected);
}

#[test]
fn a_wrong_shape_says_both_shapes() {
    let problem = decoded::<f32>(&encoded(&[1, 3], &[0.0; 3]), &rows(4)).expect_err("refused");
    assert_eq!(problem.to_string(), "expected shape (*, 4), found (1, 3)");
    let problem = decoded::<f32>(&encoded(&[3], &[0.0; 3]), &rows(4)).expect_err("refused");
    assert_eq!(problem.to_string(), "expected shape (*, 4), found (3,)");
}

fn header(descr: &str, shape: &str) -> String {
    format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}}}")
}

#[test]
fn a_wrong_type_says_both_types() {
    let problem = decoded::<u32>(&encoded(&[1, 3], &[0.0; 3]), &rows(3)).expect_err("refused");
    let said = problem.to_string();
    assert_eq!(said, "expected elements of type <u4, found \"<f4\": save a.astype(\"<u4\")");
    let fields = "[('x', '<f4'), ('y', '<f4'), ('z', '<f4')]";
    let problem = decoded::<f32>(&with_header(&header(fields, "(1,)"), &[0; 12]), &rows(3));
    let said = problem.expect_err("refused").to_string();
    assert!(said.contains("structured_to_unstructured(a)"), "{said}");
}

#[test]
fn a_huge_shape_is_refused_before_memory_is_taken() {
    for shape in ["(1048577, 3)", "(2000000000, 3)", "(18446744073709551615, 3)"] {
        let problem = decoded::<f32>(&with_header(&header("'<f4'", shape), &[0; 12]), &rows(3));
        assert!(matches!(problem, Err(Problem::TooManyRows { .. })), "{problem:?}");
    }
    let most = header("'<f4'", "(1048576, 3)");
    let problem = decoded::<f32>(&with_header(&most, &[0; 12]), &rows(3));
    assert!(matches!(problem, Err(Problem::TooShort { found: 12, .. })), "{problem:?}");
    // A product beyond 128 bits, where the caller expects this length.
    let huge = usize::MAX;
    let expected = Dimensions(vec![None, Some(huge), Some(huge), Some(huge)]);
    let shape = header("'<f4'", &format!("(1, {huge}, {huge}, {huge})"));
    let problem = decoded::<f32>(&with_header(&shape, &[0; 12]), &expected);
    assert!(matches!(problem, Err(Problem::TooShort { found: 12, .. })), "{problem:?}");
}

#[test]
fn no_profile_takes_more_rows_than_are_read() {
    for profile in PROFILES {
        assert!(profile.body_capacity as usize <= ROWS_MAX, "{}", profile.name);
        let variant = profile.default_variant();
        let collisions = profile.memory.bytes / variant.bytes_per_collision();
        assert!(collisions as usize <= ROWS_MAX, "{}", profile.name);
    }
}

#[test]
fn every_truncation_and_every_extra_byte_is_refused() {
    let whole = encoded(&[2, 3], &[1.0; 6]);
    for length in 0..whole.len() {
        let problem = decoded::<f32>(&whole[..length], &rows(3)).expect_err("cut off");
        let said = problem.to_string();
        match length {
            0 => assert!(said.contains("an empty file"), "{said}"),
            1..128 => assert!(said.contains("ends within its header"), "{said}"),
            _ => assert!(said.ends_with("fewer: is the file cut off?"), "{said}"),
        }
    }
    let longer = [whole, b"1 2".to_vec()].concat();
    let problem = decoded::<f32>(&longer, &rows(3)).expect_err("three bytes too many");
    let said = problem.to_string();
    assert!(said.contains("24 bytes of data by its shape (2, 3), found 27, 3 more"), "{said}");
}

#[test]
fn an_array_of_nothing_may_have_any_type_and_no_width() {
    let nothing = |descr: &str, shape: &str, expected: &Dimensions| {
        decoded::<u32>(&with_header(&header(descr, shape), &[]), expected)
    };
    for descr in ["'<u4'", "'<f8'", "'|b1'", "[('a', '<f4')]"] {
        for shape in ["(0,)", "(0, 3)"] {
            let (rows, elements) = nothing(descr, shape, &rows(3)).expect("no rows");
            assert_eq!((rows, elements), (0, vec![]), "{descr} {shape}");
        }
        let none = Dimensions(vec![Some(0), Some(4), Some(4)]);
        assert!(nothing(descr, "(0,)", &none).is_ok());
        let five = Dimensions(vec![Some(5), Some(3)]);
        for (shape, expected) in [("(0,)", &five), ("(0, 2)", &rows(3)), ("(3, 0)", &rows(3))] {
            let problem = nothing(descr, shape, expected).expect_err("another shape");
            assert!(matches!(problem, Problem::Shape { .. }), "{descr} {shape}: {problem}");
        }
    }
    let problem = nothing("'|O'", "(0,)", &rows(3)).expect_err("pickled");
    assert!(matches!(problem, Problem::Type { .. }), "{problem}");
    let more = with_header(&header("'<f8'", "(0,)"), b"a");
    let problem = decoded::<u32>(&more, &rows(3)).expect_err("something follows");
    assert!(matches!(problem, Problem::TooLong { found: 1, .. }), "{problem}");
}

#[test]
fn columns_one_after_the_other_are_refused_unless_there_are_none() {
    let header = |shape| format!("{{'descr': '<f4', 'fortran_order': True, 'shape': {shape}}}");
    let problem = decoded::<f32>(&with_header(&header("(2, 3)"), &[0; 24]), &rows(3));
    assert!(matches!(problem, Err(Problem::FortranOrder)), "{problem:?}");
    assert!(decoded::<f32>(&with_header(&header("(0, 3)"), &[]), &rows(3)).is_ok());
    let one = Dimensions(vec![Some(2)]);
    assert!(decoded::<f32>(&with_header(&header("(2,)"), &[0; 8]), &one).is_ok());
}

#[test]
fn later_versions_are_read_and_unknown_ones_named() {
    let whole = encoded(&[1, 3], &[1.0, 2.0, 3.0]);
    let (header, data) = (&whole[PREAMBLE..128], &whole[128..]);
    let length = u32::try_from(header.len()).expect("short").to_le_bytes();
    let versioned = |version: [u8; 2], length: [u8; 4]| {
        [MAGIC, &version[..], &length[..], header, data].concat()
    };
    for version in [[2, 0], [3, 0]] {
        let (rows, elements) =
            decoded::<f32>(&versioned(version, length), &rows(3)).expect("the same");
        assert_eq!((rows, bits(&elements)), (1, bits(&[1.0, 2.0, 3.0])));
    }
    let problem = decoded::<f32>(&versioned([4, 0], length), &rows(3)).expect_err("unknown");
    assert!(problem.to_string().starts_with("found version 4.0 of the .npy format"));
    // No memory is allocated for a header of four gigabytes.
    let problem = decoded::<f32>(&versioned([2, 0], [0xFF; 4]), &rows(3)).expect_err("long");
    assert!(matches!(problem, Problem::Header(_)), "{problem}");
}

#[test]
fn one_row_is_read_and_no_other() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("passes.npy");
    let numbers: Vec<f32> = (0_u8..12).map(f32::from).collect();
    std::fs::write(&path, encoded(&[3, 2, 2], &numbers)).expect("written");
    let expected = Dimensions(vec![Some(3), Some(2), Some(2)]);
    for row in 0..3 {
        let found: Vec<f32> = read_row(&path, &expected, row).expect("a row");
        assert_eq!(bits(&found), bits(&numbers[4 * row..][..4]));
    }
    // The file is as long as its header claims, and nearly all of it is a hole.
    let header = header("'<f4'", "(255, 1048576, 6)");
    let sparse = std::fs::File::create(&path).expect("a file");
    let begin = with_header(&header, &[]);
    (&sparse).write_all(&begin).expect("written");
    sparse.set_len(begin.len() as u64 + 255 * (1 << 20) * 24).expect("a hole");
    let expected = Dimensions(vec![Some(255), Some(1 << 20), Some(6)]);
    let found: Vec<f32> = read_row(&path, &expected, 254).expect("zeros");
    assert_eq!(found.len(), 6 << 20);
}

#[test]
fn a_missing_file_and_a_folder_are_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let missing = folder.path().join("params.npy");
    let error = read::<f32>(&missing, &rows(3)).expect_err("missing");
    assert!(error.to_string().ends_with("params.npy"));
    let error = read::<f32>(folder.path(), &rows(3)).expect_err("a folder");
    assert!(matches!(error.problem, Problem::NotAFile("a folder")));
    let error = read::<f32>(Path::new("/dev/zero"), &rows(3)).expect_err("without end");
    assert!(matches!(error.problem, Problem::NotAFile("a device")));
}

proptest! {
    #[test]
    fn arrays_survive_a_round_trip(bits in proptest::collection::vec(any::<u32>(), 0..64)) {
        let elements: Vec<f32> = bits.iter().map(|b| f32::from_bits(*b)).collect();
        let bytes = encoded(&[elements.len(), 1], &elements);
        let (n, back) = decoded::<f32>(&bytes, &rows(1)).expect("its own file");
        prop_assert_eq!(n, bits.len());
        prop_assert_eq!(back.iter().map(|f| f.to_bits()).collect::<Vec<_>>(), bits);
    }

    #[test]
    fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..256)) {
        let _ = decoded::<f32>(&bytes, &rows(3));
    }

    #[test]
    fn arbitrary_headers_never_panic(header in "[{}(), :'\"\\[\\]descrfotan_hp<f40-9]{0,90}") {
        let _ = decoded::<f32>(&with_header(&header, &[0; 12]), &rows(3));
    }

    #[test]
    fn corrupted_files_never_panic(at in 0_usize..150, to in any::<u8>()) {
        let mut bytes = encoded(&[2, 3], &[1.0; 6]);
        let at = at % bytes.len();
        bytes[at] = to;
        let _ = decoded::<f32>(&bytes, &rows(3));
    }
}
