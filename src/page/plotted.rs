//! The plotted data of a chart as the rows of a CSV file.

use crate::page::csv::number;

/// A plotted point with its series, and a 95 % interval of it.
pub(super) struct Datum {
    pub series: String,
    pub point: (f64, f64),
    pub interval: Option<[f64; 2]>,
}

/// Header and rows of the data of a chart with these labels of its axes. A chart whose y axis has names has a row for
/// each name. Series with the same abscissas have a column each; other series follow each other.
pub(super) fn csv_rows(
    data: &[Datum],
    [x_label, y_label]: &[String; 2],
    names: &[String],
) -> Vec<Vec<String>> {
    let has_intervals = data.iter().any(|datum| datum.interval.is_some());
    let ends_of = |label: &str| ["low", "high"].map(|end| format!("95 % {end}: {label}"));
    let ends = |datum: &Datum| datum.interval.map(|ends| ends.map(number)).unwrap_or_default();
    if !names.is_empty() {
        let name = |y: f64| names.get((-y).round().max(0.0) as usize).cloned().unwrap_or_default();
        let row = |datum: &Datum| {
            let mut row = vec![name(datum.point.1), number(datum.point.0)];
            row.extend(ends(datum));
            row
        };
        let mut header = vec![y_label.clone(), x_label.clone()];
        header.extend(ends_of(x_label));
        return std::iter::once(header).chain(data.iter().map(row)).collect();
    }
    let series: Vec<&[Datum]> = data.chunk_by(|a, b| a.series == b.series).collect();
    let abscissas = |own: &[Datum]| own.iter().map(|datum| datum.point.0).collect::<Vec<f64>>();
    let Some(first) = series.first().map(|own| abscissas(own)) else { return Vec::new() };
    if !has_intervals && series.iter().all(|own| abscissas(own) == first) {
        let head = |own: &[Datum]| match series.len() {
            1 => y_label.clone(),
            _ => format!("{}: {y_label}", own[0].series),
        };
        let header =
            std::iter::once(x_label.clone()).chain(series.iter().map(|own| head(own))).collect();
        let row = |k: usize| {
            let values = series.iter().map(|own| number(own[k].point.1));
            std::iter::once(number(first[k])).chain(values).collect()
        };
        return std::iter::once(header).chain((0..first.len()).map(row)).collect();
    }
    let mut header = vec!["series".to_string(), x_label.clone(), y_label.clone()];
    header.extend(ends_of(y_label).into_iter().filter(|_| has_intervals));
    let row = |datum: &Datum| {
        let mut row = vec![datum.series.clone(), number(datum.point.0), number(datum.point.1)];
        row.extend(ends(datum).into_iter().filter(|_| has_intervals));
        row
    };
    std::iter::once(header).chain(data.iter().map(row)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn datum(series: &str, x: f64, y: f64) -> Datum {
        Datum { series: series.into(), point: (x, y), interval: None }
    }

    fn joined(data: &[Datum]) -> Vec<String> {
        let labels = ["t (s)".to_string(), "x (mm)".to_string()];
        csv_rows(data, &labels, &[]).iter().map(|row| row.join(";")).collect()
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
