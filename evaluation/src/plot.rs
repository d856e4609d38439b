//! SVG plots.

use std::ops::Range;
use std::path::Path;

use anyhow::{Result, anyhow};
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

/// Points of one colour and name.
#[derive(Clone, Debug)]
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) points: Vec<(f64, f64)>,
}

/// How an axis runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scale {
    Linear,
    Logarithmic,
}

/// What a plot shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plot<'a> {
    pub(crate) title: &'a str,
    pub(crate) x: (&'a str, Scale),
    pub(crate) y: (&'a str, Scale),
    /// Where the series leave room.
    pub(crate) legend: Corner,
}

/// Where a legend may stand.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Corner {
    UpperLeft,
    UpperRight,
    LowerRight,
    /// To the right of all points: the axis, which must be logarithmic, goes on below the legend.
    Beside,
}

/// By how much a logarithmic axis is longer with a legend beside the points.
const LONGER: f64 = 1.3;

/// Colours that can be told apart, also by those who see no red or green (Okabe and Ito).
const COLORS: [RGBColor; 9] = [
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(140, 140, 140),
    RGBColor(240, 228, 66),
];

impl Series {
    /// The points that can be drawn: those of equal pictures have no PSNR.
    fn drawn(&self) -> impl Iterator<Item = (f64, f64)> {
        self.points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite())
    }
}

impl Plot<'_> {
    /// Writes the series, each as points joined by lines, in the colour of its place. Those without points have
    /// a place alone.
    pub(crate) fn write(&self, path: &Path, series: &[Series]) -> Result<()> {
        let points = || series.iter().flat_map(Series::drawn);
        let mut x = range(points().map(|point| point.0), self.x.1);
        if matches!(self.legend, Corner::Beside) {
            x.end = x.start * (x.end / x.start).powf(LONGER);
        }
        let y = range(points().map(|point| point.1), self.y.1);
        use Scale::{Linear, Logarithmic};
        match (self.x.1, self.y.1) {
            (Linear, Linear) => self.draw(path, x, y, series),
            (Linear, Logarithmic) => self.draw(path, x, y.log_scale(), series),
            (Logarithmic, Linear) => self.draw(path, x.log_scale(), y, series),
            (Logarithmic, Logarithmic) => self.draw(path, x.log_scale(), y.log_scale(), series),
        }
    }

    fn draw<X, Y>(&self, path: &Path, x: X, y: Y, series: &[Series]) -> Result<()>
    where
        X: AsRangedCoord<Value = f64, CoordDescType: ValueFormatter<f64>>,
        Y: AsRangedCoord<Value = f64, CoordDescType: ValueFormatter<f64>>,
    {
        let canvas = SVGBackend::new(path, (720, 480)).into_drawing_area();
        let failed = |error: &dyn std::error::Error| anyhow!("{}: {error}", path.display());
        canvas.fill(&WHITE).map_err(|error| failed(&error))?;
        let mut chart = ChartBuilder::on(&canvas)
            .caption(self.title, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(56)
            .build_cartesian_2d(x, y)
            .map_err(|error| failed(&error))?;
        let label = |value: &f64| format!("{}", (value * 1e6).round() / 1e6);
        chart
            .configure_mesh()
            .x_desc(self.x.0)
            .y_desc(self.y.0)
            .x_label_formatter(&label)
            .y_label_formatter(&label)
            .light_line_style(WHITE)
            .x_labels(labels(self.x.1))
            .y_labels(labels(self.y.1))
            .draw()
            .map_err(|error| failed(&error))?;
        for (index, series) in series.iter().enumerate() {
            if series.drawn().next().is_none() {
                continue;
            }
            let color = COLORS[index % COLORS.len()];
            let line = LineSeries::new(series.drawn(), color.stroke_width(2));
            chart
                .draw_series(line.point_size(3))
                .map_err(|error| failed(&error))?
                .label(&series.name)
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 16, y)], color.stroke_width(3))
                });
        }
        chart
            .configure_series_labels()
            .position(match self.legend {
                Corner::UpperLeft => SeriesLabelPosition::UpperLeft,
                Corner::UpperRight | Corner::Beside => SeriesLabelPosition::UpperRight,
                Corner::LowerRight => SeriesLabelPosition::LowerRight,
            })
            .background_style(WHITE.mix(0.85))
            .border_style(RGBColor(200, 200, 200))
            .draw()
            .map_err(|error| failed(&error))?;
        canvas.present().map_err(|error| failed(&error))
    }
}

/// At most so many labels: on a logarithmic axis those between the powers of ten, too.
fn labels(scale: Scale) -> usize {
    match scale {
        Scale::Linear => 11,
        Scale::Logarithmic => 24,
    }
}

/// From the least to the largest value, with a margin; any range of nothing, whose plot is empty.
fn range(values: impl Iterator<Item = f64>, scale: Scale) -> Range<f64> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in values {
        (low, high) = (low.min(value), high.max(value));
    }
    if low > high {
        (low, high) = (0.1, 1.0);
    }
    match scale {
        Scale::Linear => {
            let margin = 0.05 * (high - low).max(1e-9);
            low - margin..high + margin
        }
        Scale::Logarithmic => low / 1.3..high * 1.3,
    }
}
