//! Identity and selection of a camera.

use std::fmt;
use std::str::FromStr;

use super::CameraError;

/// Identity of a camera, as reported.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CameraIdentity {
    /// Name of its driver.
    pub driver: String,
    /// Model name.
    pub model: String,
    /// Its socket, as named by the driver.
    pub bus: String,
    /// Path of the device file, or of the folder of a replayed sequence.
    pub path: Option<String>,
    /// The node within its device: USB interface and index, if there are such.
    pub part: String,
    /// Vendor and product of the USB device, such as `046d:0825`.
    pub usb_product: Option<String>,
    /// Serial number of the USB device, if it has one.
    pub serial_number: Option<String>,
    /// Stable names of links to its device file: those in `/dev/v4l/by-id`, then those in `/dev/v4l/by-path`.
    pub links: Vec<String>,
}

impl CameraIdentity {
    /// Short name for messages.
    pub fn name(&self) -> String {
        self.path.clone().unwrap_or_else(|| self.model.clone())
    }

    /// Whether `other` is the same camera, possibly under another path: the same device in the same socket.
    /// Serial numbers alone are not enough, because cheap cameras share theirs.
    pub fn is_same_as(&self, other: &Self) -> bool {
        let traits = |camera: &Self| {
            let Self { driver, model, bus, part, usb_product, serial_number, .. } = camera.clone();
            (driver, model, bus, part, usb_product, serial_number)
        };
        traits(self) == traits(other)
    }

    /// Whether nothing but the socket tells the two cameras apart. udev then gives one of them the name in
    /// `/dev/v4l/by-id`, whichever was connected last.
    pub(super) fn is_twin_of(&self, other: &Self) -> bool {
        let traits = |camera: &Self| {
            let Self { driver, model, part, serial_number, .. } = camera.clone();
            (driver, model, part, serial_number)
        };
        self.bus != other.bus && traits(self) == traits(other)
    }

    /// This camera among those that are `connected`, after it was pulled out: in its own socket, or else in
    /// another one, if it has a serial number and no twin. `None` if it is not there. `twins` are the sockets
    /// of cameras that nothing else told apart from it while it was connected.
    ///
    /// # Errors
    /// [`CameraError::AnotherSocket`] if a camera like it has come in another socket that could be another
    /// one; [`CameraError::AnotherCamera`] if it is not there, and another one is in its socket.
    pub fn returned<'a>(
        &self,
        twins: &[String],
        connected: &'a [Self],
    ) -> Result<Option<&'a Self>, CameraError> {
        if let Some(here) = connected.iter().find(|camera| camera.is_same_as(self)) {
            return Ok(Some(here));
        }
        let is_new = |camera: &&Self| {
            camera.is_twin_of(self) && camera.usb_product == self.usb_product && !twins.contains(&camera.bus)
        };
        let new: Vec<&Self> = connected.iter().filter(is_new).collect();
        let why = match new[..] {
            [] => {
                let place = |camera: &&Self| (&camera.bus, &camera.part) == (&self.bus, &self.part);
                return connected.iter().find(place).map_or(Ok(None), |other| {
                    Err(CameraError::AnotherCamera {
                        path: other.name(),
                        expected: self.to_string(),
                        found: other.to_string(),
                    })
                });
            }
            _ if self.serial_number.is_none() => "it has no serial number",
            [camera] if twins.is_empty() => return Ok(Some(camera)),
            _ => "other cameras have its serial number, too",
        };
        Err(CameraError::AnotherSocket { camera: self.to_string(), found: new[0].to_string(), why })
    }

    /// A name that stays the same when it is connected again, if it has one: independent of the socket,
    /// unless it has a twin among `connected`.
    pub fn lasting_name(&self, connected: &[Self]) -> String {
        let has_twin = connected.iter().any(|other| self.is_twin_of(other));
        let mut lasting = self.links.iter().filter(|link| !has_twin || !is_by_id(link));
        lasting.next().cloned().unwrap_or_else(|| self.name())
    }
}

/// Folder of the names that do not depend on the socket.
const BY_ID: &str = "/dev/v4l/by-id/";

/// Whether the name of a link is one of those of [`BY_ID`], for USB cameras: bus, maker, model and serial
/// number. Those of by-path begin with the bus of the controller.
fn is_by_id(link: &str) -> bool {
    link.starts_with("usb-")
}

impl fmt::Display for CameraIdentity {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{}", self.name())?;
        let mut known = Vec::new();
        if self.path.is_some() {
            known.push(self.model.clone());
        }
        known.extend(self.serial_number.iter().map(|serial_number| format!("usb:{serial_number}")));
        known.extend(self.links.iter().cloned());
        if !self.bus.is_empty() {
            known.push(format!("at {}", self.bus));
        }
        if known.is_empty() { Ok(()) } else { write!(to, " ({})", known.join(", ")) }
    }
}

/// The selection of a camera.
///
/// ```
/// use epirig_devices::camera::CameraChoice;
///
/// assert_eq!("/dev/video0".parse(), Ok(CameraChoice::Path("/dev/video0".into())));
/// assert_eq!("usb:1A2B".parse(), Ok(CameraChoice::UsbSerial("1A2B".into())));
/// assert_eq!("replay:seq".parse(), Ok(CameraChoice::Replay("seq".into())));
/// assert_eq!("sim".parse(), Ok(CameraChoice::Simulated));
/// assert_eq!("usb-046d_C920_1A2B-video-index0".parse(),
///            Ok(CameraChoice::Link("usb-046d_C920_1A2B-video-index0".into())));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CameraChoice {
    /// The only camera.
    Any,
    /// By path, which may be a symbolic link.
    Path(String),
    /// By the name of a link in `/dev/v4l/by-id` or `/dev/v4l/by-path`.
    Link(String),
    /// `usb:SERIAL`.
    UsbSerial(String),
    /// `replay:FOLDER`: the frames of a sequence.
    Replay(String),
    /// `sim`: a simulated camera that sees a simulated object.
    Simulated,
}

impl FromStr for CameraChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const HELP: &str = "a camera is a path such as /dev/video0, a name in /dev/v4l/by-id, usb:SERIAL, replay:FOLDER or sim";
        let named = |name: &str, make: fn(String) -> Self| {
            if name.is_empty() { Err(HELP.to_owned()) } else { Ok(make(name.to_owned())) }
        };
        if let Some(name) = text.strip_prefix(BY_ID) {
            return named(name, Self::Link);
        }
        match text.split_once(':') {
            _ if text == "sim" => Ok(Self::Simulated),
            Some(("usb", serial_number)) => named(serial_number, Self::UsbSerial),
            Some(("replay", folder)) => named(folder, Self::Replay),
            _ if text.contains('/') => named(text, Self::Path),
            _ => named(text, Self::Link),
        }
    }
}

impl fmt::Display for CameraChoice {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Any => write!(to, "a camera"),
            Self::Path(name) | Self::Link(name) => write!(to, "{name}"),
            Self::UsbSerial(serial_number) => write!(to, "usb:{serial_number}"),
            Self::Replay(folder) => write!(to, "replay:{folder}"),
            Self::Simulated => write!(to, "sim"),
        }
    }
}

impl CameraChoice {
    fn fits(&self, camera: &CameraIdentity) -> bool {
        match self {
            Self::Any => true,
            Self::Path(path) => camera.path.as_ref() == Some(path),
            Self::Link(name) => camera.links.contains(name),
            Self::UsbSerial(serial_number) => camera.serial_number.as_ref() == Some(serial_number),
            Self::Replay(_) | Self::Simulated => false,
        }
    }
}

/// The path of the only camera among `cameras` that matches. A path is returned unchanged, because unlisted
/// links are valid too. A name in `/dev/v4l/by-id` matches all cameras that udev would give it.
///
/// # Errors
/// [`CameraError::NoMatch`] if none matches, [`CameraError::Ambiguous`] if several do.
pub fn choose(choice: &CameraChoice, cameras: &[CameraIdentity]) -> Result<String, CameraError> {
    if let CameraChoice::Path(path) = choice {
        return Ok(path.clone());
    }
    let list = |cameras: &[&CameraIdentity]| {
        let lines: Vec<String> = cameras.iter().map(ToString::to_string).collect();
        if lines.is_empty() { "nothing".to_owned() } else { lines.join(", ") }
    };
    let by_id = matches!(choice, CameraChoice::Link(name) if is_by_id(name));
    let fits = |camera: &CameraIdentity| {
        let has_fitting_twin = || cameras.iter().any(|other| choice.fits(other) && other.is_twin_of(camera));
        choice.fits(camera) || by_id && has_fitting_twin()
    };
    let fitting: Vec<&CameraIdentity> = cameras.iter().filter(|camera| fits(camera)).collect();
    match fitting[..] {
        [camera] => Ok(camera.path.clone().unwrap_or_default()),
        [] => Err(CameraError::NoMatch {
            wanted: choice.to_string(),
            connected: list(&cameras.iter().collect::<Vec<_>>()),
        }),
        _ => Err(CameraError::Ambiguous { wanted: choice.to_string(), candidates: list(&fitting) }),
    }
}

#[cfg(test)]
mod tests {
    use std::slice;

    use super::*;

    fn camera(path: &str, serial_number: Option<&str>, link: Option<&str>) -> CameraIdentity {
        CameraIdentity {
            driver: "uvcvideo".to_owned(),
            model: "HD Pro Webcam C920".to_owned(),
            bus: format!("usb-0000:00:14.0-{}", path.len()),
            path: Some(path.to_owned()),
            part: String::new(),
            usb_product: Some("046d:082d".to_owned()),
            serial_number: serial_number.map(str::to_owned),
            links: link.into_iter().map(str::to_owned).collect(),
        }
    }

    #[test]
    fn one_fitting_camera_is_taken_and_more_are_refused() {
        let bench = [
            camera("/dev/video0", Some("A1"), Some("usb-046d_C920_A1-video-index0")),
            camera("/dev/video2", Some("B2"), None),
            camera("/dev/video4", Some("B2"), None),
        ];
        let pick = |text: &str| choose(&text.parse().unwrap(), &bench);
        assert_eq!(pick("usb:A1").unwrap(), "/dev/video0");
        assert_eq!(pick("usb-046d_C920_A1-video-index0").unwrap(), "/dev/video0");
        assert_eq!(pick("/dev/my-camera").unwrap(), "/dev/my-camera");
        let error = pick("usb:B2").unwrap_err();
        assert!(
            matches!(&error, CameraError::Ambiguous { candidates, .. }
            if candidates.contains("/dev/video2") && candidates.contains("/dev/video4")),
            "{error}"
        );
        assert!(matches!(pick("usb:C3"), Err(CameraError::NoMatch { .. })));
        assert!(matches!(choose(&CameraChoice::Any, &bench), Err(CameraError::Ambiguous { .. })));
        assert_eq!(choose(&CameraChoice::Any, &bench[..1]).unwrap(), "/dev/video0");
        assert!(matches!(choose(&CameraChoice::Any, &[]), Err(CameraError::NoMatch { .. })));
    }

    #[test]
    fn a_camera_is_known_again_by_its_serial_number_and_its_place() {
        let first = camera("/dev/video0", Some("A1"), None);
        assert!(first.is_same_as(&camera("/dev/video1", Some("A1"), None)));
        assert!(
            !first.is_same_as(&camera("/dev/video12", Some("A1"), None)),
            "the same kind in another socket"
        );
        let other_lens = CameraIdentity { part: "1.2, 0".to_owned(), ..first.clone() };
        assert!(!first.is_same_as(&other_lens));
        assert!(!first.is_same_as(&camera("/dev/video0", Some("B2"), None)));
        assert!(!first.is_same_as(&camera("/dev/video0", None, None)));
        let plain = camera("/dev/video0", None, None);
        assert!(plain.is_same_as(&camera("/dev/video1", None, None)));
        assert!(!plain.is_same_as(&camera("/dev/video10", None, None)), "another socket");
    }

    #[test]
    fn of_two_cameras_with_one_serial_number_none_is_chosen_by_it() {
        let link = "usb-046d_C920_B2-video-index0";
        let mut bench = [
            camera("/dev/video0", Some("A1"), Some("usb-046d_C920_A1-video-index0")),
            camera("/dev/video12", Some("B2"), Some(link)),
            camera("/dev/video4", Some("B2"), None),
        ];
        bench[2].links.push("pci-0000:00:14.0-usb-0:4:1.0-video-index0".to_owned());
        let pick = |text: &str| choose(&text.parse().unwrap(), &bench);
        for name in ["usb:B2".to_owned(), link.to_owned(), format!("/dev/v4l/by-id/{link}")] {
            let error = pick(&name).unwrap_err();
            assert!(matches!(error, CameraError::Ambiguous { .. }), "{name}: {error}");
        }
        assert_eq!(pick("/dev/video12").unwrap(), "/dev/video12");
        assert_eq!(pick(&bench[2].links[0]).unwrap(), "/dev/video4");
        let names = [0, 1, 2].map(|index| bench[index].lasting_name(&bench));
        assert_eq!(names, [&bench[0].links[0], "/dev/video12", &bench[2].links[0]]);
        // Alone, its name will do.
        assert_eq!(choose(&link.parse().unwrap(), &bench[..2]).unwrap(), "/dev/video12");
        assert_eq!(bench[1].lasting_name(&bench[..2]), link);
    }

    #[test]
    fn a_camera_in_another_socket_is_the_same_only_if_its_serial_number_is_its_own() {
        let (first, moved) =
            (camera("/dev/video0", Some("A1"), None), camera("/dev/video10", Some("A1"), None));
        let found = |before: &CameraIdentity, twins: &[String], now: &[CameraIdentity]| {
            before.returned(twins, now).map(|found| found.and_then(|camera| camera.path.clone()))
        };
        let refused = |result| matches!(result, Err(CameraError::AnotherSocket { .. }));
        let at = |camera: &CameraIdentity| Some(camera.path.clone().unwrap());
        assert_eq!(found(&first, &[], &[]).unwrap(), None);
        assert_eq!(found(&first, &[], slice::from_ref(&moved)).unwrap(), at(&moved));
        // In its own socket it is taken first, under any path.
        let back = camera("/dev/video1", Some("A1"), None);
        assert_eq!(found(&first, &[], &[moved.clone(), back.clone()]).unwrap(), at(&back));
        let other = camera("/dev/video10", Some("B2"), None);
        let kind = CameraIdentity { usb_product: Some("046d:0825".to_owned()), ..moved.clone() };
        assert_eq!(found(&first, &[], &[other, kind]).unwrap(), None, "others are not it");
        // The number of its device file may be another, but its socket is taken.
        let exchanged = found(&first, &[], &[camera("/dev/video1", Some("B2"), None)]);
        assert!(matches!(exchanged, Err(CameraError::AnotherCamera { .. })));
        // A twin that was there before is not it; one of two in other sockets may be.
        let twin = camera("/dev/video100", Some("A1"), None);
        let known = [twin.bus.clone()];
        assert_eq!(found(&first, &known, slice::from_ref(&twin)).unwrap(), None);
        assert!(refused(found(&first, &known, &[twin.clone(), moved.clone()])));
        assert!(refused(found(&first, &[], &[twin, moved])));
        let plain = |path| camera(path, None, None);
        assert!(refused(found(&plain("/dev/video0"), &[], &[plain("/dev/video10")])));
    }

    #[test]
    fn nonsense_is_no_choice() {
        for text in ["", "usb:", "replay:"] {
            assert!(text.parse::<CameraChoice>().is_err(), "{text}");
        }
    }
}
