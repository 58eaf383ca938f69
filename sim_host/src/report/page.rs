//! The page: head, figures against the paper's, plots, frames.

use std::fmt::Write;

use anyhow::Result;

use super::escape::escape;
use super::{RunReport, chart, frames, plots};

const STYLE: &str = include_str!("style.css");

/// The whole page.
pub fn html(report: &RunReport) -> Result<String> {
    let mut html = String::new();
    let title = escape(&report.title);
    write!(
        html,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n"
    )?;
    head(&mut html, report)?;
    figures(&mut html, report)?;
    for plot in plots::all(report)? {
        write!(html, "<section>\n<h2>{}</h2>\n<p>{}</p>\n", plot.title, plot.caption)?;
        if !plot.key.is_empty() {
            html.push_str("<p class=\"key\">");
            for (name, colour) in &plot.key {
                let plotters::style::RGBColor(r, g, b) = chart::COLOURS[*colour];
                write!(
                    html,
                    "<span><i style=\"background:#{r:02x}{g:02x}{b:02x}\"></i>{name}</span>"
                )?;
            }
            html.push_str("</p>\n");
        }
        let class = if plot.side_by_side { "charts pairs" } else { "charts" };
        writeln!(
            html,
            "<div class=\"{class}\">\n{}</div>\n</section>",
            plot.charts.concat()
        )?;
    }
    camera(&mut html, report)?;
    html.push_str("</body>\n</html>\n");
    Ok(html)
}

fn head(html: &mut String, report: &RunReport) -> Result<()> {
    let (class, verdict) = if report.succeeded {
        ("found", "passed")
    } else {
        ("refused", "failed")
    };
    let (title, summary) = (escape(&report.title), escape(&report.summary));
    write!(
        html,
        "<header>\n<h1>{title}<span class=\"badge {class}\">{verdict}</span></h1>\n<p>{summary}</p>\n<dl>\n"
    )?;
    for (name, value) in &report.facts {
        writeln!(html, "<div><dt>{}</dt><dd>{}</dd></div>", escape(name), escape(value))?;
    }
    html.push_str("</dl>\n</header>\n");
    Ok(())
}

fn figures(html: &mut String, report: &RunReport) -> Result<()> {
    html.push_str("<section>\n<h2>Figures</h2>\n<div class=\"scroll\"><table>\n<thead><tr><th>figure</th>");
    html.push_str("<th class=\"number\">this run</th><th>unit</th><th>bar</th><th>paper</th></tr></thead>\n<tbody>\n");
    for figure in &report.figures {
        let [name, value, unit, bar, paper] =
            [&figure.name, &figure.value, &figure.unit, &figure.bar, &figure.paper].map(|text| escape(text));
        writeln!(
            html,
            "<tr><td>{name}</td><td class=\"number\">{value}</td><td>{unit}</td><td>{bar}</td><td>{paper}</td></tr>"
        )?;
    }
    html.push_str("</tbody>\n</table></div>\n</section>\n");
    Ok(())
}

fn camera(html: &mut String, report: &RunReport) -> Result<()> {
    let chosen = frames::chosen(&report.frames);
    let (shown, all) = (chosen.len(), report.frames.len());
    html.push_str("<section>\n<h2>Camera frames</h2>\n");
    write!(
        html,
        "<p>{shown} of {all} exposures. Dots are line centres, the cross is the seam; under each frame the time and \
         the nozzle's station at its exposure, and what was decided.</p>\n<div class=\"frames\">\n"
    )?;
    for at in chosen {
        writeln!(html, "{}", frames::figure(report, &report.frames[at])?)?;
    }
    html.push_str("</div>\n</section>\n");
    Ok(())
}
