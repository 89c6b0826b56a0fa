//! The pages, inside the program: plain modules that browsers load as they are.

use axum::http::header;
use axum::response::{IntoResponse, Response};

/// The content security policy of the pages: they load from this server only. The hash is that of the script within `index.html`,
/// which has to be there when no other file is.
const POLICY: &str = "default-src 'none'; connect-src 'self'; manifest-src 'self'; img-src 'self' data:; \
     script-src 'self' 'sha256-34PApFKKNDpqbgJSU5hbFIyQNuDVdCwySJDmuO282nA='; style-src 'self'; frame-src 'self'; \
     base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// A file of the pages.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asset {
    kind: &'static str,
    bytes: &'static [u8],
}

macro_rules! files {
    ($path:ident: $($name:literal)+) => {
        match $path {
            $($name => include_str!(concat!("../../assets/dashboard/", $name)),)+
            _ => return None,
        }
    };
}

/// The file of a path.
pub(super) fn asset(path: &str) -> Option<Asset> {
    let path = if path.is_empty() { "index.html" } else { path };
    if path == "icon.png" {
        return Some(Asset { kind: "image/png", bytes: include_bytes!("../../assets/dashboard/icon.png") });
    }
    let text = match path {
        "uplot.js" => include_str!("../../assets/vendor/uplot/uPlot.iife.min.js"),
        "uplot.css" => include_str!("../../assets/vendor/uplot/uPlot.min.css"),
        // Reports embed the same text in a module of their own.
        "chart.js" => concat!(
            include_str!("../../assets/page/chart.js"),
            "\nexport { chart, colour, dots, line, rounded };\n"
        ),
        _ => files! { path:
            "index.html" "dashboard.css" "dashboard.js" "alarms.js" "guide.js" "schedules_page.js" "route_buttons.js" "server.js" "live.js" "halt.js" "dom.js" "words.js" "english.js"
            "german.js" "german_report.js" "german_log.js" "german_line.js" "german_errors.js" "german_help.js" "german_odometry.js" "charts.js" "time_window.js" "portrait.js" "signals.js" "layout_page.js" "pick_track.js" "track.js" "view.js" "train_page.js"
            "train_charts.js" "places.js" "plan.js" "plan_curve.js" "plan_without_points.js" "scale.js" "throttle.js" "doing_now.js" "pieces.js" "draft.js" "draft_file.js" "editor_page.js" "setup_page.js" "worker.js" "icon.svg" "manifest.webmanifest" "calibration_page.js" "health_page.js" "recordings_page.js" "odometry_page.js" "slide_view.js"
        },
    };
    let kind = match path.rsplit_once('.') {
        Some((_, "js")) => "text/javascript; charset=utf-8",
        Some((_, "css")) => "text/css; charset=utf-8",
        Some((_, "svg")) => "image/svg+xml",
        Some((_, "webmanifest")) => "application/manifest+json",
        _ => "text/html; charset=utf-8",
    };
    Some(Asset { kind, bytes: text.as_bytes() })
}

impl IntoResponse for Asset {
    fn into_response(self) -> Response {
        let headers = [
            (header::CONTENT_TYPE, self.kind),
            (header::CONTENT_SECURITY_POLICY, POLICY),
            (header::CACHE_CONTROL, "no-cache"),
        ];
        (headers, self.bytes).into_response()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The most that a browser loads for all pages together, in bytes, uncompressed.
    const HEAVIEST: usize = 500_000;

    #[test]
    fn all_pages_together_are_light() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/dashboard");
        let files = std::fs::read_dir(folder).expect("the folder of the pages");
        let names = files.map(|file| file.expect("a file").file_name().to_string_lossy().into_owned());
        let names: Vec<String> = names.filter(|name| name != "openapi.json").collect();
        let shared = ["uplot.js", "uplot.css", "chart.js"].map(str::to_owned);
        let weight: usize = names
            .iter()
            .chain(&shared)
            .map(|name| asset(name).unwrap_or_else(|| panic!("{name} is not served")).bytes.len())
            .sum();
        assert!(weight <= HEAVIEST, "the pages weigh {weight} bytes");
    }
}
