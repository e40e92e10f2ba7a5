//! Tables of one motion (0, 1 and 2 mm along x, 5 mm along y, in steps of 10 ms) in the dialects of programs, and
//! tables that leave open what they mean.

use marker_files::table::Table;
use marker_files::{
    ColumnKey, ColumnRule, ColumnRules, ColumnWithUnit, FORCES, Recording, load, read,
};
use std::path::{Path, PathBuf};

/// Writes a file into a temporary folder and returns its path.
fn written(folder: &tempfile::TempDir, text: &str) -> PathBuf {
    let path = folder.path().join("table.txt");
    std::fs::write(&path, text).unwrap();
    path
}

/// Requires that a text is read to the motion of all tables.
fn is_the_motion(text: &str, recording: &Recording) {
    let folder = tempfile::tempdir().unwrap();
    let path = written(&folder, text);
    let tip = read(&path, recording).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(tip.times.len(), 3, "{text}");
    for (k, (time, position)) in tip.times.iter().zip(&tip.positions).enumerate() {
        let k = k as f64;
        let error = [time - 0.01 * k, position[0].unwrap() - 1e-3 * k, position[1].unwrap() - 5e-3];
        // Rounding of decimals that are no binary fractions.
        assert!(error.into_iter().all(|e| e.abs() < 1e-15), "{tip:?}\n{text}");
    }
    // All readers use the same columns.
    let file = load(&path, recording).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(file.frames.len(), 3, "{text}");
}

/// The error of a text.
fn error(text: &str, recording: &Recording) -> String {
    let folder = tempfile::tempdir().unwrap();
    read(&written(&folder, text), recording).unwrap_err().to_string()
}

/// A recording with columns by number or name, `"2"` or `"x pos"`, and unit.
fn columns(rules: &[(&str, &str, Option<&str>)]) -> Recording {
    let rule = |(key, column, unit): &(&str, &str, Option<&str>)| {
        let source = match column.parse() {
            Ok(number) => ColumnKey::Number(number),
            Err(_) => ColumnKey::Name(column.to_string()),
        };
        let rule = match unit {
            None => ColumnRule::Column(source),
            Some(unit) => {
                ColumnRule::WithUnit(ColumnWithUnit { column: source, unit: unit.to_string() })
            }
        };
        (key.to_string(), rule)
    };
    let rules = ColumnRules(rules.iter().map(rule).collect());
    Recording { columns: Some(rules), ..Recording::default() }
}

#[test]
fn tables_of_one_motion_are_equal_in_every_dialect() {
    for text in [
        // Spaces, aligned or not, with decimal points and commas.
        "t x y\n0 0 0.005\n0.01 0.001 0.005\n0.02 0.002 0.005\n",
        "   t      x      y\n0.00  0.000  0.005\n0.01  0.001  0.005\n0.02  0.002  0.005\n",
        "t x y\n0,00 0,000 0,005\n0,01 0,001 0,005\n0,02 0,002 0,005\n",
        "t (ms) x (mm) y (mm)\n0 0 5\n10 1 5\n20 2 5\n",
        // Tabs and semicolons with decimal commas, quoted decimal commas between commas.
        "t\tx\ty\n0,00\t0,000\t0,005\n0,01\t0,001\t0,005\n0,02\t0,002\t0,005\n",
        "t;x;y\n0,00;0,000;0,005\n0,01;0,001;0,005\n0,02;0,002;0,005\n",
        "t,x,y\n\"0,00\",\"0,000\",\"0,005\"\n\"0,01\",\"0,001\",\"0,005\"\n\"0,02\",\"0,002\",\"0,005\"\n",
        // Excel's separator line.
        "sep=;\r\nt;x;y\r\n0;0;0,005\r\n0,01;0,001;0,005\r\n0,02;0,002;0,005\r\n",
        "\u{feff}\"sep=,\"\nt,x,y\n0,0,0.005\n0.01,0.001,0.005\n0.02,0.002,0.005\n",
        // Index columns of pandas and R, frames beside a time.
        ",t,x,y\n0,0,0,0.005\n1,0.01,0.001,0.005\n2,0.02,0.002,0.005\n",
        "Unnamed: 0,t,x,y\n0,0,0,0.005\n1,0.01,0.001,0.005\n2,0.02,0.002,0.005\n",
        "index\tt\tx\ty\n0\t0\t0\t0.005\n1\t0.01\t0.001\t0.005\n2\t0.02\t0.002\t0.005\n",
        "\"t\" \"x\" \"y\"\n\"1\" 0 0 0.005\n\"2\" 0.01 0.001 0.005\n\"3\" 0.02 0.002 0.005\n",
        "frame,time,x,y\n0,0,0,0.005\n1,0.01,0.001,0.005\n2,0.02,0.002,0.005\n",
        // Units at the ends of names, in brackets, micro and nano.
        "t_ms,x_mm,y_mm\n0,0,5\n10,1,5\n20,2,5\n",
        "time_s,x_cm,y_cm\n0,0,0.5\n0.01,0.1,0.5\n0.02,0.2,0.5\n",
        "t_ns,tip_x_um,tip_y_um\n0,0,5000\n10000000,1000,5000\n20000000,2000,5000\n",
        "t[us],x[\u{b5}m],y[\u{3bc}m]\n0,0,5000\n10000,1000,5000\n20000,2000,5000\n",
        // Rows that are padded with blank columns, and blank lines of spaces.
        "t,x,y\n0,0,0.005,\n0.01,0.001,0.005,,\n0.02,0.002,0.005\n",
        "t,x,y\n0,0,0.005\n \n0.01,0.001,0.005\n0.02,0.002,0.005\n  \n",
        "t x y\n0 0 0.005\n0.01 0.001 0.005\n0.02 0.002 0.005\n  \n",
    ] {
        is_the_motion(text, &Recording::default());
    }
}

#[test]
fn columns_are_read_by_number_and_name() {
    let by_number = columns(&[("t", "1", None), ("x", "3", None), ("y", "4", None)]);
    for text in [
        "0,a,0,0.005\n0.01,b,0.001,0.005\n0.02,c,0.002,0.005\n",
        "0 a 0 0,005\n0,01 b 0,001 0,005\n0,02 c 0,002 0,005\n",
        "0;a;0;0,005\n0,01;b;0,001;0,005\n0,02;c;0,002;0,005\n",
        // Lines above the rows, with units in the header or in a line of units.
        "logger 7\nclock[ms];what;pos x[mm];pos y[mm]\n0;a;0;5\n10;b;1;5\n20;c;2;5\n",
        "clock,what,p,q\nms,,mm,mm\n0,a,0,5\n10,b,1,5\n20,c,2,5\n",
    ] {
        is_the_motion(text, &by_number);
    }
    let by_name = columns(&[("t", "Clock", None), ("x", "arm_x", None), ("y", "4", None)]);
    for text in [
        "logger 7\nclock [ms],what,arm_x (mm),h_mm\n0,a,0,5\n10,b,1,5\n20,c,2,5\n",
        "clock;what;ARM_X;arm_y\nms;;mm;mm\n0;a;0;5,0\n10;b;1;5,0\n20;c;2;5,0\n",
    ] {
        is_the_motion(text, &by_name);
    }
    // A line of units of sensors.
    let forces = columns(&[("t", "1", None), ("fx", "2", None)]);
    let text = "time,force\ns,mN\n0,500\n0.01,501\n";
    let table = Table::of_columns(Path::new("f.csv"), text.as_bytes(), forces.columns.as_ref());
    let table = table.unwrap();
    let column = table.require("fx").unwrap();
    assert_eq!(table.factor(column, &FORCES, "").unwrap(), 1e-3);
    // A stated unit may have another spelling than that of the file.
    let moments = columns(&[("t", "1", None), ("mx", "2", Some("N m"))]);
    let text = "time,moment\ns,Nm\n0,1\n0.01,2\n";
    assert!(
        Table::of_columns(Path::new("f.csv"), text.as_bytes(), moments.columns.as_ref()).is_ok()
    );
    // Stated units, and the scale of columns without a unit.
    let stated = [("t", "1", Some("ms")), ("x", "2", Some("mm")), ("y", "3", Some("cm"))];
    is_the_motion("0 0 0.5\n10 1 0.5\n20 2 0.5\n", &columns(&stated));
    is_the_motion("now,a_cm,b_cm\n0,0,0.5\n10,1,0.5\n20,2,0.5\n", &{
        columns(&[("t", "now", Some("ms")), ("x", "a_cm", Some("mm")), ("y", "b_cm", None)])
    });
    let scaled = Recording { scale: Some(1e-3), ..by_number.clone() };
    is_the_motion("0,a,0,5\n0.01,b,1,5\n0.02,c,2,5\n", &scaled);
    let frames = columns(&[("frame", "1", None), ("x", "2", Some("mm")), ("y", "3", Some("mm"))]);
    is_the_motion("0 0 5\n1 1 5\n2 2 5\n", &Recording { fps: Some(100.0), ..frames });
}

#[test]
fn markers_are_selected_by_columns_in_the_order_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let rules = [("t", "1", None), ("xTip", "4", None), ("yTip", "5", None), ("xA", "2", None)];
    let mut recording = columns(&rules);
    let own = ColumnRule::Column(ColumnKey::Number(3));
    recording.columns.as_mut().unwrap().0.insert("yA".into(), own);
    let path = written(&folder, "0 1 2 3 4\n1 5 6 7 8\n");
    let file = load(&path, &recording).unwrap();
    let names: Vec<&str> = file.markers.iter().map(|m| &m.name[..]).collect();
    assert_eq!(names, ["A", "Tip"]);
    let tip = read(&path, &Recording { marker: Some("tip".into()), ..recording }).unwrap();
    assert_eq!(tip.positions[1], [Some(7.0), Some(8.0), None]);
}

#[test]
fn ambiguous_tables_are_rejected_with_the_choices() {
    for (text, line, words) in [
        ("t,x,y\n0,5,1,5,2,5\n", 2, "Decimal commas need semicolons, tabs or spaces"),
        ("t\tx\n0.5\t1,234\n", 2, "allowed: one decimal sign in all numbers"),
        ("t;x\n0,5;1.234\n", 2, "allowed: one decimal sign in all numbers"),
        ("t\tx\n1\t1,234\n2\t5,678\n", 2, "a decimal one or separate thousands"),
        ("t,x\n1,\"1,234\"\n2,\"5,678\"\n", 2, "a decimal one or separate thousands"),
        ("t,x_cm,y_cm\n0,1,2\n", 1, "the unit cm or the name of a marker"),
        ("sep=|\nt|x\n0|1\n", 1, "allowed: a comma, semicolon, tab or space"),
        ("0,0.5\n1,0.6\n", 1, "state the columns, as columns = { t = 1, x = 2, y = 3 }"),
        ("t x\n0 1\n1 one\n", 3, "column `x`: found `one`"),
    ] {
        let found = error(text, &Recording::default());
        assert!(found.contains(&format!("table.txt:{line}: ")) && found.contains(words), "{found}");
    }
    for (rules, text, line, words) in [
        (
            &[("t", "1", None), ("x", "4", None)][..],
            "0,1\n1,2\n",
            1,
            "a column of the file, 1 to 2",
        ),
        (&[("t", "0", None)], "0,1\n", 1, "allowed: a number from 1"),
        (&[("t", "a", None), ("x", "b", None)], "t,x\n0,1\n", 1, "no line with the names a, b"),
        (&[("t", "t", None), ("x", "x", None)], "t,x,x\n0,1,2\n", 1, "above the columns 2, 3"),
        (&[("t", "t", None), ("x", "x", None)], "t,x\n0\n1\n", 2, "found 1 fields, allowed: 2"),
        (&[("t", "1", None), ("x", "1", None)], "0,1\n1,2\n", 1, "as the same column 1"),
        (&[("t", "1", None), ("x", "2", None)], "0,1\n1,one\n", 2, "column `x`: found `one`"),
        (&[("t", "1", None), ("x", "2", None)], "0,1\n1\n", 2, "found 1 fields, allowed: 2"),
        (&[("t", "1", None), ("x", "2", Some("m"))], "t,x[mm]\n0,1\n", 1, "allowed: one unit"),
        (&[("t", "1", None), ("x", "2", Some("ft"))], "0,1\n", 1, "the unit [ft] of `x`"),
        (&[("t", "1", None), ("w", "2", None)], "0,1\n", 1, "found the column `w`"),
        (&[], "0,1\n", 1, "at least one column"),
    ] {
        let found = error(text, &columns(rules));
        assert!(found.contains(&format!("table.txt:{line}: ")) && found.contains(words), "{found}");
    }
    let motive =
        Recording { format: Some(marker_files::Format::Motive), ..columns(&[("t", "1", None)]) };
    assert!(error("0,1\n", &motive).contains("allowed: columns of tables"));
}

#[test]
fn columns_are_shown_as_they_are_written() {
    let rules = columns(&[("t", "1", None), ("x", "a \"b\"", Some("mm"))]).columns.unwrap();
    assert_eq!(rules.to_string(), "{ t = 1, x = { column = \"a \\\"b\\\"\", unit = \"mm\" } }");
}

/// Names of accelerations are also those of a marker `acc`: only a unit of length or the key `columns` makes them
/// positions.
#[test]
fn accelerations_are_no_positions() {
    let folder = tempfile::tempdir().unwrap();
    let rows = "0,0,5\n0.01,1,5\n0.02,2,5\n";
    for header in
        ["t,acc_x,acc_y", "t,accel_x,accel_y", "t,lin_acc_x,lin_acc_y", "t,acc_x[g],acc_y[g]"]
    {
        let path = written(&folder, &format!("{header}\n{rows}"));
        let message = load(&path, &Recording::default()).unwrap_err().to_string();
        assert!(message.contains("accelerations instead of positions"), "{header}: {message}");
    }
    let path = written(&folder, &format!("t,acc_x[mm],acc_y[mm]\n{rows}"));
    assert!(load(&path, &Recording::default()).is_ok());
    let stated = [("t", "t", None), ("x", "acc_x", Some("mm")), ("y", "acc_y", Some("mm"))];
    is_the_motion(&format!("t,acc_x,acc_y\n{rows}"), &columns(&stated));
}
