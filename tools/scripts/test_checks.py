#!/usr/bin/env python3
"""Tests of words.py, circles.py, lines.py and duplicates.py on planted sources.

usage: test_checks.py
"""

import contextlib
import io
import tempfile
import unittest
from pathlib import Path

import circles
import duplicates
import lines
import words


class Planted(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def plant(self, files: dict[str, str]) -> None:
        for name, text in files.items():
            path = self.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")

    def run_check(self, check) -> tuple[int, str]:
        output = io.StringIO()
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
            code = check.main([str(self.folder)])
        return code, output.getvalue()


class Circles(Planted):
    LIB = "mod low;\nmod high;\npub use low::{Thing, deep::Other as Named};\npub use high::Top;\n"

    def test_one_direction_is_no_circle(self):
        self.plant({"lib.rs": self.LIB, "low/mod.rs": "pub struct Thing;", "high.rs": "use crate::low::Thing;"})
        code, output = self.run_check(circles)
        self.assertEqual(code, 0, output)
        self.assertIn("high -> low 1", output)
        self.assertIn("low -> nothing", output)

    def test_every_way_back_makes_a_circle(self):
        for back in (
            "use crate::high::Top;",
            "use crate::Top;",
            "use crate::{Named, Top as Renamed};",
            "use super::high;",
            "fn f() { let _ = crate::high::f(); }",
            "fn f() { let _ = super::high::f(); }",
            "mod inner {\n use super::super::high::Top;\n}",
            "use {crate::high::{self, Top}};",
        ):
            with self.subTest(back):
                self.plant({"lib.rs": self.LIB, "low/mod.rs": back, "high.rs": "use crate::Named;"})
                code, output = self.run_check(circles)
                self.assertEqual(code, 1, output)
                self.assertIn("circle of 2: high, low", output)
                self.assertIn("low/mod.rs:", output)

    def test_tests_comments_and_strings_make_no_arrow(self):
        low = """
            // use crate::high::Top;
            /* use crate::high::Top; /* nested */ use crate::high; */
            const TEXT: &str = "use crate::high::Top;";
            const RAW: &str = r#"crate::high::Top " "#;
            const QUOTE: char = '"';
            #[cfg(test)]
            use crate::high::Top;
            #[cfg(all(test, feature = "emulation"))]
            mod checks;
            #[cfg(test)]
            #[allow(dead_code)]
            fn only_in_tests<T: Into<u8>, U>(_: [T; 2]) -> u8 where U: Copy { crate::high::f() }
            pub(in crate::low) struct Thing<'a>(&'a u8);
            mod inner { use super::Thing; }
            #[cfg(test)]
            mod tests { use crate::high::Top; }
        """
        high = "use crate::Thing;"
        extra = "use crate::high::Top;"
        files = {"low/mod.rs": low, "low/checks.rs": extra, "low/tests/one.rs": extra, "low/pack_tests.rs": extra}
        self.plant({"lib.rs": self.LIB, "high.rs": high, **files})
        code, output = self.run_check(circles)
        self.assertEqual(code, 0, output)
        self.assertIn("low -> nothing", output)

    def test_code_behind_a_test_item_counts(self):
        low = "#[cfg(test)]\nuse a::b;\n#[cfg(not(test))]\nuse crate::high::Top;\n"
        self.plant({"lib.rs": self.LIB, "high.rs": "use crate::low::Thing;", "low/mod.rs": low})
        self.assertEqual(self.run_check(circles)[0], 1)

    def test_a_path_that_leads_nowhere_fails(self):
        self.plant({"lib.rs": self.LIB, "high.rs": "use crate::Nothing;", "low/mod.rs": ""})
        code, output = self.run_check(circles)
        self.assertEqual(code, 1)
        self.assertIn("crate::Nothing leads to no room", output)


class Lines(Planted):
    SOURCE = """
        //! A comment.
        const TEXT: &str = "// no comment
            but text";
        #[cfg(test)]
        mod tests {
            fn f() {}
        }
        fn product() {} // with a comment
    """

    def table(self, limit: int) -> str:
        return f"| part | lines |\n|---|---|\n| `src` | {limit:,} |\n| `src/deep` | 1 |\n"

    def check(self, limit: int, *files: str) -> tuple[int, str]:
        self.plant({"docs/a.md": self.table(limit), "src/a.rs": self.SOURCE, "src/tests/b.rs": "fn t() {}"})
        self.plant({"src/deep/c.rs": "fn c() {}"} | {name: "fn f() {}" for name in files})
        output = io.StringIO()
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
            code = lines.main([str(self.folder / "docs/a.md")])
        return code, output.getvalue()

    def test_product_lines_leave_out_comments_and_tests(self):
        code, output = self.check(3)
        self.assertEqual(code, 0, output)
        self.assertRegex(output, r"src +3 of +3\nsrc/deep +1 of +1\nall +4 of +4\n")

    def test_a_part_that_grows_fails(self):
        code, output = self.check(2)
        self.assertEqual(code, 1)
        self.assertIn("src has 1 lines more", output)

    def test_a_file_in_no_part_fails(self):
        code, output = self.check(3, "tools/d.rs")
        self.assertEqual(code, 1)
        self.assertIn("tools/d.rs is in no part", output)


class Duplicates(Planted):
    def check(self, *files: str) -> tuple[int, str]:
        self.plant(dict(zip(("a.rs", "b.rs"), files)))
        return self.run_check(duplicates)

    def test_six_equal_lines_need_a_reason_and_five_do_not(self):
        six = [f"    act({k}); // {{}}" for k in range(6)]
        for count, code in ((5, 0), (6, 1)):
            body = "\n\n    // comment\n".join(six[:count])
            found, output = self.check(f"fn a() {{\n{body}\n}}", f"fn b() {{\n{body}\n}}")
            self.assertEqual(found, code, output)
            self.assertEqual("a.rs and b.rs share a run" in output, bool(code), output)

    def test_tests_and_imports_do_not_count(self):
        uses = "\n".join(f"use a::b{k};" for k in range(9))
        tests = "#[cfg(test)]\nmod tests {\n" + "\n".join(f"fn f{k}() {{}}" for k in range(9)) + "\n}"
        code, output = self.check(uses + "\n" + tests, uses + "\n" + tests)
        self.assertEqual(code, 0, output)


class Words(Planted):
    CLEAN = "//! Picks the root cause out of a diagnosis.\n\n/// One `T` per bank. Those links never change.\nstruct S;\n"

    def test_plain_english_passes(self):
        self.plant({"src/lib.rs": self.CLEAN})
        self.assertEqual(self.run_check(words)[0], 0)

    def test_every_phrase_is_found_where_it_is(self):
        for name, text in {
            "those": "Finds those that\n/// never move.",
            "what": "What there is one in each bank.",
            "of which": "Issues of\n/// which all beats arrived.",
            "Of a ...": "Of a collision the normal is first.",
            "so many": "Reads so many elements.",
            "whoever": "For whoever reads it.",
            "is said": "Where it is said, it is read.",
            "there are": "None on channels that\n/// there are not.",
        }.items():
            with self.subTest(name):
                self.plant({"src/lib.rs": self.CLEAN + f"\n/// {text}\n/// {text}\nfn f() {{}}\n"})
                code, output = self.run_check(words)
                self.assertEqual(code, 1, output)
                self.assertRegex(output, rf"src/lib.rs:6: {name}: ")

    def test_code_and_examples_are_not_read(self):
        code = 'const A: &str = "What of those. What of those.";\n/// ```\n/// // What of those. Of a which.\n/// ```\nfn f() {}\n'
        self.plant({"src/lib.rs": self.CLEAN + code})
        self.assertEqual(self.run_check(words)[0], 0)

    def test_a_head_says_what_the_module_is_for(self):
        self.plant({"src/lib.rs": "//! This file picks the root cause.\n"})
        code, output = self.run_check(words)
        self.assertEqual(code, 1)
        self.assertIn("src/lib.rs:1: the head begins", output)


if __name__ == "__main__":
    unittest.main()
