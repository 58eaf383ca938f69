//! The figures as tables, and the README's block of them.

use super::image::ImageFigures;
use super::{BenchResult, Row};
use crate::table::Table;
use anyhow::{Context, bail};

/// Around the block in README.md that the command writes.
const BEGIN: &str = "<!-- bench: begin -->";
const END: &str = "<!-- bench: end -->";

/// Instructions, and what the image takes.
pub fn block(result: &BenchResult) -> String {
    let mut stages = Table::new(["stage", "axes", "median", "max"]);
    for Row {
        stage,
        axes,
        median,
        max,
    } in result.rows()
    {
        stages.row([stage, axes.to_string(), median.to_string(), max.to_string()]);
    }
    let mut sizes = Table::new(["controller image", "6 axes", "11 axes", "unit"]);
    let (one, both) = (&result.image, &result.second_arm_image);
    let bound = |image: &ImageFigures| {
        let bytes = image.stack_bound_bytes;
        bytes.map_or_else(String::new, |bytes| bytes.to_string())
    };
    let painted = [result.stack_painted_bytes, result.second_arm_stack_painted_bytes].map(|bytes| bytes.to_string());
    for (what, [one, both], unit) in [
        ("flash", [one, both].map(|image| image.flash_bytes.to_string()), "bytes"),
        (
            "static RAM",
            [one, both].map(|image| image.ram_bytes.to_string()),
            "bytes",
        ),
        ("stack, bound by the call graph", [one, both].map(bound), "bytes"),
        ("stack, painted", painted, "bytes"),
        (
            "reachable panics",
            [one, both].map(|image| image.reachable_panics.to_string()),
            "",
        ),
    ] {
        sizes.row([what.into(), one, both, unit.into()]);
    }
    format!("{stages}\n{sizes}")
}

/// What a person sees: the block, and this machine's times.
pub fn report(result: &BenchResult) -> String {
    let mut host = Table::new(["stage, in this process", "axes", "median ns", "max ns"]);
    for row in &result.host_stages_ns {
        host.row([
            row.stage.clone(),
            row.axes.to_string(),
            row.median.to_string(),
            row.max.to_string(),
        ]);
    }
    format!(
        "Instructions of the emulated Cortex-M4F, {} cycles, {} panels from seed {}:\n\n{}\n{host}",
        result.cycles,
        result.trials,
        result.seed,
        block(result)
    )
}

/// `readme` with its block replaced by `block`.
pub fn replace(readme: &str, block: &str) -> anyhow::Result<String> {
    let (before, _, after) = split(readme)?;
    Ok(format!("{before}{BEGIN}\n{block}{END}{after}"))
}

/// The lines of the table in the block of `readme`.
pub fn committed(readme: &str) -> anyhow::Result<Vec<Row>> {
    let (_, block, _) = split(readme)?;
    let rows: Vec<Row> = block.lines().filter_map(row).collect();
    if rows.is_empty() {
        bail!("no line of a table between {BEGIN} and {END}");
    }
    Ok(rows)
}

fn row(line: &str) -> Option<Row> {
    let cells: Vec<&str> = line.split('|').map(str::trim).collect();
    let ["", stage, axes, median, max, ""] = cells[..] else {
        return None;
    };
    Some(Row {
        stage: stage.into(),
        axes: axes.parse().ok()?,
        median: median.parse().ok()?,
        max: max.parse().ok()?,
    })
}

fn split(readme: &str) -> anyhow::Result<(&str, &str, &str)> {
    let (before, rest) = readme.split_once(BEGIN).with_context(|| format!("no {BEGIN} in it"))?;
    let (block, after) = rest
        .split_once(END)
        .with_context(|| format!("no {END} after {BEGIN}"))?;
    Ok((before, block, after))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_that_was_written_is_read_again_and_what_stands_around_it_stays() {
        let readme = "# A\n<!-- bench: begin -->\nold\n<!-- bench: end -->\nrest\n";
        let block =
            "| stage | axes | median | max |\n| ---- | ---: | ---: | ---: |\n| cycle |    6 |   5900 | 9900 |\n";
        let written = replace(readme, block).unwrap();
        assert!(written.starts_with("# A\n") && written.ends_with("<!-- bench: end -->\nrest\n"));
        assert!(!written.contains("old"));
        let expected = Row {
            stage: "cycle".into(),
            axes: 6,
            median: 5900,
            max: 9900,
        };
        assert_eq!(committed(&written).unwrap(), [expected]);
    }

    #[test]
    fn a_readme_without_the_block_or_with_an_empty_one_is_refused() {
        assert!(replace("# A\n", "").is_err());
        let empty = committed("<!-- bench: begin --><!-- bench: end -->").unwrap_err();
        assert!(empty.to_string().starts_with("no line of a table"), "{empty}");
    }
}
