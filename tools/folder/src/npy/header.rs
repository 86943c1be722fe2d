//! Parses the header of a `.npy` file, a Python dictionary.

use super::Problem;

/// More dimensions than any array here has.
const DIMENSIONS_MAX: usize = 8;

/// The three entries of a header.
#[derive(Debug)]
pub(super) struct Header {
    /// The type of the elements; for records, the list of fields as written.
    pub(super) descr: String,
    pub(super) fortran_order: bool,
    pub(super) shape: Vec<usize>,
}

impl Header {
    /// Parses a header.
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, Problem> {
        let text = std::str::from_utf8(bytes).map_err(|_| Problem::Header("text"))?;
        let mut scan = Scanner(text);
        let (mut descr, mut fortran_order, mut shape) = (None, None, None);
        scan.expect('{', "a dictionary")?;
        while !scan.take('}') {
            let key = scan.string()?;
            scan.expect(':', "a colon after a key")?;
            match key {
                "descr" => descr = Some(scan.descr()?.to_owned()),
                "fortran_order" => fortran_order = Some(scan.boolean()?),
                "shape" => shape = Some(scan.tuple()?),
                _ => return Err(Problem::Header("the keys descr, fortran_order and shape only")),
            }
            if !scan.take(',') {
                scan.expect('}', "a comma or the dictionary's end")?;
                break;
            }
        }
        if !scan.0.trim().is_empty() {
            return Err(Problem::Header("spaces after the dictionary"));
        }
        Ok(Self {
            descr: descr.ok_or(Problem::Header("the key descr"))?,
            fortran_order: fortran_order.ok_or(Problem::Header("the key fortran_order"))?,
            shape: shape.ok_or(Problem::Header("the key shape"))?,
        })
    }
}

/// The rest of the text.
struct Scanner<'a>(&'a str);

impl<'a> Scanner<'a> {
    fn take(&mut self, token: char) -> bool {
        let rest = self.0.trim_start().strip_prefix(token);
        self.0 = rest.unwrap_or(self.0);
        rest.is_some()
    }

    fn expect(&mut self, token: char, what: &'static str) -> Result<(), Problem> {
        if self.take(token) { Ok(()) } else { Err(Problem::Header(what)) }
    }

    fn string(&mut self) -> Result<&'a str, Problem> {
        let wrong = Problem::Header("a quoted string");
        let quote = if self.take('\'') {
            '\''
        } else if self.take('"') {
            '"'
        } else {
            return Err(wrong);
        };
        let (string, rest) = self.0.split_once(quote).ok_or(wrong)?;
        self.0 = rest;
        Ok(string)
    }

    /// The name of a type, or a list of fields as written.
    fn descr(&mut self) -> Result<&'a str, Problem> {
        if self.0.trim_start().starts_with('[') { self.list() } else { self.string() }
    }

    /// A list up to its closing bracket; brackets in quotes do not count.
    fn list(&mut self) -> Result<&'a str, Problem> {
        let text = self.0.trim_start();
        let (mut depth, mut quote) = (0_usize, None);
        for (at, character) in text.char_indices() {
            match (quote, character) {
                (Some(open), _) if open == character => quote = None,
                (Some(_), _) => {}
                (None, '\'' | '"') => quote = Some(character),
                (None, '[') => depth += 1,
                (None, ']') => depth -= 1,
                (None, _) => {}
            }
            if depth == 0 {
                // The character is a bracket, one byte long.
                let (list, rest) = text.split_at(at + 1);
                self.0 = rest;
                return Ok(list);
            }
        }
        Err(Problem::Header("the end of the list of fields"))
    }

    fn boolean(&mut self) -> Result<bool, Problem> {
        for (word, value) in [("True", true), ("False", false)] {
            if let Some(rest) = self.0.trim_start().strip_prefix(word) {
                self.0 = rest;
                return Ok(value);
            }
        }
        Err(Problem::Header("True or False"))
    }

    fn tuple(&mut self) -> Result<Vec<usize>, Problem> {
        let mut lengths = Vec::new();
        self.expect('(', "a tuple as shape")?;
        while !self.take(')') {
            let text = self.0.trim_start();
            let digits = text.bytes().take_while(u8::is_ascii_digit).count();
            let (number, rest) = text.split_at(digits);
            let length =
                number.parse().map_err(|_| Problem::Header("lengths below 2^64 in the shape"))?;
            self.0 = rest;
            if lengths.len() == DIMENSIONS_MAX {
                return Err(Problem::Header("at most eight dimensions"));
            }
            lengths.push(length);
            if !self.take(',') {
                self.expect(')', "a comma or the tuple's end")?;
                break;
            }
        }
        Ok(lengths)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn malformed_headers_are_refused() {
        for header in [
            "",
            "{",
            "{}",
            "[]",
            "{'descr': '<f4'}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (0, 3)",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (0, 3)} x",
            "{'descr': '<f4', 'fortran_order': no, 'shape': (0, 3)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (-1, 3)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (, 3)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (0 3)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (0,3,0,3,0,3,0,3,0)}",
            "{'descr': [('a', '<f4'), 'fortran_order': False, 'shape': (0, 3)}",
            "{'descr': ['], 'fortran_order': False, 'shape': (0, 3)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (0, 3), 'x': 1}",
            "{'descr: 0}",
        ] {
            let problem = Header::parse(header.as_bytes()).expect_err(header);
            assert!(matches!(problem, Problem::Header(_)), "{header}: {problem}");
        }
    }

    #[test]
    fn a_list_of_fields_is_kept_as_it_is_written() {
        let fields = "[('x]', '<f4'), ('ö', [('y', '<u4', (2,))])]";
        let header = format!("{{'descr': {fields}, 'fortran_order': False, 'shape': (3,), }}  \n");
        let header = Header::parse(header.as_bytes()).expect("well formed");
        assert_eq!((header.descr.as_str(), header.shape), (fields, vec![3]));
    }
}
