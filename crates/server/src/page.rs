//! The built page. Its sources are in `web/`.

/// A file of the page.
pub(super) struct PageFile {
    /// Its path in the address.
    pub(super) path: &'static str,
    pub(super) media_type: &'static str,
    pub(super) bytes: &'static [u8],
}

macro_rules! page {
    ($($path:literal = $file:literal, $media_type:literal;)+) => {
        &[$(PageFile { path: $path, media_type: $media_type, bytes: include_bytes!(concat!("../page/", $file)) },)+]
    };
}

/// The files that `npm run build` makes.
const FILES: &[PageFile] = page! {
    "/" = "index.html", "text/html; charset=utf-8";
    "/app.js" = "app.js", "text/javascript; charset=utf-8";
    "/app.css" = "app.css", "text/css; charset=utf-8";
    "/curves.js" = "curves.js", "text/javascript; charset=utf-8";
    "/views.js" = "views.js", "text/javascript; charset=utf-8";
    "/view3d.js" = "view3d.js", "text/javascript; charset=utf-8";
    "/licences.txt" = "licences.txt", "text/plain; charset=utf-8";
};

/// The file at this path.
pub(super) fn at(path: &str) -> Option<&'static PageFile> {
    FILES.iter().find(|file| file.path == path)
}
