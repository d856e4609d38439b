//! Sentences that say what is better than what, made from the figures themselves.

/// Which values of a figure are better.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Better {
    Higher,
    Lower,
}

/// A row of figures with its name.
pub(crate) type NamedFigures = (String, Vec<f64>);

/// Says which of the others are better than the subject, and in which figures. NaN is neither
/// better nor worse.
pub(crate) fn better_than(
    figures: &[(&str, Better)],
    (subject, ours): &NamedFigures,
    others: &[NamedFigures],
) -> String {
    // Figures in which the same others are better share a clause.
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
        .map(|(figures, names)| format!("in {}: {names}", figures.join(", ")))
        .collect();
    format!("\nBetter than {subject} {}.\n", clauses.join("; "))
}

/// The names separated by commas, or the words that there are none. Names that have commas themselves
/// are quoted.
pub(crate) fn list_or_none<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let quoted = |name: &str| format!("\"{name}\"");
    let names = names.map(|name| if name.contains(',') { quoted(name) } else { name.to_owned() });
    let names: Vec<String> = names.collect();
    if names.is_empty() { "none of these".to_owned() } else { names.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_better_is_named() {
        let row = |name: &str, figures: [f64; 2]| (name.to_owned(), figures.to_vec());
        let figures = [("PSNR", Better::Higher), ("time", Better::Lower)];
        let others = [
            row("a", [31.0, 5.0]),
            row("b", [29.0, 1.0]),
            row("c", [31.0, f64::NAN]),
            row("d", [30.0, 2.0]),
        ];
        let text = better_than(&figures, &row("ours", [30.0, 2.0]), &others);
        assert_eq!(text, "\nBetter than ours in PSNR: a, c; in time: b.\n");
        let text = better_than(&figures, &row("ours", [32.0, 0.5]), &others);
        assert_eq!(text, "\nBetter than ours in PSNR, time: none of these.\n");
        assert_eq!(list_or_none(["a, 1", "b"].into_iter()), "\"a, 1\", b");
    }
}
