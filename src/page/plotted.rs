//! The plotted data of a chart as header and rows of a CSV file, in the units of the axes.
//!
//! Input: the points of all named series in the order of plotting, with their 95 % intervals. [`csv_rows`] selects one
//! of three layouts. If the y axis has names, each point has a row that begins with its name. Series with the same
//! abscissas and without intervals have a column each. Other series stand one below the other, with their name in the
//! first column. Intervals have two further columns, empty where a point has none. Without data there are no rows.

use crate::page::csv::csv_number;

/// A plotted point in the units of the axes, with the name of its series and its 95 % interval, if it has one.
pub(super) struct Datum {
    pub series: String,
    pub point: [f64; 2],
    pub interval: Option<[f64; 2]>,
}

/// Header and rows of the data of a chart, whose axes have these labels; empty without data.
///
/// If the y axis has `names`, there is a row for each point, beginning with its name. Series without intervals that
/// have the same abscissas have a column each. Other series follow each other, in the order in which they were plotted,
/// with their name in the first column. Intervals have two further columns.
pub(super) fn csv_rows(
    data: &[Datum],
    [x_label, y_label]: [&str; 2],
    names: &[String],
) -> Vec<Vec<String>> {
    let has_intervals = data.iter().any(|datum| datum.interval.is_some());
    let interval_heads = |label: &str| {
        let heads = ["low", "high"].map(|end| format!("95 % {end}: {label}"));
        heads.into_iter().filter(move |_| has_intervals)
    };
    // A fit without an interval has empty cells.
    let ends = |datum: &Datum| {
        let ends = datum.interval.map(|ends| ends.map(csv_number)).unwrap_or_default();
        ends.into_iter().filter(move |_| has_intervals)
    };
    let mut rows: Vec<Vec<String>> = Vec::new();
    let series: Vec<&[Datum]> = data.chunk_by(|a, b| a.series == b.series).collect();
    let abscissas = |own: &[Datum]| own.iter().map(|datum| datum.point[0]).collect::<Vec<f64>>();
    let Some(first) = series.first().map(|own| abscissas(own)) else { return rows };
    // Three layouts: a row per name, a column per series, or one series below the other.
    if !names.is_empty() {
        let heads = [y_label.to_string(), x_label.to_string()].into_iter();
        rows.push(heads.chain(interval_heads(x_label)).collect());
        for datum in data {
            let [x, y] = datum.point;
            let name = names.get((-y).round().max(0.0) as usize).cloned().unwrap_or_default();
            rows.push([name, csv_number(x)].into_iter().chain(ends(datum)).collect());
        }
    } else if !has_intervals && series.iter().all(|own| abscissas(own) == first) {
        let head = |own: &&[Datum]| match series.len() {
            1 => y_label.to_string(),
            _ => format!("{}: {y_label}", own[0].series),
        };
        rows.push([x_label.to_string()].into_iter().chain(series.iter().map(head)).collect());
        for (k, x) in first.iter().enumerate() {
            let values = series.iter().map(|own| own[k].point[1]);
            rows.push([*x].into_iter().chain(values).map(csv_number).collect());
        }
    } else {
        let heads = ["series", x_label, y_label].map(String::from).into_iter();
        rows.push(heads.chain(interval_heads(y_label)).collect());
        for datum in data {
            let cells = [vec![datum.series.clone()], datum.point.map(csv_number).to_vec()];
            rows.push(cells.into_iter().flatten().chain(ends(datum)).collect());
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    fn datum(series: &str, x: f64, y: f64) -> Datum {
        Datum { series: series.into(), point: [x, y], interval: None }
    }

    /// Rows of the CSV text of these data, with fields separated by semicolons.
    fn joined(data: &[Datum]) -> Vec<String> {
        csv_rows(data, ["t (s)", "x (mm)"], &[]).iter().map(|row| row.join(";")).collect()
    }

    #[test]
    fn series_with_common_abscissas_have_columns_and_others_follow_each_other() {
        let common = [datum("a", 0.0, 1.0), datum("a", 0.5, 2.0), datum("b", 0.0, 3.0)];
        assert_eq!(joined(&common[..2]), ["t (s);x (mm)", "0;1", "0.5;2"]);
        assert_eq!(joined(&common), ["series;t (s);x (mm)", "a;0;1", "a;0.5;2", "b;0;3"]);
        let [first, _, third] = common;
        assert_eq!(joined(&[first, third]), ["t (s);a: x (mm);b: x (mm)", "0;1;3"]);
        assert!(joined(&[]).is_empty());
    }
}
