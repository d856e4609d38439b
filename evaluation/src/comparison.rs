//! What something is worse at than what it is compared with, from the figures themselves.

/// Which values of a figure are better.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Better {
    Higher,
    Lower,
}

/// A row of figures with its name.
pub(crate) type NamedFigures = (String, Vec<f64>);

/// Says in which figures which of the others are better than the subject. Figures that are not
/// numbers are neither better nor worse.
pub(crate) fn where_worse(
    figures: &[(&str, Better)],
    (subject, ours): &NamedFigures,
    others: &[NamedFigures],
) -> String {
    // Figures in which the same ones are better come together.
    let mut clauses: Vec<(Vec<&str>, String)> = Vec::new();
    for (index, &(figure, better)) in figures.iter().enumerate() {
        let names = others.iter().filter(|(_, theirs)| match better {
            Better::Higher => theirs[index] > ours[index],
            Better::Lower => theirs[index] < ours[index],
        });
        let names = list_or_none(names.map(|(name, _)| name.as_str()));
        match clauses.iter_mut().find(|(_, known)| *known == names) {
            Some((figures, _)) => figures.push(figure),
            None => clauses.push((vec![figure], names)),
        }
    }
    let clauses: Vec<String> = clauses
        .iter()
        .map(|(figures, names)| format!("in {} than {names}", figures.join(", ")))
        .collect();
    format!("\nWorse: {subject}, {}.\n", clauses.join("; "))
}

/// Names one after the other, or that there are none.
pub(crate) fn list_or_none<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    if names.is_empty() { "none of these".to_owned() } else { names.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_better_ones_are_named() {
        let row = |name: &str, figures: [f64; 2]| (name.to_owned(), figures.to_vec());
        let figures = [("PSNR", Better::Higher), ("time", Better::Lower)];
        let others = [
            row("a", [31.0, 5.0]),
            row("b", [29.0, 1.0]),
            row("c", [31.0, f64::NAN]),
            row("d", [30.0, 2.0]),
        ];
        let text = where_worse(&figures, &row("ours", [30.0, 2.0]), &others);
        assert_eq!(text, "\nWorse: ours, in PSNR than a, c; in time than b.\n");
        let text = where_worse(&figures, &row("ours", [32.0, 0.5]), &others);
        assert_eq!(text, "\nWorse: ours, in PSNR, time than none of these.\n");
    }
}
