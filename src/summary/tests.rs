//! Tests of the layout of summaries: order of their parts, width of lines, colors, escaped control characters, tables.
//!
//! Input are a summary with all kinds of parts, messages with quoted lines, and tables with long cells. They are
//! rendered at several widths, with and without color. The tests compare the text: status, result, warnings, details;
//! lines up to the width; equal text without the escape sequences.

use crate::code::Code;
use crate::summary::{ItemTable, Summary, TextStyle, Tone, wrap_message};

// A summary with a status, a table with an unused and a wrapped column, a warning and two facts with one label.
fn sample() -> Summary {
    let long = "repeat at another free length, and weigh a known length of the rod beside it";
    let rows = [["youngs_modulus", "9.99e7", long], ["density", "1.1e3", ""]];
    let table = ItemTable::new(rows)
        .left("parameter", |[name, ..]| name.to_string())
        .right("estimate", |[_, value, _]| value.to_string())
        .left("unused", |_| None)
        .wrapped("test", |[.., test]| test.to_string());
    let warning = "the residuals of the tip are autocorrelated (lag 1: 0.97). The intervals are too narrow. \
                   Use a coarser frame rate. [correlated-noise]";
    Summary::new("converged", Tone::Good)
        .with_code(Some(Code::Trustworthy))
        .with_subject("data/fit.toml")
        .table("", table)
        .warnings([warning])
        .fact(
            "Residuals",
            "RMS 1.014 mm, and much more text that does not fit on a line of eighty columns",
        )
        .fact("Residuals", "sigma 1 mm")
}

#[test]
fn status_names_the_codes_of_warnings_once() {
    let summary = Summary::new("completed", Tone::Doubtful)
        .warnings(["a [unstable-state]", "b", "c [large-strain]", "d [unstable-state]"])
        .naming_warnings();
    let first = summary.to_string();
    assert!(
        first.starts_with("completed, with warnings: unstable-state, large-strain\n"),
        "{first}"
    );
    let silent = Summary::new("completed", Tone::Good).warnings(["without a code"]);
    assert_eq!(silent.clone().naming_warnings(), silent);
}

#[test]
fn summary_has_status_result_warnings_and_details_in_order() {
    let expected = "\
data/fit.toml: converged [trustworthy]

  parameter       estimate  test
  youngs_modulus    9.99e7  repeat at another free length, and weigh a known
                            length of the rod beside it
  density            1.1e3

warning: the residuals of the tip are autocorrelated (lag 1: 0.97). The
  intervals are too narrow. Use a coarser frame rate. [correlated-noise]

  Residuals               RMS 1.014 mm, and much more text that does not fit on
                          a line of eighty columns
                          sigma 1 mm";
    assert_eq!(sample().to_string(), expected);
}

#[test]
fn lines_are_as_wide_as_the_terminal_at_most() {
    for width in [50, 60, 80, 100, 200] {
        let text = sample().render(TextStyle { width, is_colored: false });
        assert!(text.lines().all(|line| line.chars().count() <= width), "{width}:\n{text}");
    }
    let text = sample().render(TextStyle { width: 200, is_colored: false });
    // At 200 columns no line of the sample is wrapped.
    assert_eq!(text.lines().count(), 10, "{text}");
}

#[test]
fn color_adds_escapes_and_nothing_else() {
    let plain = sample().to_string();
    assert!(!plain.contains('\x1b'));
    let colored = sample().render(TextStyle { is_colored: true, ..TextStyle::default() });
    assert!(colored.contains("\x1b[32mconverged [trustworthy]\x1b[0m"), "{colored}");
    assert!(colored.contains("\x1b[33mwarning:\x1b[0m "), "{colored}");
    let without = ["\x1b[32m", "\x1b[33m", "\x1b[0m"];
    let stripped = without.iter().fold(colored, |text, escape| text.replace(escape, ""));
    assert_eq!(stripped, plain);
}

#[test]
fn control_characters_of_names_are_escaped() {
    let text = Summary::new("done", Tone::Good)
        .with_subject("a\x1b[31mb")
        .fact("x", "\x1b[0m")
        .to_string();
    assert!(!text.contains('\x1b') && text.starts_with("a\\x1b[31mb: done"), "{text}");
}

#[test]
fn quoted_lines_of_a_message_stay_whole() {
    let quoted = format!("12 | {}", "x ".repeat(60));
    let message = format!("error: {}\n{quoted}", "word ".repeat(30));
    let style = TextStyle { width: 80, is_colored: false };
    let text = wrap_message(&message, style);
    assert!(text.ends_with(&quoted), "{text}");
    // Prose is wrapped at 80 columns, a quoted line of a file is not.
    assert!(text.lines().take(2).all(|line| line.len() <= 80), "{text}");
    assert!(text.lines().nth(1).unwrap().starts_with("  word"), "{text}");
}

#[test]
fn table_with_a_long_path_fits_into_80_columns() {
    let row = [
        "cantilever-tip: ./data/cantilever-tip.csv",
        "0.803 mm",
        "0.698 mm",
        "2.73 mm",
        "1.01 mm",
        "1.01 sigma, 1.36 % of the measured change",
    ];
    let table = ItemTable::new([row])
        .wrapped("measurement", |row| row[0].to_string())
        .right("mean", |row| row[1].to_string())
        .right("median", |row| row[2].to_string())
        .right("worst", |row| row[3].to_string())
        .right("RMS", |row| row[4].to_string())
        .wrapped("relative RMS", |row| row[5].to_string());
    let text = Summary::new("done", Tone::Good).table("", table).to_string();
    let lines: Vec<&str> = text.lines().collect();
    // 80 columns without a terminal; the path itself stays whole.
    assert!(lines.iter().all(|line| line.len() <= 80), "{lines:#?}");
    assert!(lines.iter().any(|line| line.contains("./data/cantilever-tip.csv ")), "{lines:#?}");
}

/// Wrapping changes the spaces of the subject: the status is written once, complete, and alone in color.
#[test]
fn headline_with_spaces_in_its_subject_has_subject_and_status_once() {
    let long = format!("data/{}fit.toml", "a folder of measurements/".repeat(4));
    let headline = |subject: &str, status: &str, is_colored: bool| {
        let summary = Summary::new(status, Tone::Good).with_subject(subject);
        summary.render(TextStyle { is_colored, ..TextStyle::default() })
    };
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    // Two successive spaces in the subject, a status that is wrapped, and one that begins with two bytes.
    for (subject, status) in [
        (&long[..], "converged".to_string()),
        ("data/a  b.toml", format!("converged{}", " after a long search".repeat(5))),
        ("data/a  b.toml", format!("\u{e9}tat{}", " stable".repeat(12))),
    ] {
        let plain = headline(subject, &status, false);
        assert_eq!(words(&plain), words(&format!("{subject}: {status}")));
        let colored = headline(subject, &status, true);
        let (before, rest) = colored.split_once("\x1b[32m").unwrap();
        assert_eq!(words(before), words(&format!("{subject}:")));
        assert_eq!(format!("{before}{}", rest.replacen("\x1b[0m", "", 1)), plain);
    }
}
